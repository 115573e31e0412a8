//! Seat adhesion: the plug sticks to its seat.

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, FitRange, scales};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "seat-adhesion",
    summary: "the plug sticks to its seat and has to be torn off",
    equation: "F = -F_b min(1, 1 - x/d) for x < d",
    symptom: "opening breaks away late and then jumps; closing is right but for its very last part",
    typical_sizes: "1 to 20 % of the spring force within 0.1 to 1 mm",
    confused_with: &["process-force", "dry-friction", "closing-cushion"],
    source: "Armstrong-Hélouvry, Dupont, Canudas de Wit 1994 (adhesion at break-away)",
    acts_on: ActsOn::Mechanics,
    parameters: &[
        EffectParameter {
            name: "force",
            si_unit: "N",
            meaning: "force that holds the plug on its seat, F_b",
            default: DefaultValue::Required,
            refinement: false,
            range: |valve| FitRange {
                lower: 0.0,
                typical: scales::modest_at_seat_n(valve, 0.0305),
                upper: 0.61 * scales::force_n(valve),
            },
        },
        EffectParameter {
            name: "reach",
            si_unit: "m",
            meaning: "distance from the seat over which it acts, d",
            default: DefaultValue::Value(0.3e-3),
            refinement: false,
            range: |valve| FitRange {
                lower: 0.002 * valve.stroke_m,
                typical: 0.012 * valve.stroke_m,
                upper: 0.25 * valve.stroke_m,
            },
        },
    ],
    neutral: 0.0,
};
