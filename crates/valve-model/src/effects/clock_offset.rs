//! Clock offset: measurement and command are stamped by different clocks.

use super::NoTerm;
use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, FitRange, Search};
use super::scales;

pub(super) type Law<R> = NoTerm<R>;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "clock-offset",
    summary: "the clocks of measurement and command differ (a measurement effect)",
    equation: "recorded position time = true time + offset",
    symptom: "closing and opening shifted by one and the same time, either way",
    typical_sizes: "1 to 100 ms, either sign",
    confused_with: &["solenoid-lag", "sensor-lag", "dry-friction"],
    source: "definition",
    acts_on: ActsOn::Measurement(|values, to| to.offset_s = values[0]),
    parameters: &[EffectParameter {
        name: "offset",
        si_unit: "s",
        meaning: "what is added to the true time",
        default: DefaultValue::Required,
        search: Search::Size,
        allowed: Allowed::ANY,
        range: |valve| {
            let range = scales::delay(valve, 0.015, 0.5);
            FitRange { lower: -range.upper, ..range }
        },
    }],
    neutral: 0.0,
};

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::valve_with;
    use crate::measurement::Measurement;

    #[test]
    fn the_record_is_late_or_early() {
        let instruments = valve_with(EffectKind::CLOCK_OFFSET, &[-0.01]).measurement();
        assert_eq!(instruments, Measurement { offset_s: -0.01, ..Measurement::default() });
    }
}
