//! Back pressure: the exhaust ends above atmosphere.

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, FitRange};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "back-pressure",
    summary: "the exhaust ends in a header above atmospheric pressure",
    equation: "the solenoid vents to p_atm + p_b; the vented start is at that pressure too",
    symptom: "opening slows down towards its end; closing starts a little earlier",
    typical_sizes: "2 to 50 kPa gauge",
    confused_with: &["vent-restriction", "opening-cushion"],
    source: "orifice law of the base model with another downstream pressure",
    acts_on: ActsOn::Pneumatics,
    parameters: &[EffectParameter {
        name: "pressure",
        si_unit: "Pa",
        meaning: "exhaust pressure above atmosphere, p_b (gauge)",
        default: DefaultValue::Required,
        range: |valve| {
            let span = valve.supply_pressure_pa - valve.ambient_pressure_pa;
            FitRange { lower: 0.0, typical: 0.015 * span, upper: 0.4 * span }
        },
    }],
    neutral: 0.0,
};
