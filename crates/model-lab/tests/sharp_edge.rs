//! Orifices with sharp edges: their discharge coefficient falls as the pressures meet.

mod recorded;

use campaign::Campaign;
use identify::Stop;
use model_lab::diagnosis::{DiagnoseOptions, explain};
use recorded::{Noise, Off, campaign, stroke};
use valve_file::ValveFile;
use valve_model::{Effect, EffectKind, Valve};

const SUPPLIES_PA: [f64; 4] = [4.8e5, 5.6e5, 6.4e5, 7.2e5];

/// What no rounded orifice does, whatever its critical ratio, and a leak or a droop of the supply does half.
#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn sharp_edges_are_told_from_what_slows_the_end_of_a_stroke_as_well() {
    const SHARPNESS: f64 = 0.45;
    let file = ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve");
    let hidden = Effect::new(EffectKind::ORIFICE_LAW, &[Some(0.5), Some(SHARPNESS)]).expect("possible");
    let parameters = file.valve().parameters().clone();
    let valve = Valve::new(parameters, file.valve().switches(), vec![hidden], Vec::new()).expect("possible");
    let mut noise = Noise(23);
    let of = |supply_pa: f64| stroke(&valve, supply_pa, &Off::default(), &mut noise);
    let campaign: Campaign = campaign(SUPPLIES_PA.map(of).into());
    let effects = [
        EffectKind::ORIFICE_LAW,
        EffectKind::SUPPLY_DROOP,
        EffectKind::LEAK_TO_ATMOSPHERE,
        EffectKind::VENT_RESTRICTION,
        EffectKind::BACK_PRESSURE,
    ];
    let options = DiagnoseOptions { effects: effects.into(), ..DiagnoseOptions::default() };
    let found = explain(&file, &campaign, &options, &|_| (), Stop::never()).expect("it strokes");
    assert_eq!(found.recommended, [EffectKind::ORIFICE_LAW]);
    let sharpness = found.parameters.iter().find(|one| one.name == "edge_sharpness").expect("is told");
    assert!((sharpness.value - SHARPNESS).abs() < 3.0 * sharpness.sigma, "{sharpness:?}");
    assert!(found.remainder.discrepancy < 1e-3, "{:?}", found.remainder);
}
