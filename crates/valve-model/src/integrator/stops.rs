//! Where a stop begins or ends to push within a step.
//!
//! The stages of a Runge-Kutta method weigh a force as if it were smooth. That of a stop begins and ends at once, and how much of it
//! they miss depends on where in the step that is: a piston that is thrown back would leave a little faster or slower by chance,
//! the later motion would follow, and a fit would see steps in place of slopes. What they miss is known to the order of the step where
//! the depth passes zero, and is added at its end. (On what discontinuities do to such methods: Hairer, Nørsett and Wanner, Solving
//! Ordinary Differential Equations I, section II.6.)

use super::STAGES;
use crate::real::Real;

/// A stop, in every lane.
pub(super) struct Stop<R> {
    /// Its stiffness, N/m.
    pub stiffness: R,
    /// Its damping, N s/m; it holds nothing back.
    pub damping: R,
}

/// How deep the piston is in a stop, m, and how fast it goes deeper, m/s.
#[derive(Clone, Copy)]
pub(super) struct Depth<R> {
    pub m: R,
    pub rate: R,
}

/// What the stages of a step miss of a force: the part of the mean force that moves the piston, and the one that changes
/// its speed, N.
pub(super) struct Missed<R> {
    pub moves: R,
    pub speeds: R,
}

impl<R: Real> Stop<R> {
    /// What is missed of the push of this stop over a step between two depths.
    #[inline(always)]
    pub fn missed(&self, from: Depth<R>, to: Depth<R>, step: R) -> Missed<R> {
        let (zero, one) = (R::splat(0.0), R::splat(1.0));
        let push = |depth: Depth<R>| self.damping.mul_add(depth.rate, self.stiffness * depth.m);
        let both = |a: R, b: R| a * b;
        let is_above_zero = |value: R| zero.select_lt(value, one, zero);
        let (before, after) = (push(from), push(to));
        let enters = both(from.m.select_lt(zero, one, zero), is_above_zero(to.m));
        // A damped stop lets go before the piston has left it.
        let leaves = both(both(is_above_zero(from.m), is_above_zero(before)), after.select_lt(zero, one, zero));
        // What passes zero, taken as straight over the step: the depth on the way in, the push on the way out. Where the stages in the
        // middle saw the piston on its way in follows from the speed at the start.
        let start = zero.select_lt(enters, from.m, before);
        let way = zero.select_lt(enters, to.m - from.m, before - after);
        let passed = (start.abs() / way.abs().max(R::splat(f64::MIN_POSITIVE))).min(one);
        let seen = (R::splat(STAGES[1].0) * step).mul_add(from.rate, from.m);
        let (kink, leap) = (kink(passed), leap(passed, seen));
        let slope = zero.select_lt(enters, self.stiffness * way, both(leaves, way)).abs();
        let height = both(enters, self.damping * way.abs()) / step.max(R::splat(f64::MIN_POSITIVE));
        Missed {
            moves: slope.mul_add(kink.moves, height * leap.moves),
            speeds: slope.mul_add(kink.speeds, height * leap.speeds),
        }
    }
}

/// What the stages miss of a force that grows by one per step from where this share of the step has passed.
#[inline(always)]
fn kink<R: Real>(passed: R) -> Missed<R> {
    let rest = R::splat(1.0) - passed;
    let middle = (R::splat(STAGES[1].0) - passed).max(R::splat(0.0));
    missed([rest * rest * rest * R::splat(1.0 / 6.0), rest * rest * R::splat(0.5)], middle, rest)
}

/// What they miss of a force of one that begins there; how deep the piston was at those in the middle.
#[inline(always)]
fn leap<R: Real>(passed: R, middle: R) -> Missed<R> {
    let (zero, one) = (R::splat(0.0), R::splat(1.0));
    let rest = one - passed;
    missed([rest * rest * R::splat(0.5), rest], zero.select_lt(middle, one, zero), one)
}

