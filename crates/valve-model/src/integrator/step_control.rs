//! How long the steps of a lane are: as stability asks for, shorter where a line feeds the pipe or the piston hits a stop,
//! longer where it rests on one.

use super::Front;
use crate::coefficients::Coefficients;
use crate::orifice::{EASED_LAMINAR, Laminar};
use crate::real::Real;
use crate::state::State;

/// How long the steps of one run may be, and what keeps them stable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepControl {
    /// Longest step, s.
    pub step_s: f64,
    /// Width to which the port's law would have to be regularised to be stable at that step; the integrator eases the port
    /// instead.
    pub port_laminar: f64,
    /// The same for the solenoid and the leaks, which are regularised.
    pub laminar: f64,
    /// The same for what a supply line feeds; 0 without such a line.
    pub line_laminar: f64,
    /// What is kept at that step of the rate at which pipe and chamber find one pressure, over the root of their relative
    /// difference ([`Coefficients::port_ease`]); infinite where the port is regularised after all.
    pub port_ease: f64,
    /// The same of the rate at which a pipe without a chamber finds its pressure ([`Coefficients::pipe_ease`]).
    pub pipe_ease: f64,
    /// Whether the eased port is to be followed in substeps while the piston moves: where something sticks and slips, each
    /// slip would meet a chamber that lags.
    pub follows_port: bool,
    /// How many steps one may span while the piston rests firmly on a stop: 1 or another divisor of a block.
    pub most_span: u32,
    /// Substeps that a lane may take.
    pub most_substeps: u32,
    /// Position from which on the last segment is over, m.
    pub ends_at_m: f64,
}

impl StepControl {
    /// How quickly the pipe finds its pressure beside a chamber, over how quickly it does alone, given its share of both
    /// volumes: what the port lets through while both it and the pipe are eased counts.
    pub(crate) fn taking_part(&self, together: f64) -> f64 {
        // The share s is together + (1 - together) k s, with k s what is kept at the port where the pipe begins to be eased.
        let kept = self.port_ease / self.pipe_ease;
        let rest = 1.0 - kept * (1.0 - together);
        if rest > together { together / rest } else { 1.0 }
    }
}

/// Steps after which a lane looks again whether it needs substeps.
pub(crate) const BLOCK: u32 = 8;

/// On a stop, supply, line and pipe closer than this (relative) are at one pressure for all purposes.
const REST_GAP: f64 = 1e-4;

/// The same where a piston rests.
const LONG_BLOCK: u32 = 4 * BLOCK;

/// A piston that presses on its stop with more than this share of what the supply can press on it is not about to
/// leave.
const FIRM: f64 = 0.02;

/// Substeps of the first block of a segment.
const FIRST_SUBSTEPS: u32 = 4;

/// Substeps at most in which a port is followed.
const FOLLOWING_SUBSTEPS: u32 = 4;

/// Substeps at most for what a line feeds while a piston is firmly pressed on its stop: what comes of that is rest, and the
/// pressures there do not depend on how wide the laminar part was on the way.
const PRESSED_SUBSTEPS: u32 = 4;

/// A piston that runs against a stop and would press it in by more than this share of its stroke is followed closely: with
/// how it bounces, all that is still to come would jump with where in a step it hits.
const HARD_HIT: f64 = 5e-3;

/// The angle of the swing on the stop that a step may then cover, the share of its speed that the damping of the stop, which
/// sets in at once, may take away in a step, and the most substeps that are taken for them.
const HIT_ANGLE: f64 = 0.15;
const HIT_SHED: f64 = 0.005;
const HIT_SUBSTEPS: u32 = 32;

