//! An effect that no part of this workspace has heard of is found like any other: nothing asks which effect it has.

mod recorded;

use campaign::Campaign;
use identify::Stop;
use model_lab::diagnosis::{DiagnoseOptions, explain};
use recorded::{Noise, Off, campaign, stroke};
use valve_file::ValveFile;
use valve_model::effects::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, FitRange, Search};
use valve_model::{Effect, EffectKind, Valve};

/// A filter before the solenoid that is clogged: less gas comes in, and as much goes out.
static CLOGGED_FILTER: EffectInfo = EffectInfo {
    id: "clogged-filter",
    summary: "the fill path is narrower than the exhaust path",
    equation: "fill area = area factor times the solenoid's orifice area",
    symptom: "closing slower by the same factor at every pressure; opening is right",
    typical_sizes: "a factor of 0.5 to 0.98",
    confused_with: &["supply-droop"],
    source: "orifice law of the base model with a second area",
    acts_on: ActsOn::Pneumatics(|values, to| to.coefficients.fill *= values[0]),
    parameters: &[EffectParameter {
        name: "area_factor",
        si_unit: "",
        meaning: "fill area over vent area",
        allowed: Allowed::POSITIVE,
        default: DefaultValue::Required,
        range: |_| FitRange { lower: 0.05, typical: 0.92, upper: 1.0 },
        search: Search::Size,
    }],
    neutral: 1.0,
};

const OWN: EffectKind = EffectKind::of(&CLOGGED_FILTER);

/// Strokes of a valve under some supply pressures, as they are recorded.
fn campaign_of(valve: &Valve) -> Campaign {
    let mut noise = Noise(16);
    let off = Off::default();
    campaign([4.8e5, 5.6e5, 6.4e5, 7.2e5].map(|supply_pa| stroke(valve, supply_pa, &off, &mut noise)).into())
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn a_search_finds_an_effect_that_a_program_brings_along() {
    let file = ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve");
    let hidden = Effect::new(OWN, &[Some(0.8)]).expect("possible");
    let parameters = file.valve().parameters().clone();
    let valve = Valve::new(parameters, file.valve().switches(), vec![hidden], Vec::new()).expect("possible");
    assert!(!EffectKind::ALL.contains(&OWN));
    let options = DiagnoseOptions {
        effects: [EffectKind::SENSOR_LAG, EffectKind::PROGRESSIVE_SPRING, OWN, EffectKind::VENT_RESTRICTION].into(),
        ..DiagnoseOptions::default()
    };
    let found = explain(&file, &campaign_of(&valve), &options, &|_| (), Stop::never()).expect("it strokes");
    assert_eq!(found.recommended, [OWN]);
    let size = found.parameters.iter().find(|one| one.effect == OWN).expect("has a size");
    assert!((size.value - 0.8).abs() < 4.0 * size.sigma.max(1e-3), "{size:?}");
}
