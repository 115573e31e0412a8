//! Editing valve files: units and comments stay, and every step can be undone.

mod common;

use common::VALVE;
use valve_file::{Change, FoundValue, HistoryEntry, ValveFile, ValveFileError};
use valve_model::custom::{CustomEffect, CustomParameter, CustomTarget};
use valve_model::{Effect, EffectKind, ParameterId};

fn read() -> ValveFile {
    ValveFile::parse(VALVE, "v.toml").unwrap()
}

fn step(action: &str) -> HistoryEntry {
    HistoryEntry::new(action, "bench 3", 3.25, 1.0)
}

fn friction(coulomb: f64, fixed: f64) -> Effect {
    Effect::new(EffectKind::DRY_FRICTION, &[Some(coulomb), Some(fixed)]).unwrap()
}

fn custom(force: f64) -> CustomEffect {
    let parameter = |name: &str, value, unit: &str| CustomParameter {
        name: name.into(),
        value,
        lower: 0.0,
        upper: 10.0 * value,
        unit: unit.into(),
    };
    let parameters = vec![parameter("F", force, "N"), parameter("w", 0.002, "mm")];
    CustomEffect::new("scored \"bore\"", CustomTarget::Friction, "F * exp(-(x/w)^2)", parameters).unwrap()
}

#[test]
fn a_new_value_keeps_unit_and_comment() {
    let file = read().with_parameter(ParameterId::DeadVolume, 32.412_345_678e-6).unwrap();
    assert_eq!(file.text(), VALVE.replace("\"30 cm3\" ", "\"32.41235 cm3\" "));
    assert!((file.valve().parameters().dead_volume_m3 - 32.412_35e-6).abs() < 1e-18);
    let file = read().with_parameter(ParameterId::SupplyPressure, 80.0 * 6894.757 + 100e3).unwrap();
    assert!(file.text().contains("supply_pressure = \"80 psig\"       # at the manifold"));
    let file = read().with_parameter(ParameterId::RatioOfSpecificHeats, 1.38).unwrap();
    assert!(file.text().contains("ratio_of_specific_heats = 1.38\n"));
    assert_eq!(read().with_parameter(ParameterId::Stroke, 0.02).unwrap().text(), VALVE);
    assert!(matches!(
        read().with_parameter(ParameterId::Stroke, -1.0),
        Err(ValveFileError::Impossible { line: 6, .. })
    ));
}

#[test]
fn supply_and_ambient_pressure_can_move_together() {
    let supply = 85.0 * 6894.757 + 90e3;
    let values = [(ParameterId::SupplyPressure, supply), (ParameterId::AmbientPressure, 90e3)];
    let file = read().with_parameters(&values).unwrap();
    assert!(file.text().contains("\"85 psig\"") && file.text().contains("\"90 kPa\""));
    assert_eq!(file.valve().parameters().supply_pressure_pa, supply);
}

#[test]
fn a_calibration_can_be_undone_exactly() {
    let file = read()
        .with_parameters(&[(ParameterId::ViscousFriction, 708.0), (ParameterId::RatioOfSpecificHeats, 1.39)])
        .unwrap()
        .with_history(step("calibrated"))
        .unwrap();
    assert!(file.text().contains("viscous_friction = \"708 N s/m\""));
    let entry = &file.history()[0];
    assert_eq!((entry.action.as_str(), entry.campaign.as_str()), ("calibrated", "bench 3"));
    assert_eq!((entry.error_before, entry.error_after), (3.25, 1.0));
    assert_eq!(
        entry.changes[0],
        Change::Parameter { key: "actuator.viscous_friction".into(), was: Some("'500 N s/m'".into()) }
    );
    assert_eq!(file.reverted().unwrap().text(), VALVE);
    assert!(matches!(read().reverted(), Err(ValveFileError::NothingToRevert { .. })));
}

