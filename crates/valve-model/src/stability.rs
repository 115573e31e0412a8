//! Which step keeps every state stable, and whether a run can be afforded with it.
//!
//! Each rate at which a disturbance decays, or swings, asks for a step of its own; the orifice law, whose slope is
//! infinite at equal pressures, is regularised just as widely as the step then wants.

use crate::conditions::Conditions;
use crate::custom::{CustomEffect, CustomTarget};
use crate::demand::{Cause, Demand, FOLLOWED_RATE};
use crate::equations::{Equations, NARROWEST_LAMINAR};
use crate::fidelity::Fidelity;
use crate::integrator::{BLOCK, StepControl};
use crate::orifice::LAMINAR_SLOPE;
use crate::params::{ParameterError, ParameterId};
use crate::valve::Valve;

/// Largest product of rate and step for pipe and chamber together; with that of the solenoid and the
/// leaks inside the stability of the method (2.78 on the real axis).
const PORT_RATE: f64 = 2.0;

/// The same where the port is eased; at equal pressures, where it is largest. Room is left for what else moves the gas.
const EASED_RATE: f64 = 1.6;

/// The same for the solenoid and the leaks.
const SOLENOID_RATE: f64 = 0.7;

/// Largest relative pressure difference over which the port's law may be regularised. Nothing
/// flows through it at rest, so that its laminar width biases no pressure there.
const WIDEST_PORT_LAMINAR: f64 = 1e-2;

/// The same for the solenoid and the leaks, which do carry a standing flow.
const WIDEST_LAMINAR: f64 = 2e-4;

/// The same for what a supply line feeds; substeps make it narrow where line and pipe are nearly at one
/// pressure.
const WIDEST_LINE_LAMINAR: f64 = 5e-2;

/// Largest relative pressure difference over which the pipe may be eased on a stop, seen through the smaller volume: some
/// hundred pascals at the supply's pressure, through which it then takes a few steps.
const WIDEST_EASED: f64 = 2e-3;

/// Steps that one may span on a stop where the supply's pressure is measured.
const MOST_SPAN_BESIDE_A_RECORD: u32 = 2;

/// Steps that a run may take in all: with pressures its nodes then take 160 MB.
const MOST_STEPS: f64 = 4e6;

/// Parts that a step may always be cut into, however long the run is.
const PARTS_AT_LEAST: f64 = 16.0;

/// The rates of the regularised orifice law at equal pressures for a laminar width of 1, 1/s; they grow as its inverse
/// root.
struct FlowRates {
    port: f64,
    solenoid: f64,
    /// 0 without a supply line.
    line: f64,
}

impl Equations {
    fn flow_rates(&self) -> FlowRates {
        let (c, volumes) = (&self.coefficients, &self.volumes);
        let warming = if self.terms.heating { c.gamma } else { 1.0 };
        let steepest = warming * c.zrt * LAMINAR_SLOPE * libm::sqrt(c.law.at_equal_pressures());
        let port = steepest * c.port * (1.0 / volumes.pipe + 1.0 / volumes.dead);
        let solenoid = steepest * (c.fill.max(c.vent) + c.leak_in + c.leak_out) / volumes.pipe;
        // A small line follows the pipe quickly where their pressures are nearly one, and only there.
        let fed = solenoid + steepest / c.zrt * c.line_gain * (c.fill + c.leak_in);
        FlowRates { port, solenoid, line: if self.terms.line { fed } else { 0.0 } }
    }

