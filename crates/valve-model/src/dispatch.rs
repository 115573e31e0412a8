//! Chooses, at run time, the widest registers of the machine for the lanes.
//!
//! The one place with `unsafe`: calling a function compiled for more instructions than the baseline
//! is sound only where the machine has them, which is asked first. Results do not depend on the
//! choice (see [`crate::real`]).

use crate::integrator::{LaneRun, Recorder, integrate};
use crate::real::Lanes;
use crate::rhs::State;

/// How many runs advance together.
pub const LANES: usize = 8;

/// The name of the instruction set in use, for reports and benches.
pub fn instruction_set() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") {
            return "AVX-512";
        }
        if is_x86_feature_detected!("avx2") {
            return "AVX2";
        }
    }
    "baseline"
}

/// Integrates up to [`LANES`] runs side by side.
#[cfg_attr(target_arch = "x86_64", expect(unsafe_code, reason = "each call follows a test for its instructions"))]
pub(crate) fn integrate_lanes(
    base: bool,
    runs: &[LaneRun<'_>],
    recorder: &mut Recorder<Lanes<LANES>>,
) -> Vec<State<f64>> {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") {
            // SAFETY: the machine has AVX-512 F and DQ.
            return unsafe { with_avx512(base, runs, recorder) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the machine has AVX2.
            return unsafe { with_avx2(base, runs, recorder) };
        }
    }
    either(base, runs, recorder)
}

#[inline(always)]
fn either(base: bool, runs: &[LaneRun<'_>], recorder: &mut Recorder<Lanes<LANES>>) -> Vec<State<f64>> {
    if base { integrate::<_, true>(runs, recorder) } else { integrate::<_, false>(runs, recorder) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq")]
fn with_avx512(base: bool, runs: &[LaneRun<'_>], recorder: &mut Recorder<Lanes<LANES>>) -> Vec<State<f64>> {
    either(base, runs, recorder)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2(base: bool, runs: &[LaneRun<'_>], recorder: &mut Recorder<Lanes<LANES>>) -> Vec<State<f64>> {
    either(base, runs, recorder)
}
