//! Sticking and sliding (Armstrong-Hélouvry et al. 1994): a sliding lane sticks where its velocity
//! passes zero, a sticking lane slides where the force passes what friction holds.

use super::{Front, MAX_LANES};
use crate::real::Real;
use crate::rhs::{Rates, State};

/// What changes within a step, lane by lane.
pub(super) struct Changes {
    /// The share of the step after which the lane changes.
    pub share: [Option<f64>; MAX_LANES],
    /// The lane tried to slide from rest and was held: it sticks for the whole step.
    pub stick_now: [bool; MAX_LANES],
}

impl Changes {
    pub(super) fn any(&self) -> bool {
        self.share.iter().any(Option::is_some)
    }

    /// Shortens the step of each lane that changes to end at its change; returns what is left of them, s.
    pub(super) fn shorten<R: Real>(&self, front: &mut Front<R>) -> [f64; MAX_LANES] {
        let mut cut = [0.0; MAX_LANES];
        for (lane, cut) in cut.iter_mut().enumerate() {
            let Some(share) = self.share[lane] else { continue };
            let whole = front.step.lane(lane);
            front.step.set_lane(lane, share * whole);
            *cut = whole - share * whole;
            if self.stick_now[lane] {
                front.slide.set_lane(lane, 0.0);
            }
        }
        cut
    }
}

/// Looks for changes within a step from the rates at its start and end.
#[inline(never)]
pub(super) fn changes<R: Real>(
    front: &Front<R>,
    first: &Rates<R>,
    next: &State<R>,
    last: &Rates<R>,
    lanes: usize,
) -> Changes {
    let mut changes = Changes { share: [None; MAX_LANES], stick_now: [false; MAX_LANES] };
    for lane in 0..lanes {
        let step = front.step.lane(lane);
        if step == 0.0 {
            continue;
        }
        let slide = front.slide.lane(lane);
        if slide == 0.0 {
            let before = first.net_force.lane(lane).abs() - first.hold.lane(lane);
            let after = last.net_force.lane(lane).abs() - last.hold.lane(lane);
            if after > 0.0 || before > 0.0 {
                let share = if before >= 0.0 { 0.0 } else { before / (before - after) };
                changes.share[lane] = Some(share);
            }
        } else if next.v.lane(lane) * slide < 0.0 {
            let before = front.state.v.lane(lane);
            if before * slide > 0.0 {
                changes.share[lane] = Some(zero_crossing(before, first.rate.v.lane(lane) * step, next.v.lane(lane)));
            } else {
                changes.share[lane] = Some(1.0);
                changes.stick_now[lane] = true;
            }
        }
    }
    changes
}

/// Where the parabola with value and slope `v0`, `slope` at 0 and value `v1` at 1 passes zero in (0, 1].
fn zero_crossing(v0: f64, slope: f64, v1: f64) -> f64 {
    let bend = v1 - v0 - slope;
    let root = (slope * slope - 4.0 * bend * v0).max(0.0).sqrt();
    // The numerically safe forms of both roots; the first one in the step counts.
    let q = -0.5 * (slope + root.copysign(slope));
    let candidates = [q / bend, v0 / q];
    let inside = |share: &f64| *share > 0.0 && *share <= 1.0;
    candidates.into_iter().filter(inside).fold(f64::INFINITY, f64::min).min(1.0)
}

/// Puts the lanes that have changed into their new state of friction.
#[inline(never)]
pub(super) fn settle<R: Real>(changes: &Changes, next: &mut State<R>, slide: &mut R, at: &Rates<R>) {
    for lane in 0..R::LANES {
        if changes.share[lane].is_none() || changes.stick_now[lane] {
            continue;
        }
        let force = at.net_force.lane(lane);
        let was_stuck = slide.lane(lane) == 0.0;
        next.v.set_lane(lane, 0.0);
        if was_stuck || force.abs() > at.hold.lane(lane) {
            slide.set_lane(lane, if force < 0.0 { -1.0 } else { 1.0 });
        } else {
            slide.set_lane(lane, 0.0);
        }
    }
}