#[test]
fn a_step_keeps_how_sure_what_it_found_is() {
    let of = |effect: Option<&str>, parameter: &str, value: f64, standard_error: f64, unit: &str| FoundValue {
        effect: effect.map(str::to_owned),
        parameter: parameter.to_owned(),
        value,
        standard_error,
        unit: unit.to_owned(),
    };
    let found = vec![
        of(Some("dry-friction"), "coulomb_force", 35.5, 1.25, "N"),
        of(None, "actuator.viscous_friction", 708.0, 12.0, "N s/m"),
        of(Some("gas-heating"), "share", 1.0, 0.25, ""),
    ];
    let unknown = of(None, "gas.compressibility", 1.0, f64::INFINITY, "");
    let entry = step("calibrated").with_found(found.iter().cloned().chain([unknown]).collect());
    let file = read().with_parameters(&[(ParameterId::ViscousFriction, 708.0)]).unwrap().with_history(entry).unwrap();
    assert_eq!(file.history()[0].found, found);
    assert_eq!(file.reverted().unwrap().text(), VALVE);
    let wrong = file.text().replace("standard_error = 1.25", "standard_error = \"little\"");
    let error = ValveFile::parse(&wrong, "v.toml").unwrap_err().to_string();
    assert!(error.contains("standard_error") && error.contains("v.toml:"), "{error}");
}

#[test]
fn steps_pile_up_and_are_undone_one_by_one() {
    let calibrated =
        read().with_parameter(ParameterId::DeadVolume, 32e-6).unwrap().with_history(step("calibrated")).unwrap();
    let adopted = calibrated
        .with_effect(&friction(20.0, 20.0))
        .unwrap()
        .with_parameter(ParameterId::DeadVolume, 31e-6)
        .unwrap()
        .with_history(step("added dry-friction"))
        .unwrap();
    let refitted = adopted
        .with_effect(&friction(50.0, 60.0))
        .unwrap()
        .with_custom(&custom(90.0))
        .unwrap()
        .with_history(step("added scored bore"))
        .unwrap();
    let swapped = refitted
        .without_effect(EffectKind::DRY_FRICTION)
        .unwrap()
        .with_custom(&custom(80.0))
        .unwrap()
        .with_history(step("swapped"))
        .unwrap();
    assert_eq!(adopted.valve().effects(), [friction(20.0, 20.0)]);
    assert!(adopted.text().contains("[[effect]]\nkind = \"dry-friction\"\ncoulomb_force = \"20 N\"\n\n[[history]]"));
    assert_eq!(refitted.valve().effects(), [friction(50.0, 60.0)]);
    assert_eq!(refitted.valve().custom(), [custom(90.0)]);
    assert_eq!(swapped.valve().custom(), [custom(80.0)]);
    assert!(swapped.valve().effects().is_empty());
    assert_eq!(swapped.history().len(), 4);
    assert_eq!(swapped.reverted().unwrap().text(), refitted.text());
    assert_eq!(refitted.reverted().unwrap().text(), adopted.text());
    assert_eq!(adopted.reverted().unwrap().text(), calibrated.text());
    assert_eq!(calibrated.reverted().unwrap().text(), VALVE);
}

#[test]
fn every_effect_of_the_catalogue_can_be_added_and_taken_out() {
    let mut file = read();
    for &kind in EffectKind::ALL {
        let sizes: Vec<Option<f64>> = kind
            .parameters()
            .iter()
            .map(|parameter| Some((parameter.range)(file.valve().parameters()).typical))
            .collect();
        // Some typical sizes do not go together, such as a static force below the Coulomb force.
        let effect = Effect::new(kind, &sizes).unwrap_or_else(|_| Effect::new(kind, &sizes[..1]).unwrap());
        let added = file.with_effect(&effect).unwrap();
        let read_back = added.valve().effects().last().unwrap();
        for (value, wanted) in read_back.values().iter().zip(effect.values()) {
            assert!((value - wanted).abs() <= 1e-6 * wanted.abs(), "{kind:?}: {value} for {wanted}");
        }
        assert_eq!(added.without_effect(kind).unwrap().text(), file.text());
        file = added;
    }
    let recorded = ValveFile::parse(file.text(), "v.toml").unwrap();
    let dropped = recorded.without_effect(EffectKind::SUPPLY_DROOP).unwrap().with_history(step("dropped")).unwrap();
    assert_eq!(dropped.reverted().unwrap().text(), file.text());
    assert!(read().without_custom("nobody").unwrap_err().to_string().contains("no effect \"nobody\"; it has none"));
}

