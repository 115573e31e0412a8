//! Gas heating: the gas warms when compressed and cools when it expands,
//! and exchanges heat with the walls.

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, FitRange, scales};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "gas-heating",
    summary: "the gas warms and cools instead of staying at wall temperature",
    equation: "m c_v T' = sum c_p f_in T_source - sum c_p f_out T - p V' - m' c_v T + h (T_wall - T), pipe and chamber",
    symptom: "closing and opening both faster than isothermal; pressures sag or recover after the stroke",
    typical_sizes: "a wall conductance of 0.05 to 2 W/K; infinite is isothermal, 0 is adiabatic",
    confused_with: &["orifice-law", "vent-restriction"],
    source: "Carneiro and Almeida, Proc. IMechE I 220(1), 2006",
    acts_on: ActsOn::Pneumatics,
    parameters: &[EffectParameter {
        name: "wall_conductance",
        si_unit: "W/K",
        meaning: "heat flow to the walls per kelvin, the same for pipe and chamber, h",
        default: DefaultValue::Required,
        refinement: false,
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
