//! Physics outside the catalogue that an effect of it can stand in for: the formula alone is told where it is likelier.

mod recorded;

use identify::Stop;
use model_lab::diagnosis::{DiagnoseOptions, Verdict, explain};
use recorded::{Noise, Off, campaign, stroke};
use valve_file::ValveFile;
use valve_model::custom::{CustomEffect, CustomParameter, CustomTarget};
use valve_model::{EffectKind, Valve};

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn a_spring_that_engages_on_the_way_is_no_process_force() {
    let file = ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve");
    let (rate, met) = (1.6e4, 0.0065);
    let parameter = |name: &str, value: f64, unit: &str| CustomParameter {
        name: name.into(),
        value,
        lower: value,
        upper: value,
        unit: unit.into(),
    };
    let parameters = vec![parameter("rate", rate, "N/m"), parameter("met", met, "m")];
    let spring = CustomEffect::new("spring", CustomTarget::Force, "rate*max(0, met - x)", parameters).expect("valid");
    let known = file.valve();
    let valve = Valve::new(known.parameters().clone(), known.switches(), Vec::new(), vec![spring]).expect("possible");
    let mut noise = Noise(21);
    let runs = [4.8e5, 6.0e5, 7.2e5].map(|supply_pa| stroke(&valve, supply_pa, &Off::default(), &mut noise));
    let options = DiagnoseOptions { effects: [EffectKind::PROCESS_FORCE].into(), ..DiagnoseOptions::default() };
    let found = explain(&file, &campaign(runs.into()), &options, &|_| (), Stop::never()).expect("it strokes");
    assert_eq!((found.verdict, &found.recommended[..]), (Verdict::OutsideCatalogue, &[][..]), "{:?}", found.notes);
    assert!(found.notes.iter().any(|note| note.starts_with("process-force ")), "{:?}", found.notes);
    let formula = found.discrepancy.expect("a formula");
    let force = |x: f64| rate * (met - x).max(0.0);
    for x in [0.001, 0.004, 0.006, 0.015] {
        assert!((formula.formula_at(x) - force(x)).abs() < 3.0, "{}", formula.effect.formula().source());
    }
}
