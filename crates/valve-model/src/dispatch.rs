//! Chooses, at run time, the widest registers of the machine for the lanes.
//!
//! The one place with `unsafe`: calling a function compiled for more instructions than the baseline
//! is sound only where the machine has them, which is asked first. Registers of four and of eight
//! numbers give the same bits, with products and sums fused; the baseline gives those of the scalar path
//! (see [`crate::real`]).

use crate::integrator::{LaneRun, Recorders, Take, integrate};
use crate::real::{LANES, Lanes, Real};
use crate::terms::groups;

/// Instructions that the lanes may be compiled for, the widest last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum InstructionSet {
    /// What every machine of the target has.
    Baseline,
    /// Registers of four numbers, with fused products and sums (x86-64).
    Avx2,
    /// Registers of eight numbers, with fused products and sums (x86-64).
    Avx512,
}

impl InstructionSet {
    /// All of them, whether the machine has them or not.
    pub const ALL: [Self; 3] = [Self::Baseline, Self::Avx2, Self::Avx512];

    /// Whether the machine has them.
    #[must_use]
    pub fn is_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_available() && is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq")
            }
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    /// The widest that the machine has.
    #[must_use]
    pub fn widest() -> Self {
        Self::ALL.into_iter().rev().find(|set| set.is_available()).unwrap_or(Self::Baseline)
    }

    /// Their name, for reports and benches.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Avx2 => "AVX2",
            Self::Avx512 => "AVX-512",
        }
    }
}

/// Integrates runs with the same groups of terms, with the baseline where the machine lacks `set`. A lone run
/// has the bits that it has beside others.
#[cfg_attr(target_arch = "x86_64", expect(unsafe_code, reason = "each call follows a test for its instructions"))]
pub(crate) fn integrate_with(
    set: InstructionSet,
    runs: &[LaneRun<'_>],
    recorders: &mut Recorders,
    take: &mut Take<'_>,
) {
    match set {
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 | InstructionSet::Avx2 if set.is_available() && runs.len() == 1 => {
            // SAFETY: the machine has AVX2 and FMA, which both sets ask for.
            unsafe { alone_with_avx2(runs, recorders, take) }
        }
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 if set.is_available() => {
            // SAFETY: the machine has AVX-512 F and DQ, AVX2 and FMA.
            unsafe { with_avx512(runs, recorders, take) }
        }
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 if set.is_available() => {
            // SAFETY: the machine has AVX2 and FMA.
            unsafe { with_avx2(runs, recorders, take) }
        }
        _ if runs.len() == 1 => integrate_scalar(runs, recorders, take),
        _ => any_loop::<Lanes<LANES, false>>(runs, recorders, take),
    }
}

/// Integrates runs one after another on the scalar path.
pub(crate) fn integrate_scalar(runs: &[LaneRun<'_>], recorders: &mut Recorders, take: &mut Take<'_>) {
    any_loop::<f64>(runs, recorders, take);
}

/// In the loop of the base model, or in that for any groups of terms.
#[inline(always)]
fn any_loop<R: Real>(runs: &[LaneRun<'_>], recorders: &mut Recorders, take: &mut Take<'_>) {
    match runs[0].equations.terms.groups() {
        0 => integrate::<R, 0>(runs, recorders, take),
        _ => integrate::<R, { groups::ANY }>(runs, recorders, take),
    }
}

/// What a search for something outside the catalogue asks for.
const CUSTOM_FRICTION: u8 = groups::CUSTOM | groups::FRICTION;

const FORCES_FRICTION: u8 = groups::FORCES | groups::FRICTION;
const FORCES_HEATING: u8 = groups::FORCES | groups::HEATING;
const FORCES_LINE: u8 = groups::FORCES | groups::LINE;
const FRICTION_HEATING: u8 = groups::FRICTION | groups::HEATING;
const FRICTION_LINE: u8 = groups::FRICTION | groups::LINE;

/// A cylinder that its recorded pressure drives, on stops that are damped.
const PRESCRIBED_FORCES: u8 = groups::PRESCRIBED | groups::FORCES;
const PRESCRIBED_FRICTION: u8 = groups::PRESCRIBED | groups::FORCES | groups::FRICTION;

/// In a loop for the very groups of terms, where they are one of those that a search mostly asks for.
#[inline(always)]
fn own_loop<R: Real>(runs: &[LaneRun<'_>], recorders: &mut Recorders, take: &mut Take<'_>) {
    match runs[0].equations.terms.groups() {
        groups::FORCES => integrate::<R, { groups::FORCES }>(runs, recorders, take),
        groups::FRICTION => integrate::<R, { groups::FRICTION }>(runs, recorders, take),
        groups::HEATING => integrate::<R, { groups::HEATING }>(runs, recorders, take),
        groups::LINE => integrate::<R, { groups::LINE }>(runs, recorders, take),
        groups::SPOOL => integrate::<R, { groups::SPOOL }>(runs, recorders, take),
        groups::CUSTOM => integrate::<R, { groups::CUSTOM }>(runs, recorders, take),
        CUSTOM_FRICTION => integrate::<R, CUSTOM_FRICTION>(runs, recorders, take),
        FORCES_FRICTION => integrate::<R, FORCES_FRICTION>(runs, recorders, take),
        FORCES_HEATING => integrate::<R, FORCES_HEATING>(runs, recorders, take),
        FORCES_LINE => integrate::<R, FORCES_LINE>(runs, recorders, take),
        FRICTION_HEATING => integrate::<R, FRICTION_HEATING>(runs, recorders, take),
        FRICTION_LINE => integrate::<R, FRICTION_LINE>(runs, recorders, take),
        PRESCRIBED_FORCES => integrate::<R, PRESCRIBED_FORCES>(runs, recorders, take),
        PRESCRIBED_FRICTION => integrate::<R, PRESCRIBED_FRICTION>(runs, recorders, take),
        _ => any_loop::<R>(runs, recorders, take),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,fma")]
fn with_avx512(runs: &[LaneRun<'_>], recorders: &mut Recorders, take: &mut Take<'_>) {
    own_loop::<Lanes<LANES, true>>(runs, recorders, take);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn with_avx2(runs: &[LaneRun<'_>], recorders: &mut Recorders, take: &mut Take<'_>) {
    own_loop::<Lanes<LANES, true>>(runs, recorders, take);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn alone_with_avx2(runs: &[LaneRun<'_>], recorders: &mut Recorders, take: &mut Take<'_>) {
    any_loop::<Lanes<1, true>>(runs, recorders, take);
}