    /// What bounds a step.
    fn demands(&self, flows: &FlowRates, roughness: f64) -> impl Iterator<Item = Demand> {
        let (c, volumes, terms) = (&self.coefficients, &self.volumes, self.terms);
        let swing = |stiffness: f64| libm::sqrt(stiffness * c.inverse_mass);
        let decay = |damping: f64| damping * c.inverse_mass;
        let where_it = |used: bool, rate: f64| if used { rate } else { 0.0 };
        let rough = roughness.powi(4);
        let regularised = |rate: f64, widest: f64| rate / libm::sqrt(rough * widest);
        // A piston that weighs nothing is at fault itself.
        let mass = Cause::base(ParameterId::MovingMass, c.mass, -0.5, "softer stops and less friction");
        let contact = Cause::base(ParameterId::ContactStiffness, c.contact, 0.5, "a larger moving mass");
        let stop = if c.mass < LIGHTEST_KG { mass } else { contact };
        let viscous = Cause::base(ParameterId::ViscousFriction, c.viscous, 1.0, "a larger moving mass");
        let braked = if c.mass < LIGHTEST_KG { Cause { power: -1.0, ..mass } } else { viscous };
        let pipe = |instead| Cause::base(ParameterId::PipeVolume, volumes.pipe, -1.0, instead);
        let dead = Cause::base(ParameterId::DeadVolume, volumes.dead, -1.0, "a smaller port");
        let port = if volumes.pipe < volumes.dead { pipe("a smaller port") } else { dead };
        let gas_spring = c.supply * c.piston_area * c.piston_area / volumes.dead;
        let cushion = Cause::base(ParameterId::DeadVolume, volumes.dead, -0.5, "a larger moving mass");
        let followed = |rate: f64, cause: Cause| Demand { rate, limit: FOLLOWED_RATE, cause };
        let base = [
            followed(decay(c.viscous), braked),
            followed(swing(c.contact), stop),
            followed(where_it(terms.stop_damping, decay(c.viscous + c.stop_damping)), stop),
            followed(swing(gas_spring), cushion),
            followed(where_it(terms.friction, decay(c.viscous + c.bristle_damping)), mass),
            // What bounded rates ask for is no parameter's doing, and at most two parts of a step.
            followed(where_it(terms.friction || terms.heating || terms.forces, 1.0 / c.quickest), mass),
            Demand { rate: regularised(flows.port, WIDEST_PORT_LAMINAR), limit: PORT_RATE, cause: port },
            Demand {
                rate: regularised(flows.solenoid, WIDEST_LAMINAR),
                limit: SOLENOID_RATE,
                cause: pipe("a smaller orifice of the solenoid"),
            },
        ];
        let rubs = swing(c.contact + c.bristle_stiffness);
        let bristles = terms.friction.then(|| followed(rubs, self.bristles.unwrap_or(mass)));
        let line = self.line.map(|cause| Demand {
            rate: regularised(flows.line, WIDEST_LINE_LAMINAR),
            limit: SOLENOID_RATE,
            cause,
        });
        base.into_iter().chain(bristles).chain(line).chain(self.demands.iter().copied())
    }

    /// How many steps one may span while the piston rests firmly on a stop: as many as let the gas be followed all the
    /// same. A line's pressure, measured ones and formulas for flows, or for anything in time, may ask for every step.
    fn most_span(&self, flows: &FlowRates, control: &StepControl, at_most: u32) -> u32 {
        let terms = self.terms;
        let into_gas = |target| matches!(target, CustomTarget::PipeFlow | CustomTarget::ChamberFlow);
        let asks = |effect: &CustomEffect| into_gas(effect.target()) || effect.formula().depends_on_time();
        if terms.line
            || terms.prescribed_pipe
            || terms.prescribed_chamber
            || terms.flows
            || self.custom.iter().any(asks)
        {
            return 1;
        }
        let together = self.volumes.pipe / (self.volumes.pipe + self.volumes.dead);
        let share = control.taking_part(together);
        let eased_over =
            |span: u32| (share * flows.solenoid * control.step_s * f64::from(span) / SOLENOID_RATE).powi(2);
        // The pipe lags behind a supply that moves, by as much as it is eased.
        let mut span = at_most.min(if terms.prescribed_supply { MOST_SPAN_BESIDE_A_RECORD } else { BLOCK });
        while span > 1 && eased_over(span) > WIDEST_EASED {
            span /= 2;
        }
        span
    }