#[test]
fn a_history_that_no_longer_fits_is_said() {
    let file = read().with_effect(&friction(20.0, 20.0)).unwrap().with_history(step("added")).unwrap();
    let by_hand = file
        .text()
        .replace("kind = \"dry-friction\"\ncoulomb_force", "kind = \"seal-friction\"\nfriction_per_pressure");
    let by_hand = by_hand.replace("\"20 N\"", "\"1 mm2\"");
    let error = ValveFile::parse(&by_hand, "v.toml").unwrap().reverted().unwrap_err();
    assert!(matches!(error, ValveFileError::HistoryDoesNotFit { line: 49, .. }), "{error}");
}

#[test]
fn only_what_decides_a_timing_is_canonical() {
    let canonical = |text: &str| ValveFile::parse(text, "v.toml").unwrap().canonical_model();
    let base = canonical(VALVE);
    let same = VALVE
        .replace("test valve", "another name")
        .replace("20 mm", "2 cm")
        .replace("0.20", "0.1")
        .replace("\"6 s\"", "\"7 s\"");
    assert_eq!(canonical(&same), base);
    assert_eq!(canonical(&format!("{VALVE}\n[[effect]]\nkind = \"vent-restriction\"\narea_factor = 1\n")), base);
    for (from, to) in [("20 mm", "20.0001 mm"), ("\"4 s\"", "\"4.1 s\""), ("75 psig", "76 psig")] {
        assert_ne!(canonical(&VALVE.replace(from, to)), base, "{from}");
    }
    let one = read().with_effect(&friction(20.0, 20.0)).unwrap().with_custom(&custom(90.0)).unwrap();
    let two = read().with_custom(&custom(90.0)).unwrap().with_effect(&friction(20.0, 20.0)).unwrap();
    assert_eq!(one.canonical_model(), two.canonical_model());
    assert_ne!(one.canonical_model(), base);
}

#[test]
fn what_may_be_left_out_is_written_and_undone_and_counts_only_where_it_is_not_the_default() {
    let bare = read().with_effect(&friction(20.0, 30.0)).unwrap();
    let damped =
        bare.with_parameter(ParameterId::StopDamping, 800.0).unwrap().with_history(step("calibrated")).unwrap();
    assert!(damped.text().contains("contact_stiffness = \"1 MN/m\"\ndamping = \"800 N s/m\"\n\n[gas]"));
    assert_eq!(damped.valve().parameters().stop_damping_n_s_per_m, 800.0);
    assert_eq!(damped.reverted().unwrap().text(), VALVE);
    let refined = |values: [f64; 3]| {
        let [stiffness, factor, slope] = values.map(Some);
        let values = [Some(20.0), Some(30.0), None, stiffness, factor, slope];
        bare.with_effect(&Effect::new(EffectKind::DRY_FRICTION, &values).unwrap()).unwrap()
    };
    assert_eq!(refined([2e5, 1.0, 0.0]).text(), bare.text());
    let written = refined([5e5, 1.25, -0.5]);
    let lines = "bristle_stiffness = \"500000 N/m\"\nopening_factor = 1.25\nposition_slope = -0.5\n";
    assert!(written.text().contains(lines), "{}", written.text());

    let told = |file: &ValveFile| file.canonical_model();
    let plain = told(&bare);
    assert!(!plain.contains("stops.damping") && !plain.contains("bristle") && !plain.contains("opening_factor"));
    assert!(told(&damped).contains("stops.damping 8e2\n"));
    assert!(told(&written).contains("effect.dry-friction.bristle_stiffness 5e5\n"));
    let spelt = VALVE.replacen("[gas]", "damping = \"0 N s/m\"\n\n[gas]", 1);
    assert_eq!(told(&ValveFile::parse(&spelt, "v.toml").unwrap()), told(&read()));
}