/// The substeps that a block is taken in: more where the piston hits a stop hard, where a line feeds the pipe, and where a
/// piston may stick and slip.
#[inline(always)]
fn substeps<R: Real>(
    lane: usize,
    front: &Front<R>,
    state: &State<f64>,
    coefficients: &Coefficients<R>,
    control: StepControl,
) -> u32 {
    let stroke = coefficients.stroke.lane(lane);
    let inside = inside(stroke, state);
    let meets = inside < 0.0 && (state.v > 0.0) == (state.x > 0.5 * stroke);
    let shed = coefficients.stop_damping.lane(lane) * coefficients.inverse_mass.lane(lane) * control.step_s;
    let count = hit_substeps(
        state.v,
        inside,
        stroke,
        (swing(lane, coefficients) * control.step_s, shed),
        control.step_s,
        meets,
    );
    // A line only acts where it feeds the pipe.
    let feeds = control.line_laminar > 0.0 && (front.spool.lane(lane) > 0.0 || coefficients.leak_in.lane(lane) > 0.0);
    if feeds || control.follows_port {
        gas_substeps(lane, state, feeds, coefficients, control, count, inside)
    } else {
        count
    }
}

/// At least as many substeps as given, and as many as keep the laminar width of what a line feeds narrow and the port hardly eased.
fn gas_substeps<R: Real>(
    lane: usize,
    state: &State<f64>,
    feeds: bool,
    coefficients: &Coefficients<R>,
    control: StepControl,
    given: u32,
    inside: f64,
) -> u32 {
    let (chamber, pipe) = pressures(lane, state, coefficients);
    let line = if feeds { gap(state.line_pressure, pipe) } else { 0.0 };
    let drop = if feeds { gap(coefficients.supply.lane(lane), state.line_pressure) } else { 0.0 };
    let mut most = control.most_substeps;
    let mut follows_port = control.follows_port;
    if inside >= 0.0 {
        if line.max(drop) < REST_GAP {
            return given;
        }
        if is_firm(inside, lane, coefficients) {
            most = most.min(PRESSED_SUBSTEPS);
            follows_port = false;
        }
    }
    let port = gap(pipe, chamber);
    let wide = |count: u32| 0.8 * f64::from(count * count);
    let beyond = |count: u32| {
        let eased = follows_port && count < FOLLOWING_SUBSTEPS && control.port_laminar > port * wide(count);
        feeds && control.line_laminar > line * wide(count) || eased
    };
    let mut count = given;
    while count < most && beyond(count) {
        count *= 2;
    }
    count
}

/// The pressures of a state in chamber and pipe, Pa.
#[inline(always)]
fn pressures<R: Real>(lane: usize, state: &State<f64>, coefficients: &Coefficients<R>) -> (f64, f64) {
    let volume = coefficients.closed_volume.lane(lane) - coefficients.piston_area.lane(lane) * state.x;
    let chamber = state.chamber_mass * coefficients.zr.lane(lane) * state.chamber_temperature / volume;
    let temperature_ratio = state.pipe_temperature / coefficients.temperature.lane(lane);
    (chamber, state.pipe_mass * coefficients.pipe_gain.lane(lane) * temperature_ratio)
}

/// How far two pressures are apart, relative to the larger one.
#[inline(always)]
fn gap(a: f64, b: f64) -> f64 {
    (a - b).abs() / a.max(b)
}

/// Whether a piston so far inside a stop presses firmly on it.
#[inline(always)]
fn is_firm<R: Real>(inside: f64, lane: usize, coefficients: &Coefficients<R>) -> bool {
    let firm = FIRM * coefficients.supply.lane(lane) * coefficients.piston_area.lane(lane);
    coefficients.contact.lane(lane) * inside > firm
}

/// Substeps of a block in which a piston meets a stop softly: the time at which it does would jump by 20 us with where in a
/// step that is, close to the leak that stalls the valve.
const MEETING_SUBSTEPS: u32 = 4;

/// How fast a piston swings on its stop, 1/s.
#[inline(always)]
fn swing<R: Real>(lane: usize, coefficients: &Coefficients<R>) -> f64 {
    libm::sqrt(coefficients.contact.lane(lane) * coefficients.inverse_mass.lane(lane))
}