/// What a force makes of way and speed in a step, less what the stages have of it: nothing at the first, the same at both in the
/// middle. It moves the piston in the step only through the speeds of later stages.
#[inline(always)]
fn missed<R: Real>([way, speed]: [R; 2], middle: R, last: R) -> Missed<R> {
    let weight = |stage: usize| R::splat(STAGES[stage].1);
    Missed {
        moves: way - R::splat(1.0 / 3.0) * middle,
        speeds: speed - weight(3).mul_add(last, (weight(1) + weight(2)) * middle),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STIFFNESS: f64 = 1e6;
    const MASS: f64 = 2.0;
    const WEIGHT: f64 = 20.0;

    /// Speeds with which a body that falls onto a stop leaves it again, over that of its fall, for falls that begin at different
    /// times within a step.
    fn rebounds(damping: f64, step: f64, is_corrected: bool) -> Vec<f64> {
        let stop = Stop { stiffness: STIFFNESS, damping };
        let rate = |[x, v]: [f64; 2]| {
            let push = if x < 0.0 { (-STIFFNESS * x - damping * v).max(0.0) } else { 0.0 };
            [v, (push - WEIGHT) / MASS]
        };
        let of_phase = |phase: usize| {
            let mut state = [0.002 + 5e-6 * phase as f64, -0.3];
            let fall = f64::sqrt(0.3 * 0.3 + 2.0 * WEIGHT / MASS * state[0]);
            loop {
                let (mut sum, mut last) = (state, [0.0; 2]);
                for (share, weight) in STAGES {
                    let at = [0, 1].map(|i| state[i] + share * step * last[i]);
                    last = rate(at);
                    sum = [0, 1].map(|i| sum[i] + weight * step * last[i]);
                }
                if is_corrected {
                    let depth = |[x, v]: [f64; 2]| Depth { m: -x, rate: -v };
                    let missed = stop.missed(depth(state), depth(sum), step);
                    sum[0] += missed.moves * step * step / MASS;
                    sum[1] += missed.speeds * step / MASS;
                }
                state = sum;
                if state[0] > 0.0 && state[1] > 0.0 {
                    break f64::sqrt(state[1] * state[1] + 2.0 * WEIGHT / MASS * state[0]) / fall;
                }
            }
        };
        (0..60).map(of_phase).collect()
    }

    fn spread(values: &[f64]) -> f64 {
        let most = values.iter().copied().fold(f64::MIN, f64::max);
        most - values.iter().copied().fold(f64::MAX, f64::min)
    }

    #[test]
    fn how_a_body_rebounds_does_not_depend_on_where_in_a_step_it_hits() {
        for (damping, step, most) in
            [(0.0, 2.5e-4, 1e-4), (0.0, 1e-3, 5e-3), (30.0, 2.5e-4, 2e-4), (300.0, 2.5e-4, 1e-3)]
        {
            let [by_stages, corrected] = [false, true].map(|is| rebounds(damping, step, is));
            assert!(spread(&corrected) < most, "{damping} {step}: {}", spread(&corrected));
            assert!(spread(&by_stages) > 5.0 * spread(&corrected), "{damping} {step}: {}", spread(&by_stages));
            // A stop without damping gives back all it took.
            if damping == 0.0 {
                assert!(corrected.iter().all(|kept| (kept - 1.0).abs() < 2.0 * most), "{corrected:?}");
            }
        }
    }

    #[test]
    fn nothing_is_missed_of_a_stop_that_is_touched_all_the_time_or_never() {
        let stop = Stop { stiffness: STIFFNESS, damping: 10.0 };
        let deep = |m: f64| Depth { m, rate: 0.1 };
        for (from, to) in [(1e-3, 2e-3), (-1e-3, -2e-3), (0.0, 0.0), (2e-3, 1e-3)] {
            let missed = stop.missed(deep(from), deep(to), 1e-3);
            assert_eq!([missed.moves, missed.speeds], [0.0; 2], "{from} {to}");
        }
    }
}
