//! The states of rest: vented or filled, any leak in balance.

use crate::equations::Equations;
use crate::orifice::{Laminar, Pressure};
use crate::rhs::System;
use crate::state::{Inputs, State};
use crate::terms::groups;

/// The law of the orifices as good as without its laminar part: a balance of flows is not stepped through.
const EXACT_LAMINAR: f64 = 1e-9;

/// The state of rest with the solenoid vented, or with the pressures that `inputs` say where they drive the model.
pub fn vented_rest(equations: &Equations, inputs: &Inputs<f64>) -> State<f64> {
    let c = &equations.coefficients;
    let exact = Laminar::new(EXACT_LAMINAR);
    let system = System::<f64>::new(equations);
    let balance = |pipe: f64| {
        let line = line_pressure(equations, 0.0, pipe);
        let vent = c.vent * system.vent_factor(Pressure::of(pipe));
        c.law.flow(c.exhaust, pipe, vent, exact) + c.law.flow(line, pipe, c.leak_in, exact)
            - c.law.flow(pipe, c.ambient, c.leak_out, exact)
    };
    let low = c.exhaust.min(c.ambient);
    rest(equations, inputs, false, || root(low, c.supply.max(c.exhaust), balance))
}

/// The state of rest with the solenoid energised, or with the pressures that `inputs` say where they drive the
/// model.
pub fn closed_rest(equations: &Equations, inputs: &Inputs<f64>) -> State<f64> {
    let c = &equations.coefficients;
    let exact = Laminar::new(EXACT_LAMINAR);
    let balance = |pipe: f64| {
        let line = line_pressure(equations, 1.0, pipe);
        c.law.flow(line, pipe, c.fill, exact) + c.law.flow(line, pipe, c.leak_in, exact)
            - c.law.flow(pipe, c.ambient, c.leak_out, exact)
    };
    rest(equations, inputs, true, || root(c.supply.min(c.ambient), c.supply, balance))
}

/// The state of rest with the pressures that drive the model, or else with that in which the flows of the pipe balance.
pub(crate) fn rest(
    equations: &Equations,
    inputs: &Inputs<f64>,
    closed: bool,
    balanced: impl FnOnce() -> f64,
) -> State<f64> {
    let terms = equations.terms;
    let pipe = match (terms.prescribed_pipe, terms.prescribed_chamber) {
        (true, _) => inputs.pipe_pressure,
        (false, true) => inputs.chamber_pressure,
        (false, false) => balanced(),
    };
    let chamber = if terms.prescribed_chamber { inputs.chamber_pressure } else { pipe };
    let line = line_pressure(equations, f64::from(u8::from(closed)), pipe);
    let mut state = at_rest(equations, chamber, line, closed);
    state.pipe_mass = pipe / equations.coefficients.pipe_gain;
    state
}

/// The pressure of a supply line that feeds a pipe at this pressure through the spool and the leak, Pa.
pub(crate) fn line_pressure(equations: &Equations, spool: f64, pipe: f64) -> f64 {
    let c = &equations.coefficients;
    if !equations.terms.line {
        return c.supply;
    }
    let exact = Laminar::new(EXACT_LAMINAR);
    let fed = if spool > 0.0 { c.fill * spool + c.leak_in } else { c.leak_in };
    // What comes into the line leaves it; the excess falls in p.
    let excess = |p: f64| equations.laws.line_flow(c.supply, p, 0.0) - c.law.flow(p, pipe, fed, exact);
    root(pipe.min(c.supply), c.supply, excess)
}

/// The state of rest with pipe and chamber at one pressure; at the closed stop if there is any, where it is asked
/// for.
fn at_rest(equations: &Equations, pressure: f64, line_pressure: f64, closed: bool) -> State<f64> {
    let c = &equations.coefficients;
    let state = |x: f64| State {
        x,
        v: 0.0,
        chamber_mass: pressure * (c.closed_volume - c.piston_area * x) / c.zrt,
        pipe_mass: pressure / c.pipe_gain,
        chamber_temperature: c.temperature,
        pipe_temperature: c.temperature,
        line_pressure,
        bristle: 0.0,
    };
    let system = System::<f64>::new(equations);
    let inputs = Inputs {
        spool: 0.0,
        since_command: 0.0,
        pipe_pressure: pressure,
        chamber_pressure: pressure,
        supply_pressure: c.supply,
    };
    // The net force falls with x through both stops; a valve that does not reach a stop rests between them.
    let force = |x: f64| system.rates::<{ groups::ANY }>(&state(x), &inputs).v;
    let slack =
        (c.stiffness * c.free_length + (pressure - c.ambient).abs() * c.piston_area + c.weight.abs()) / c.contact;
    let reach = slack.min(0.5 * (c.closed_volume / c.piston_area - c.stroke));
    if closed && force(0.0) < 0.0 {
        return state(root(-slack, 0.0, force));
    }
    state(root(-slack, c.stroke + reach, force))
}

/// The root of a falling function, to the last bits that matter: the end where it lies beyond one
/// (Chandrupatla, Advances in Engineering Software 28(3), 1997: bisection, and inverse quadratic
/// interpolation where three points allow it).
pub(crate) fn root(low: f64, high: f64, falling: impl Fn(f64) -> f64) -> f64 {
    let (mut x1, mut x2) = (high, low);
    let (mut f1, mut f2) = (falling(high), falling(low));
    if f1 >= 0.0 {
        return high;
    }
    if f2 <= 0.0 {
        return low;
    }
    let mut t = 0.5;
    loop {
        let x = x1 + t * (x2 - x1);
        let f = falling(x);
        let (x3, f3);
        if (f > 0.0) == (f1 > 0.0) {
            (x3, f3) = (x1, f1);
        } else {
            (x3, f3) = (x2, f2);
            (x2, f2) = (x1, f1);
        }
        (x1, f1) = (x, f);
        let (best, left) = if f2.abs() < f1.abs() { (x2, f2) } else { (x1, f1) };
        let share = (2.0 * f64::EPSILON * best.abs() + f64::MIN_POSITIVE) / (x2 - x1).abs();
        if share > 0.5 || left == 0.0 {
            return best;
        }
        let (xi, phi) = ((x1 - x2) / (x3 - x2), (f1 - f2) / (f3 - f2));
        t = if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
            f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2)
        } else {
            0.5
        };
        t = t.clamp(share, 1.0 - share);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_root_is_found_to_the_last_bits_in_few_steps() {
        let steps = core::cell::Cell::new(0);
        let counted = |low: f64, high: f64, falling: &dyn Fn(f64) -> f64| {
            steps.set(0);
            root(low, high, |x| {
                steps.set(steps.get() + 1);
                falling(x)
            })
        };
        let cubic = counted(0.0, 3.0, &|x| 2.0 - x * x * x);
        assert!((cubic - libm::cbrt(2.0)).abs() < 4e-16, "{cubic}");
        assert!(steps.get() < 20, "{} steps for a smooth function", steps.get());
        // A stop: soft, then a million times stiffer.
        let stop = counted(-1e-3, 0.03, &|x| 40.0 - 1.6e4 * x - 1.6e10 * (x - 2e-3).max(0.0));
        assert!((stop - (2e-3 + 8.0 / (1.6e4 + 1.6e10))).abs() < 1e-17, "{stop}");
        assert!(steps.get() < 60, "{} steps for a corner", steps.get());
        assert_eq!(counted(1.0, 2.0, &|x| 5.0 - x), 2.0, "beyond the upper end");
        assert_eq!(counted(1.0, 2.0, &|x| 0.5 - x), 1.0, "beyond the lower end");
    }
}
