//! Chooses, at run time, the widest registers of the machine for the lanes.
//!
//! The one place with `unsafe`: calling a function compiled for more instructions than the baseline
//! is sound only where the machine has them, which is asked first. Registers of four and of eight
//! numbers give the same bits, with products and sums fused; the baseline gives those of the scalar path
//! (see [`crate::real`]).

use crate::integrator::{LaneRun, Recorder, Take, integrate};
use crate::real::{Lanes, Real};

/// How many runs advance together.
pub const LANES: usize = 8;

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
                let wide = is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq");
                wide && is_x86_feature_detected!("fma")
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
    base: bool,
    runs: &[LaneRun<'_>],
    recorder: &mut Recorder,
    take: &mut Take<'_>,
) {
    match set {
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 | InstructionSet::Avx2 if set.is_available() && runs.len() == 1 => {
            // SAFETY: the machine has AVX2 and FMA: both sets ask for FMA, and AVX-512 F comes with AVX2.
            unsafe { with_avx2::<1>(base, runs, recorder, take) }
        }
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 if set.is_available() => {
            // SAFETY: the machine has AVX-512 F and DQ and FMA.
            unsafe { with_avx512(base, runs, recorder, take) }
        }
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 if set.is_available() => {
            // SAFETY: the machine has AVX2 and FMA.
            unsafe { with_avx2::<LANES>(base, runs, recorder, take) }
        }
        _ if runs.len() == 1 => integrate_scalar(base, runs, recorder, take),
        _ => either::<Lanes<LANES, false>>(base, runs, recorder, take),
    }
}

/// Integrates runs one after another on the scalar path.
pub(crate) fn integrate_scalar(base: bool, runs: &[LaneRun<'_>], recorder: &mut Recorder, take: &mut Take<'_>) {
    either::<f64>(base, runs, recorder, take);
}

#[inline(always)]
fn either<R: Real>(base: bool, runs: &[LaneRun<'_>], recorder: &mut Recorder, take: &mut Take<'_>) {
    if base { integrate::<R, true>(runs, recorder, take) } else { integrate::<R, false>(runs, recorder, take) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,fma")]
fn with_avx512(base: bool, runs: &[LaneRun<'_>], recorder: &mut Recorder, take: &mut Take<'_>) {
    either::<Lanes<LANES, true>>(base, runs, recorder, take);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn with_avx2<const N: usize>(base: bool, runs: &[LaneRun<'_>], recorder: &mut Recorder, take: &mut Take<'_>) {
    either::<Lanes<N, true>>(base, runs, recorder, take);
}
