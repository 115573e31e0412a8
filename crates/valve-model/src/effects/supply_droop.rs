//! Supply droop: the line before the solenoid resists the flow.

use super::Assembly;
use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, FitRange, Search};
use super::scales;
use super::term::{Term, numbers};
use crate::demand::Cause;
use crate::real::Real;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "supply-droop",
    summary: "the supply pressure at the solenoid falls while it fills",
    equation: "V/(R T) p' = (p_s - p)/R_d - flow; starts at p_s; solenoid and supply leak draw from it",
    symptom: "closing late, more so at high supply pressure; opening is right",
    typical_sizes: "a droop of 1 to 20 % at full flow",
    confused_with: &["orifice-law", "seal-friction", "vent-restriction"],
    source: "mass balance of a line with a linear resistance; Beater, Pneumatic Drives, 2007",
    acts_on: ActsOn::Pneumatics(add),
    parameters: &[
        EffectParameter {
            name: "resistance",
            si_unit: "Pa s/kg",
            meaning: "pressure drop per mass flow, R_d",
            default: DefaultValue::Required,
            search: Search::Size,
            allowed: Allowed::NON_NEGATIVE,
            range: |valve| {
                let scale = valve.supply_pressure_pa / scales::flow_kg_per_s(valve);
                FitRange { lower: 0.0, typical: 0.04 * scale, upper: 2.0 * scale }
            },
        },
        EffectParameter {
            name: "line_volume",
            si_unit: "m3",
            meaning: "volume between resistance and solenoid, V",
            default: DefaultValue::Value(20e-6),
            search: Search::Shape,
            allowed: Allowed::POSITIVE,
            range: |valve| {
                let scale = scales::volume_m3(valve);
                FitRange { lower: 0.0067 * scale, typical: 0.134 * scale, upper: 13.4 * scale }
            },
        },
    ],
    neutral: 0.0,
};

numbers! {
    /// 1/R_d, kg/(s Pa).
    conductance: 0.0,
}

impl<R: Real> Term<R> for Law<R> {
    #[inline(always)]
    fn line_flow(&self, supply: R, line: R, sum: R) -> R {
        sum + (supply - line) * self.conductance
    }
}

fn add(values: &[f64], to: &mut Assembly<'_>) {
    let [resistance, volume] = [values[0], values[1]];
    let (zrt, conductance) = (to.coefficients.zrt, 1.0 / resistance);
    to.laws.supply_droop = Law { conductance };
    // A line that settles faster than anything else only shows its resistance.
    let gain = (zrt / volume).min(resistance / to.coefficients.quickest);
    let cause = Cause::effect("effect.supply-droop.line_volume", zrt / gain, "m3", -1.0);
    to.feeds_through_line(gain, cause);
    to.settles(gain * conductance, cause);
}

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::Subject;

    #[test]
    fn the_line_refills_through_its_resistance() {
        let mut subject = Subject::with(EffectKind::SUPPLY_DROOP, &[2e7, 20e-6]);
        subject.state.line_pressure -= 1e4;
        let expected = 296.8 * 293.15 / 20e-6 * 1e4 / 2e7;
        let found = subject.rates().line_pressure;
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} instead of {expected} Pa/s");
    }
}
