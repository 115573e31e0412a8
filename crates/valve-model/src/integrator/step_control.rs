//! How long the steps of a lane are: as stability asks for, and shorter where pressures meet or the piston hits a stop.

use super::Front;
use crate::coefficients::Coefficients;
use crate::real::Real;

/// How one run is paced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// Longest step, s.
    pub step_s: f64,
    /// Width of the port's blend that is stable at that step.
    pub port_blend: f64,
    /// The same for the solenoid and the leaks.
    pub blend: f64,
    /// The same for what a supply line feeds; 0 without such a line.
    pub line_blend: f64,
    /// Substeps that a lane may take.
    pub most_substeps: u32,
    /// Position from which on the last segment is over, m.
    pub ends_at_m: f64,
}

/// Steps after which a lane looks again whether it needs substeps.
pub(super) const BLOCK: u32 = 8;

/// On a stop, supply, line, pipe and chamber closer than this (relative) are at one pressure for all purposes.
const REST_GAP: f64 = 1e-4;

/// A piston that presses on its stop with more than this share of what the supply can press on it is not about to
/// leave.
const FIRM: f64 = 0.02;

/// Substeps at most while a piston is firmly pressed on its stop: what comes of that is rest, and the pressures there do not
/// depend on how wide the blend was on the way. With fewer, times near a stall step back by microseconds.
const PRESSED_SUBSTEPS: u32 = 4;

/// A piston that runs against a stop and would press it in by more than this share of its stroke is followed closely: with
/// how it bounces, all that is still to come would jump with where in a step it hits.
const HARD_HIT: f64 = 5e-3;

/// The angle of the swing on the stop that a step may then cover, and the most substeps that are taken for it.
const HIT_ANGLE: f64 = 0.15;
const HIT_SUBSTEPS: u32 = 8;

/// The substeps that keep the blends away from the pressure differences at hand: fewer where the piston is pressed
/// on a stop, and one where all is at one pressure there; more where it hits a stop hard.
#[inline(always)]
pub(super) fn substeps<R: Real>(lane: usize, front: &Front<R>, coefficients: &Coefficients<R>, pace: Pace) -> u32 {
    let state = front.state.lane(lane);
    let stroke = coefficients.stroke.lane(lane);
    let zr = coefficients.zr.lane(lane);
    let volume = coefficients.closed_volume.lane(lane) - coefficients.piston_area.lane(lane) * state.x;
    let chamber = state.chamber_mass * zr * state.chamber_temperature / volume;
    let temperature_ratio = state.pipe_temperature / coefficients.temperature.lane(lane);
    let pipe = state.pipe_mass * coefficients.pipe_gain.lane(lane) * temperature_ratio;
    let gap = |a: f64, b: f64| (a - b).abs() / a.max(b);
    let port = gap(pipe, chamber);
    // A line only acts where it feeds the pipe.
    let feeds = pace.line_blend > 0.0 && (front.spool.lane(lane) > 0.0 || coefficients.leak_in.lane(lane) > 0.0);
    let line = if feeds { gap(state.line_pressure, pipe) } else { 0.0 };
    let drop = if feeds { gap(coefficients.supply.lane(lane), state.line_pressure) } else { 0.0 };
    let inside = (state.x - stroke).max(-state.x);
    let mut most = pace.most_substeps;
    let mut count = hit_substeps(state.v, inside, stroke, swing(lane, coefficients), pace.step_s);
    if inside >= 0.0 {
        if port.max(line).max(drop) < REST_GAP {
            return count;
        }
        let pressed = coefficients.contact.lane(lane) * inside;
        let firm = FIRM * coefficients.supply.lane(lane) * coefficients.piston_area.lane(lane);
        if pressed > firm {
            most = most.min(PRESSED_SUBSTEPS);
        }
    }
    let wide = |count: u32| 0.8 * f64::from(count * count);
    while count < most && (pace.port_blend > port * wide(count) || feeds && pace.line_blend > line * wide(count)) {
        count *= 2;
    }
    count
}

/// How fast a piston swings on its stop, 1/s.
#[inline(always)]
fn swing<R: Real>(lane: usize, coefficients: &Coefficients<R>) -> f64 {
    libm::sqrt(coefficients.contact.lane(lane) * coefficients.inverse_mass.lane(lane))
}

/// The substeps of a block in which the piston hits a stop, or comes off it; one where it does not. `inside` is how far it
/// is beyond the stop, m.
#[inline(always)]
fn hit_substeps(v: f64, inside: f64, stroke: f64, swing: f64, step_s: f64) -> u32 {
    // It may gain speed on the way.
    let within_block = 2.0 * v.abs() * f64::from(BLOCK) * step_s;
    if inside < -within_block || v.abs() < HARD_HIT * stroke * swing {
        return 1;
    }
    let mut count = 1;
    while count < HIT_SUBSTEPS && swing * step_s > HIT_ANGLE * f64::from(count) {
        count *= 2;
    }
    count
}