/// The substeps of a block in which the piston hits a stop, or comes off it; one where it does not. `inside` is how far it
/// is beyond the stop, m; a step covers an angle of its swing there and sheds a share of its speed.
#[inline(always)]
fn hit_substeps(v: f64, inside: f64, stroke: f64, (angle, shed): (f64, f64), step_s: f64, meets: bool) -> u32 {
    // It may gain speed on the way.
    let within_block = 2.0 * v.abs() * f64::from(BLOCK) * step_s;
    if inside < -within_block {
        return 1;
    }
    if v.abs() * step_s < HARD_HIT * stroke * angle {
        return if meets { MEETING_SUBSTEPS } else { 1 };
    }
    let mut count = 1;
    while count < HIT_SUBSTEPS && (angle > HIT_ANGLE * f64::from(count) || shed > HIT_SHED * f64::from(count)) {
        count *= 2;
    }
    count
}

/// A piston on a stop rests where it strays by no more than this share of its stroke from an even motion over a block: a
/// quarter of a micrometre in 25 mm. What swings more, or is about to turn, is followed in steps as they are.
const STILL: f64 = 1e-5;

/// How much the speed of a piston that begins to rest may differ from that of the balance between stop and gas, as a share:
/// friction and springs take part in it.
const UNEVEN: f64 = 0.3;

/// How far behind the balance of its forces a piston at rest may be held by damping that is lent to it, in strokes.
const LAG: f64 = 2e-6;

/// The damping ratio that a piston at rest is lent at most.
const STILLING: f64 = 0.7;

/// What a piston brings into the equations, which is stretched in time where steps span several.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piston {
    mass: f64,
    viscous: f64,
    quickest: f64,
}

impl Piston {
    pub(super) fn of(coefficients: &Coefficients<f64>) -> Self {
        Self { mass: coefficients.mass, viscous: coefficients.viscous, quickest: coefficients.quickest }
    }
}

/// How a lane steps through a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stride {
    /// Substeps of each step.
    pub substeps: u32,
    /// Steps that one spans.
    pub span: u32,
}

impl Stride {
    /// At least the substeps of a first block after something changed from outside: gas finds its new way within a few
    /// milliseconds.
    pub(super) fn first(self, control: StepControl) -> Self {
        Self { substeps: self.substeps.max(control.most_substeps.min(FIRST_SUBSTEPS)), ..self }
    }

    /// The stride of the block to come, given the block before, or nothing where the stride may not span steps.
    #[inline(always)]
    pub(super) fn choose<R: Real>(
        lane: usize,
        front: &Front<R>,
        state: &State<f64>,
        past: Option<&Past>,
        coefficients: &Coefficients<R>,
        control: StepControl,
    ) -> Self {
        if control.most_span > 1 && past.is_some_and(|past| rests(lane, state, past, coefficients, control.most_span)) {
            return Self { substeps: 1, span: control.most_span };
        }
        Self { substeps: substeps(lane, front, state, coefficients, control), span: 1 }
    }

    /// A step's length in steps as they are.
    pub(super) fn length(self) -> f64 {
        f64::from(self.span) / f64::from(self.substeps)
    }

    /// Puts what the stride asks for into the equations of a lane.
    pub(super) fn load<R: Real>(
        self,
        lane: usize,
        state: &State<f64>,
        coefficients: &mut Coefficients<R>,
        control: StepControl,
        piston: Piston,
    ) {
        let length = self.length();
        coefficients.port_ease.set_lane(lane, control.port_ease / length);
        let port_laminar =
            if control.port_ease.is_finite() { EASED_LAMINAR } else { control.port_laminar * length * length };
        coefficients.port_laminar.set_lane(lane, Laminar::new(port_laminar));
        let stretch = f64::from(self.span);
        let mass = piston.mass * stretch * stretch;
        coefficients.mass.set_lane(lane, mass);
        coefficients.inverse_mass.set_lane(lane, 1.0 / mass);
        coefficients.quickest.set_lane(lane, piston.quickest * stretch);
        if self.span == 1 {
            coefficients.viscous.set_lane(lane, piston.viscous);
            coefficients.pipe_ease.set_lane(lane, f64::INFINITY);
            coefficients.laminar.set_lane(lane, Laminar::new(control.laminar * length * length));
            if control.line_laminar > 0.0 {
                coefficients.line_laminar.set_lane(lane, Laminar::new(control.line_laminar * length * length));
            }
            return;
        }
        // A piston that only follows the balance of its forces may be slower to do so, all in proportion; where that
        // hardly moves, it may be stilled as well.
        let contact = coefficients.contact.lane(lane);
        let lag = LAG * coefficients.stroke.lane(lane);
        let most = 2.0 * STILLING * (contact * piston.mass).sqrt() * stretch;
        coefficients.viscous.set_lane(lane, (contact * lag / state.v.abs()).min(most).max(piston.viscous));
        // As far as the port is eased, the chamber takes its part of what comes into the pipe.
        let (chamber, pipe) = pressures(lane, state, coefficients);
        let open = (control.port_ease / length * gap(pipe, chamber).sqrt()).min(1.0);
        let volume = coefficients.closed_volume.lane(lane) - coefficients.piston_area.lane(lane) * state.x;
        let together = coefficients.pipe_volume.lane(lane) / (coefficients.pipe_volume.lane(lane) + volume);
        let share = (together + open * (1.0 - together)).max(control.taking_part(together));
        coefficients.pipe_ease.set_lane(lane, control.pipe_ease / (share * length));
        coefficients.laminar.set_lane(lane, Laminar::new(EASED_LAMINAR));
    }
}

