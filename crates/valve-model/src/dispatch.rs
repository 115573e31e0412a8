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
fn any_loop<R: Real>(runs: &[LaneRun<'_>], recorders: &mut Recorders, take: &mut Take<'_>) {
    match runs[0].equations.terms.groups() {
        0 => in_loop::<R, 0>(runs, recorders, take),
        _ => in_loop::<R, { groups::ANY }>(runs, recorders, take),
    }
}

#[inline(never)]
fn in_loop<R: Real, const GROUPS: u8>(runs: &[LaneRun<'_>], recorders: &mut Recorders, take: &mut Take<'_>) {
    integrate::<R, GROUPS>(runs, recorders, take);
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

/// The loops for an instruction set, each a function of its own: what a compiler does with a function takes it longer than
/// in proportion to its size. Runs go to the loop for their very groups of terms, where those are one of the sets that a
/// search mostly asks for.
#[cfg(target_arch = "x86_64")]
macro_rules! loops {
    ($choose:ident, $in_loop:ident, $instructions:literal) => {
        #[target_feature(enable = $instructions)]
        fn $choose(runs: &[LaneRun<'_>], recorders: &mut Recorders, take: &mut Take<'_>) {
            let in_loop = match runs[0].equations.terms.groups() {
                0 => $in_loop::<0>,
                groups::FORCES => $in_loop::<{ groups::FORCES }>,
                groups::FRICTION => $in_loop::<{ groups::FRICTION }>,
                groups::HEATING => $in_loop::<{ groups::HEATING }>,
                groups::LINE => $in_loop::<{ groups::LINE }>,
                groups::SPOOL => $in_loop::<{ groups::SPOOL }>,
                groups::CUSTOM => $in_loop::<{ groups::CUSTOM }>,
                CUSTOM_FRICTION => $in_loop::<CUSTOM_FRICTION>,
                FORCES_FRICTION => $in_loop::<FORCES_FRICTION>,
                FORCES_HEATING => $in_loop::<FORCES_HEATING>,
                FORCES_LINE => $in_loop::<FORCES_LINE>,
                FRICTION_HEATING => $in_loop::<FRICTION_HEATING>,
                FRICTION_LINE => $in_loop::<FRICTION_LINE>,
                PRESCRIBED_FORCES => $in_loop::<PRESCRIBED_FORCES>,
                PRESCRIBED_FRICTION => $in_loop::<PRESCRIBED_FRICTION>,
                _ => $in_loop::<{ groups::ANY }>,
            };
            in_loop(runs, recorders, take);
        }

        #[target_feature(enable = $instructions)]
        fn $in_loop<const GROUPS: u8>(runs: &[LaneRun<'_>], recorders: &mut Recorders, take: &mut Take<'_>) {
            integrate::<Lanes<LANES, true>, GROUPS>(runs, recorders, take);
        }
    };
}

#[cfg(target_arch = "x86_64")]
loops!(with_avx512, in_avx512_loop, "avx512f,avx512dq,fma");
#[cfg(target_arch = "x86_64")]
loops!(with_avx2, in_avx2_loop, "avx2,fma");

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn alone_with_avx2(runs: &[LaneRun<'_>], recorders: &mut Recorders, take: &mut Take<'_>) {
    match runs[0].equations.terms.groups() {
        0 => alone_in_avx2_loop::<0>(runs, recorders, take),
        _ => alone_in_avx2_loop::<{ groups::ANY }>(runs, recorders, take),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn alone_in_avx2_loop<const GROUPS: u8>(runs: &[LaneRun<'_>], recorders: &mut Recorders, take: &mut Take<'_>) {
    integrate::<Lanes<1, true>, GROUPS>(runs, recorders, take);
}
