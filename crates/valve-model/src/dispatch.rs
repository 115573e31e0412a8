//! Chooses, at run time, the widest registers of the machine for the lanes.
//!
//! The one place with `unsafe`: calling a function compiled for more instructions than the baseline
//! is sound only where the machine has them, which is asked first. Results do not depend on the
//! choice (see [`crate::real`]).

use crate::integrator::{LaneRun, Recorder, Take, integrate};
use crate::real::Lanes;

/// How many runs advance together.
pub const LANES: usize = 8;

/// Instructions that the lanes may be compiled for, the widest last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum InstructionSet {
    /// What every machine of the target has.
    Baseline,
    /// Registers of four numbers (x86-64).
    Avx2,
    /// Registers of eight numbers (x86-64).
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
            Self::Avx2 => is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq"),
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

/// Integrates runs side by side in [`LANES`] lanes, with the baseline where the machine lacks `set`.
#[cfg_attr(target_arch = "x86_64", expect(unsafe_code, reason = "each call follows a test for its instructions"))]
pub(crate) fn integrate_lanes(
    set: InstructionSet,
    base: bool,
    runs: &[LaneRun<'_>],
    recorder: &mut Recorder<Lanes<LANES>>,
    take: &mut Take<'_>,
) {
    match set {
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 if set.is_available() => {
            // SAFETY: the machine has AVX-512 F and DQ.
            unsafe { with_avx512(base, runs, recorder, take) }
        }
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 if set.is_available() => {
            // SAFETY: the machine has AVX2.
            unsafe { with_avx2(base, runs, recorder, take) }
        }
        _ => either(base, runs, recorder, take),
    }
}

#[inline(always)]
fn either(base: bool, runs: &[LaneRun<'_>], recorder: &mut Recorder<Lanes<LANES>>, take: &mut Take<'_>) {
    if base { integrate::<_, true>(runs, recorder, take) } else { integrate::<_, false>(runs, recorder, take) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq")]
fn with_avx512(base: bool, runs: &[LaneRun<'_>], recorder: &mut Recorder<Lanes<LANES>>, take: &mut Take<'_>) {
    either(base, runs, recorder, take);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2(base: bool, runs: &[LaneRun<'_>], recorder: &mut Recorder<Lanes<LANES>>, take: &mut Take<'_>) {
    either(base, runs, recorder, take);
}