/// What is known of a block that is over.
#[derive(Debug, Clone, Copy)]
pub(super) struct Past {
    /// The state at its start.
    pub state: State<f64>,
    /// Its length in steps as they are, and in s.
    pub steps: u32,
    pub length_s: f64,
    /// Whether the piston rested in it, as far as steps go.
    pub rested: bool,
}

/// Whether the piston rests on a stop over the block to come: firmly pressed, not about to leave, and where the balance of
/// its forces moves it, not in a swing. A swing would grow as it is stretched, so that less of one may be there at first.
#[inline(always)]
fn rests<R: Real>(lane: usize, state: &State<f64>, past: &Past, coefficients: &Coefficients<R>, span: u32) -> bool {
    let stroke = coefficients.stroke.lane(lane);
    if inside(stroke, &past.state) <= 0.0 || !stays_firm(lane, state, past, coefficients, 2.0) {
        return false;
    }
    let pressed = pressures(lane, state, coefficients).0 - pressures(lane, &past.state, coefficients).0;
    let balance = -pressed * coefficients.piston_area.lane(lane) / coefficients.contact.lane(lane);
    let ahead = state.v * past.length_s;
    let blocks = f64::from(past.steps / BLOCK);
    let (strays, least, share) =
        if past.rested { (4.0 * blocks * blocks, 4.0 * blocks, 1.0) } else { (1.0, 1.0 / f64::from(span), UNEVEN) };
    (state.x - past.state.x - ahead).abs() <= strays * STILL * stroke
        && (ahead - balance).abs() <= least * STILL * stroke + share * balance.abs()
}

/// How far a piston is inside a stop, m.
#[inline(always)]
fn inside(stroke: f64, state: &State<f64>) -> f64 {
    (state.x - stroke).max(-state.x)
}

/// Whether a piston that comes off its stop as fast as in the block before is still firm after so many such blocks.
#[inline(always)]
fn stays_firm<R: Real>(
    lane: usize,
    state: &State<f64>,
    past: &Past,
    coefficients: &Coefficients<R>,
    blocks: f64,
) -> bool {
    let stroke = coefficients.stroke.lane(lane);
    let (now, then) = (inside(stroke, state), inside(stroke, &past.state));
    is_firm(now + blocks * (now - then).min(0.0), lane, coefficients)
}

/// The steps of the block to come: as many as usual, and several times that where a piston has rested and goes on to.
#[inline(always)]
pub(super) fn block_steps<R: Real>(
    lane: usize,
    state: &State<f64>,
    past: Option<&Past>,
    stride: Stride,
    coefficients: &Coefficients<R>,
    left: u32,
) -> u32 {
    let long = past.filter(|past| stride.span > 1 && past.rested && left >= LONG_BLOCK).is_some_and(|past| {
        let blocks = 2.0 * f64::from(LONG_BLOCK) / f64::from(past.steps);
        stays_firm(lane, state, past, coefficients, blocks)
    });
    if long { LONG_BLOCK } else { left.min(BLOCK) }
}
