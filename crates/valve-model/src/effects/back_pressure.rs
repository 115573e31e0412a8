//! Back pressure: the exhaust ends above atmosphere.

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, FitRange, scales};

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
        refinement: false,
        range: |valve| {
            let span = scales::gauge_pa(valve);
            FitRange { lower: 0.0, typical: scales::modest_back_pressure_pa(valve, 0.015), upper: 0.4 * span }
        },
    }],
    neutral: 0.0,
};
