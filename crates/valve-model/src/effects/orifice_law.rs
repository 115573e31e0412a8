//! Orifice law of ISO 6358: a real orifice or valve chokes below its own
//! critical ratio, usually lower than that of an ideal nozzle.

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, fixed};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "orifice-law",
    summary: "orifices follow ISO 6358 with a critical ratio of their own",
    equation: "choked below b; above it the choked flow times sqrt(1 - ((r - b)/(1 - b))^2); every orifice",
    symptom: "flow falls earlier as the pressures meet: the end of closing and of opening slower, at low supply most",
    typical_sizes: "a critical ratio of 0.1 to 0.5",
    confused_with: &["supply-droop", "gas-heating", "vent-restriction"],
    source: "ISO 6358-1:2013",
    acts_on: ActsOn::Pneumatics,
    parameters: &[EffectParameter {
        name: "critical_ratio",
        si_unit: "",
        meaning: "pressure ratio below which the flow is choked, b",
        default: DefaultValue::Required,
        refinement: false,
        range: |_| fixed(0.02, 0.35, 0.9),
    }],
    // There is no value at which the law turns into that of the ideal nozzle; leaving it out does.
    neutral: f64::NAN,
};
