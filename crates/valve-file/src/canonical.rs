//! The canonical text of a model, for its hash.

use std::fmt::Write;

use valve_model::{EffectKind, Orientation, ParameterId};

use crate::ValveFile;

/// The version of the canonical text; it changes when the same values come to mean other timings.
const CANONICAL_VERSION: u32 = 1;

impl ValveFile {
    /// Everything that decides a simulated timing, in one deterministic text of full precision:
    /// parameters, orientation, switches, schedule, effects that are not neutral and custom
    /// formulas. What a file may leave out, a parameter or a refinement of an effect, counts where it is not at its
    /// default. Name, comments, units as written, tolerances, limits, history and the fit bounds
    /// of custom parameters do not count, and neither does the order of the effects.
    #[must_use]
    pub fn canonical_model(&self) -> String {
        let mut text = format!("valve model {CANONICAL_VERSION}\n");
        let mut line = |key: &str, value: f64| {
            // Writing to a string cannot fail; the shortest text that reads back as the same double is exact.
            let _ = writeln!(text, "{key} {value:e}");
        };
        for &id in ParameterId::ALL {
            let value = self.valve.parameters().get(id);
            if id.default_value() != Some(value) {
                line(id.key(), value);
            }
        }
        line("switches.closed_at", self.valve.switches().closed_at);
        line("switches.open_at", self.valve.switches().open_at);
        line("cycle.close_at", self.schedule.close_at_s);
        line("cycle.open_at", self.schedule.open_at_s);
        line("cycle.end", self.schedule.end_s);
        for &kind in EffectKind::ALL {
            let Some(effect) = self.valve.effects().iter().find(|effect| effect.kind() == kind) else { continue };
            if !effect.is_neutral() {
                let told = kind.parameters().iter().zip(effect.values()).enumerate();
                for (_, (parameter, value)) in told.filter(|(index, _)| effect.is_told(*index)) {
                    line(&format!("effect.{}.{}", kind.id(), parameter.name), *value);
                }
            }
        }
        let orientation = match self.valve.parameters().orientation {
            Orientation::Upright => "upright",
            Orientation::Inverted => "inverted",
            Orientation::Horizontal => "horizontal",
        };
        let _ = writeln!(text, "actuator.orientation {orientation}");
        let mut custom: Vec<_> = self.valve.custom().iter().collect();
        custom.sort_by_key(|effect| effect.name());
        for effect in custom {
            let _ = writeln!(text, "custom {} {:?}", effect.target().id(), effect.formula().source());
            for parameter in effect.parameters() {
                let _ = writeln!(text, "custom.{} {:e}", parameter.name, parameter.value);
            }
        }
        text
    }
}
