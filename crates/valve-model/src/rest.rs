//! Where a run starts: at rest, open and vented, any leak in balance.

use crate::coefficients::Equations;
use crate::orifice::Blend;
use crate::rhs::{Inputs, State, System};

/// The state of rest with the solenoid vented.
pub fn vented_rest(equations: &Equations) -> State<f64> {
    let c = &equations.coefficients;
    let exact = Blend::new(1e-9);
    let line = |pipe: f64| {
        if !equations.terms.line {
            return c.supply;
        }
        // The line feeds only the leak: p = p_s - R_d f(p, p_pipe), falling in p.
        let excess = |p: f64| (c.supply - p) * c.line_conductance - c.law.flow(p, pipe, c.leak_in, exact);
        bisect(pipe.min(c.supply), c.supply, excess)
    };
    let balance = |pipe: f64| {
        c.law.flow(c.exhaust, pipe, c.vent, exact) + c.law.flow(line(pipe), pipe, c.leak_in, exact)
            - c.law.flow(pipe, c.ambient, c.leak_out, exact)
    };
    let low = c.exhaust.min(c.ambient);
    let pipe = bisect(low, c.supply.max(c.exhaust), balance);
    at_rest(equations, pipe, line(pipe))
}

/// The state of rest with pipe and chamber at one pressure.
fn at_rest(equations: &Equations, pressure: f64, line_pressure: f64) -> State<f64> {
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
    let system = System::new(*c, equations.terms, &equations.custom, equations.custom_values());
    let inputs = Inputs { spool: 0.0, since_command: 0.0, pipe_pressure: pressure, chamber_pressure: pressure };
    // The net force falls with x through both stops; a valve that does not reach a stop rests between them.
    let force = |x: f64| system.rates::<false>(&state(x), &inputs).v;
    let slack =
        (c.stiffness * c.free_length + (pressure - c.ambient).abs() * c.piston_area + c.weight.abs()) / c.contact;
    let reach = slack.min(0.5 * (c.closed_volume / c.piston_area - c.stroke));
    state(bisect(-slack, c.stroke + reach, force))
}

/// The root of a falling function, to the last bit that matters.
fn bisect(mut low: f64, mut high: f64, falling: impl Fn(f64) -> f64) -> f64 {
    if falling(high) >= 0.0 {
        return high;
    }
    if falling(low) <= 0.0 {
        return low;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if falling(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}