    /// The step and the laminar widths of the orifice law that keep every state stable, from the rates at which
    /// a disturbance of each decays: a step of at most what is asked for, or a whole fraction of it.
    pub fn step_control(&self, fidelity: impl Into<Fidelity>) -> StepControl {
        let Fidelity { step_s, most_substeps, most_span, roughness, .. } = fidelity.into();
        let flows = self.flow_rates();
        let parts = self.demands(&flows, roughness).map(|demand| demand.parts(step_s)).fold(1.0, f64::max);
        let step_s = step_s / parts;
        // Measured pressures move as they like, and what is eased would lag behind them.
        let eased = !(self.terms.prescribed_pipe || self.terms.prescribed_chamber);
        let laminar = |rate: f64, limit: f64| {
            let root = rate * step_s / limit;
            (root * root).max(NARROWEST_LAMINAR)
        };
        let control = StepControl {
            step_s,
            port_laminar: laminar(flows.port, PORT_RATE),
            laminar: laminar(flows.solenoid, SOLENOID_RATE),
            line_laminar: if self.terms.line { laminar(flows.line, SOLENOID_RATE) } else { 0.0 },
            port_ease: if eased { EASED_RATE / (flows.port * step_s) } else { f64::INFINITY },
            pipe_ease: SOLENOID_RATE / (flows.solenoid * step_s),
            follows_port: eased && self.terms.friction,
            most_span: 1,
            most_substeps: most_substeps.max(1),
            ends_at_m: f64::INFINITY,
        };
        StepControl { most_span: self.most_span(&flows, &control, most_span), ..control }
    }

    /// Whether a run of this length can be afforded; if not, which parameter is to blame.
    pub(crate) fn affordable(&self, fidelity: Fidelity, run_s: f64) -> Result<(), ParameterError> {
        let Fidelity { step_s, roughness, .. } = fidelity;
        let flows = self.flow_rates();
        let demands = self.demands(&flows, roughness);
        let Some(worst) = demands.max_by(|a, b| a.parts(step_s).total_cmp(&b.parts(step_s))) else {
            return Ok(());
        };
        let most = (MOST_STEPS * step_s / run_s.max(step_s)).max(PARTS_AT_LEAST);
        let parts = worst.parts(step_s);
        if parts <= most { Ok(()) } else { Err(worst.cause.refused(parts / most, run_s, parts * run_s / step_s)) }
    }
}

/// What a refusal asks for beyond the bound, so that its two digits are enough.
const MARGIN: f64 = 1.1;

/// A piston lighter than this is unusual, kg.
const LIGHTEST_KG: f64 = 1e-3;

impl Demand {
    /// Into how many parts a step must be cut.
    fn parts(&self, step_s: f64) -> f64 {
        (self.rate * step_s / self.limit).ceil().max(1.0)
    }
}

impl Cause {
    /// A refusal for a rate that is so many times too fast.
    fn refused(&self, too_fast: f64, run_s: f64, steps: f64) -> ParameterError {
        let bound = self.value * libm::pow(MARGIN * too_fast, -1.0 / self.power);
        let side = if self.power < 0.0 { "more" } else { "less" };
        ParameterError::Inconsistent {
            key: self.key.into(),
            found: format!("{:.3e} {}", self.value, self.unit),
            expected: format!(
                "about {bound:.1e} {} or {side}, or {}: as it is, something settles so fast that a run of {run_s} s would \
                 take {steps:.1e} steps, and {MOST_STEPS:.0e} can be afforded",
                self.unit, self.instead
            ),
        }
    }
}

/// Checks that a run of this length on a valve takes no absurd number of steps. Names the parameter that is to blame.
pub fn check(
    valve: &Valve,
    conditions: &Conditions,
    run_s: f64,
    fidelity: impl Into<Fidelity>,
) -> Result<(), ParameterError> {
    let fidelity = fidelity.into();
    Equations::new(valve, conditions, fidelity).affordable(fidelity, run_s)
}
