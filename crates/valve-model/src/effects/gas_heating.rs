//! Gas heating: the gas warms when compressed and cools when it expands,
//! and exchanges heat with the walls.

use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, FitRange, Search};
use super::scales;
use super::term::{Term, numbers};
use super::{Assembly, Moment};
use crate::real::Real;
use crate::state::{Flows, State};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "gas-heating",
    summary: "the gas warms and cools instead of staying at wall temperature",
    equation: "m c_v T' = sum c_p f_in T_source - sum c_p f_out T - p V' - m' c_v T + h (T_wall - T), pipe and chamber",
    symptom: "closing and opening both faster than isothermal; pressures sag or recover after the stroke",
    typical_sizes: "a wall conductance of 0.05 to 2 W/K; infinite is isothermal, 0 is adiabatic",
    confused_with: &["orifice-law", "vent-restriction"],
    source: "Carneiro and Almeida, Proc. IMechE I 220(1), 2006",
    acts_on: ActsOn::Pneumatics(add),
    parameters: &[EffectParameter {
        name: "wall_conductance",
        si_unit: "W/K",
        meaning: "heat flow to the walls per kelvin, the same for pipe and chamber, h",
        default: DefaultValue::Required,
        search: Search::InverseSize,
        allowed: Allowed::NON_NEGATIVE,
        // Warms the gas of a whole stroke in about the time that the stroke takes; 500 times slower, 20,000 times faster.
        range: |valve| {
            let capacity =
                scales::gas_kg(valve) * valve.specific_gas_constant_j_per_kg_k / (valve.ratio_of_specific_heats - 1.0);
            let scale = 1.09 * capacity / scales::stroke_time_s(valve);
            FitRange { lower: 0.002 * scale, typical: scale, upper: 2e4 * scale }
        },
    }],
    neutral: f64::INFINITY,
};

numbers! {
    /// Wall conductance over c_v, kg/s.
    wall: 0.0,
}

impl<R: Real> Term<R> for Law<R> {
    /// The energy balances divided by c_v: m T' = sum gamma f T_source - m' T + h/c_v (T_wall - T) - p V'/c_v.
    #[inline(always)]
    fn warm(&self, at: &Moment<'_, R>, flows: &Flows<R>, rate: &mut State<R>) {
        let (c, state) = (at.base, at.state);
        let zero = R::splat(0.0);
        let (t_pipe, t_chamber) = (state.pipe_temperature, state.chamber_temperature);
        let mut pipe = zero;
        for flow in [flows.filled, flows.vented, flows.leaked_in, -flows.leaked_out, flows.into_pipe] {
            pipe = flow.mul_add(flow.select_lt(zero, t_pipe, c.temperature), pipe);
        }
        let port = flows.through_port;
        let carried = port * port.select_lt(zero, t_chamber, t_pipe);
        let added = flows.into_chamber * flows.into_chamber.select_lt(zero, t_chamber, c.temperature);
        // -p V'/c_v with V' = -A_p v.
        let work = at.chamber * c.piston_area * state.v * c.work_gain;
        let pipe_stored = self.wall.mul_add(c.temperature - t_pipe, -(rate.pipe_mass * t_pipe));
        let chamber_stored = self.wall.mul_add(c.temperature - t_chamber, -(rate.chamber_mass * t_chamber));
        let pipe = c.gamma.mul_add(pipe - carried, pipe_stored);
        let chamber = c.gamma.mul_add(carried + added, chamber_stored) + work;
        // Where the walls hold the gas at their temperature faster than anything else moves, only how far
        // it is from theirs matters, not how fast it gets there.
        let slowest = self.wall * c.quickest;
        let (pipe_mass, chamber_mass) = (state.pipe_mass.max(slowest), state.chamber_mass.max(slowest));
        let quotient = R::splat(1.0) / (pipe_mass * chamber_mass);
        rate.pipe_temperature = pipe * chamber_mass * quotient;
        rate.chamber_temperature = chamber * pipe_mass * quotient;
    }
}

fn add(values: &[f64], to: &mut Assembly<'_>) {
    to.terms.heating = true;
    to.laws.gas_heating = Law { wall: values[0] * to.coefficients.work_gain };
}

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::{Subject, testbed};

    #[test]
    fn without_walls_closed_in_gas_warms_as_it_is_compressed() {
        let p = testbed();
        let (x, v) = (0.01, 0.2);
        let subject = Subject::with(EffectKind::GAS_HEATING, &[0.0]).moving(x, v);
        let volume = p.dead_volume_m3 + p.piston_area_m2 * (p.stroke_m - x);
        let expected = 0.4 * p.temperature_k * p.piston_area_m2 * v / volume;
        let found = subject.rates().chamber_temperature;
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} instead of {expected} K/s");
    }

    #[test]
    fn walls_take_heat_from_warm_gas() {
        let mut subject = Subject::with(EffectKind::GAS_HEATING, &[0.5]);
        subject.state.chamber_temperature += 10.0;
        subject.state.chamber_mass *= 293.15 / 303.15;
        let capacity = subject.state.chamber_mass * 296.8 / 0.4;
        let found = subject.rates().chamber_temperature;
        assert!((found + 0.5 * 10.0 / capacity).abs() < 1e-9 * found.abs(), "{found}");
    }
}
