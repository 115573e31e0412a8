//! Reading valve files: values in SI, and refusals that say where and what.

mod common;

use common::VALVE;
use valve_file::{ValveFile, ValveFileError};
use valve_model::{EffectKind, Orientation, ParameterId};

fn read(text: &str) -> ValveFile {
    ValveFile::parse(text, "v.toml").unwrap()
}

fn refusal(text: &str) -> String {
    ValveFile::parse(text, "v.toml").unwrap_err().to_string()
}

/// The refusal of the test valve with one piece of its text replaced.
fn refusal_with(from: &str, to: &str) -> String {
    assert!(VALVE.contains(from), "{from}");
    refusal(&VALVE.replacen(from, to, 1))
}

fn with_end(end: &str) -> String {
    format!("{VALVE}\n{end}")
}

#[test]
fn every_value_arrives_in_si() {
    let file = read(VALVE);
    let parameters = file.valve().parameters();
    assert_eq!(file.name(), "test valve");
    assert_eq!(parameters.stroke_m, 0.02);
    assert_eq!(parameters.dead_volume_m3, 30e-6);
    assert_eq!(parameters.supply_pressure_pa, 100e3 + 75.0 * 6894.757);
    assert_eq!(parameters.temperature_k, 293.15);
    assert_eq!(parameters.ratio_of_specific_heats, 1.4);
    assert_eq!(parameters.orientation, Orientation::Upright);
    assert_eq!((file.schedule().open_at_s, file.schedule().end_s), (4.0, 12.0));
    assert_eq!((file.limits().close_within_s, file.limits().open_within_s), (3.0, 6.0));
    assert_eq!(file.tolerances().len(), 2);
    assert_eq!(file.tolerances()[1].parameter, ParameterId::SpringStiffness);
    assert_eq!(file.tolerances()[1].relative_sigma, 0.02);
    assert_eq!(file.to_string(), VALVE);
}

#[test]
fn all_that_is_wrong_is_told_at_once_in_the_order_of_lines() {
    let text = VALVE
        .replacen("moving_mass", "moving_mas", 1)
        .replacen("dead_volume = \"30 cm3\"", "dead_volume = \"30 mm\"", 1)
        .replacen("close_within", "closes_within", 1);
    let told = refusal(&text);
    let of = |line: &str| text.lines().position(|other| other.starts_with(line)).unwrap() + 1;
    let lines: Vec<&str> = told.lines().collect();
    assert_eq!(lines.len(), 3, "{told}");
    assert!(
        lines[0].starts_with(&format!("v.toml:{}: unknown key \"actuator.moving_mas\"", of("moving_mas"))),
        "{told}"
    );
    assert!(lines[1].starts_with(&format!("v.toml:{}: actuator.dead_volume:", of("dead_volume"))), "{told}");
    assert!(
        lines[2].starts_with(&format!("v.toml:{}: unknown key \"limits.closes_within\"", of("closes_within"))),
        "{told}"
    );
}

#[test]
fn a_file_of_another_kind_is_refused_in_a_few_lines() {
    let told = refusal("title = 1\na = 1\nb = 1\nc = 1\nd = 1\ne = 1\nf = 1\n");
    assert!(told.lines().count() == 9 && told.ends_with(" more"), "{told}");
    // A table that is not there is missed once, with all that it would hold.
    let spring = refusal(&VALVE.replacen("[spring]", "[sprung]", 1));
    assert!(spring.contains("\"spring\" is missing; expected the table [spring] with stiffness"), "{spring}");
    assert_eq!(spring.matches("is missing").count(), 1, "{spring}");
}

#[test]
fn optional_tables_are_read() {
    let text = with_end("[switches]\nclosed_at = 0.05\nopen_at = 0.9\n").replacen(
        "[actuator]",
        "[actuator]\norientation = \"inverted\"",
        1,
    );
    let file = read(&text);
    assert_eq!((file.valve().switches().closed_at, file.valve().switches().open_at), (0.05, 0.9));
    assert_eq!(file.valve().parameters().orientation, Orientation::Inverted);
    let dotted = VALVE.replacen("\"spring.stiffness\" = 0.02", "spring.stiffness = 0.02", 1);
    assert_eq!(read(&dotted).tolerances(), read(VALVE).tolerances());
}

#[test]
fn effects_of_the_catalogue_are_read_with_their_defaults() {
    let file = read(&with_end(
        "[[effect]]\nkind = \"dry-friction\"\ncoulomb_force = \"25 N\"\n\n[[effect]]\nkind = \"gas-heating\"\n\
         wall_conductance = \"inf W/K\"\n\n[[effect]]\nkind = \"back-pressure\"\npressure = \"2 psig\"\n\n\
         [[effect]]\nkind = \"orifice-law\"\ncritical_ratio = 0.3\n",
    ));
    let effects = file.valve().effects();
    assert_eq!(effects[0].kind(), EffectKind::DRY_FRICTION);
    assert_eq!(file.valve().effects()[0].values(), [25.0, 25.0, 0.01, 2e5, 1.0, 0.0]);
    assert!(effects[1].is_neutral());
    assert_eq!(effects[2].values(), [2.0 * 6894.757]);
    assert_eq!(effects[3].values(), [0.3, 0.0]);
}

#[test]
fn custom_effects_are_read_in_si() {
    let file = read(&with_end(
        "[[effect]]\nkind = \"custom\"\nname = \"scored bore\"\nacts_on = \"friction\"\n\
         formula = \"F * exp(-((x - c)/w)^2)\"\n[effect.parameters]\n\
         F = { start = 0.09, lower = 0, upper = 1.0, unit = \"kN\" }\n\
         c = { start = 15, lower = 0, upper = 25, unit = \"mm\" }\n\
         w = { start = 2, lower = 1, upper = 5, unit = \"mm\" }\n",
    ));
    let effect = &file.valve().custom()[0];
    assert_eq!(effect.name(), "scored bore");
    let values: Vec<f64> = effect.parameters().iter().map(|parameter| parameter.value).collect();
    assert_eq!(values, [90.0, 0.015, 0.002]);
    assert_eq!(effect.parameters()[0].upper, 1000.0);
}

#[test]
fn wrong_keys_and_units_are_refused_with_file_and_line() {
    assert_eq!(
        refusal_with("stroke =", "strok ="),
        "v.toml:6: unknown key \"actuator.strok\" (did you mean \"stroke\"?); expected one of moving_mass, stroke, \
         piston_area, dead_volume, viscous_friction, orientation"
    );
    assert_eq!(
        refusal_with("20 mm", "20 mn"),
        "v.toml:6: actuator.stroke: unknown unit \"mn\" (did you mean \"mm\"?); expected a length in mm, cm, m, um or in"
    );
    assert!(
        refusal_with("100 kPa", "0 psig").starts_with(
            "v.toml:25: pneumatics.ambient_pressure: \"psig\" is a gauge pressure, but this one is absolute"
        )
    );
    assert!(refusal_with("75 psig", "75 psi").contains("v.toml:24: pneumatics.supply_pressure: \"psi\" does not say"));
    assert!(refusal_with("\"20 mm\"", "20").starts_with("v.toml:6: actuator.stroke is the bare number 20"));
    assert_eq!(
        refusal_with("stroke = \"20 mm\"\n", ""),
        "v.toml:4: \"actuator.stroke\" is missing; expected the travel between the stops, such as \"25.4 mm\""
    );
    assert!(refusal_with("[stops]\ncontact_stiffness = \"1 MN/m\"\n", "").contains("\"stops\" is missing"));
    assert!(
        refusal_with("[limits]", "[limit]").contains("v.toml:37: unknown key \"limit\" (did you mean \"limits\"?)")
    );
    assert!(refusal_with("stroke =", "stroke = \"1 mm\"\nstroke =").starts_with("v.toml:7: not valid TOML: duplicate"));
    assert!(refusal("").contains("v.toml:1: the file is empty"));
    let columns = refusal("# recorder\nvalve,cycle,close_time_s\nFV-1,0,1.2\n");
    assert!(columns.contains("\"valve,cycle,close_time_s\" are names of columns"), "{columns}");
}

#[test]
fn impossible_values_are_refused_with_file_and_line() {
    assert_eq!(
        refusal_with("20 mm", "-20 mm"),
        "v.toml:6: actuator.stroke is -0.02 m, expected a value greater than 0"
    );
    assert!(
        refusal_with("75 psig", "75 kPa").starts_with("v.toml:24: pneumatics.supply_pressure is 75000 Pa absolute")
    );
    assert!(refusal_with("\"4 s\"", "\"14 s\"").starts_with("v.toml:34: cycle.open_at"));
    assert!(refusal_with("\"3 s\"", "\"0 s\"").starts_with("v.toml:38: limits.close_within"));
    assert!(
        refusal_with("= 0.20", "= 20")
            .contains("v.toml:42: tolerance.actuator.viscous_friction is 20; expected a fraction")
    );
    assert!(refusal_with("\"spring.stiffness\"", "\"spring.stifness\"").contains("did you mean \"spring.stiffness\""));
    assert!(
        refusal(&with_end("[switches]\nclosed_at = 0.9\nopen_at = 0.1\n")).starts_with("v.toml:46: switches.closed_at")
    );
    assert!(
        refusal_with("[actuator]", "[actuator]\norientation = \"sideways\"").contains("v.toml:5: actuator.orientation")
    );
}

#[test]
fn a_valve_may_have_no_spring_and_damped_stops() {
    let text = VALVE.replacen("12 kN/m", "0 N/m", 1).replacen("\"spring.stiffness\" = 0.02\n", "", 1);
    let text = text.replacen("\"1 MN/m\"", "\"1 MN/m\"\ndamping = \"0.5 kN s/m\"", 1);
    let parameters = read(&text).valve().parameters().clone();
    assert_eq!((parameters.spring_stiffness_n_per_m, parameters.stop_damping_n_s_per_m), (0.0, 500.0));
    assert_eq!(read(VALVE).valve().parameters().stop_damping_n_s_per_m, 0.0);
    assert!(refusal_with("12 kN/m", "-1 N/m").contains("spring.stiffness is -1 N/m, expected a value of 0 or more"));
    assert!(refusal(&text.replacen("0.5 kN s/m", "-1 N s/m", 1)).contains("v.toml:17: stops.damping is -1 N s/m"));
}

#[test]
fn a_valve_that_no_step_can_follow_is_refused_with_file_line_and_a_bound() {
    for volume in ["1e-6 cm3", "1e-9 cm3"] {
        let found = refusal_with("\"40 cm3\"", &format!("\"{volume}\""));
        assert!(found.starts_with("v.toml:27: pneumatics.pipe_volume is 1.000e-"), "{found}");
        assert!(found.contains(" m3 or more, or a smaller"), "{found}");
    }
    assert!(refusal_with("\"1 MN/m\"", "\"1e12 MN/m\"").starts_with("v.toml:16: stops.contact_stiffness"));
}

#[test]
fn wrong_effects_are_refused_with_file_and_line() {
    let effect = |text: &str| refusal(&with_end(&format!("[[effect]]\n{text}")));
    assert!(
        effect("kind = \"dry-fricton\"\n")
            .contains("v.toml:46: effect.kind is \"dry-fricton\" (did you mean \"dry-friction\"?)")
    );
    assert!(effect("kind = \"dry-friction\"\n").contains("expected a quantity in N"));
    assert!(
        effect("kind = \"dry-friction\"\ncoulomb = \"1 N\"\n").contains("v.toml:47: unknown key \"effect.coulomb\"")
    );
    assert!(
        effect("kind = \"dry-friction\"\ncoulomb_force = \"9 N\"\nstatic_force = \"5 N\"\n")
            .starts_with("v.toml:48: effect.dry-friction.static_force is 5 N, expected at least the Coulomb force")
    );
    assert!(
        effect("kind = \"back-pressure\"\npressure = \"15 psia\"\n")
            .contains("v.toml:47: effect.pressure: \"psia\" is an absolute")
    );
    assert!(
        effect("kind = \"seal-friction\"\nfriction_per_pressure = \"1 mm2\"\n[[effect]]\nkind = \"seal-friction\"\nfriction_per_pressure = \"1 mm2\"\n")
            .contains("v.toml:49: effect.kind is \"seal-friction\" for a second time")
    );
    assert!(effect("force = \"1 N\"\n").contains("v.toml:45: \"effect.kind\" is missing"));
}

#[test]
fn a_wrong_formula_carries_file_line_and_position() {
    let text = with_end(
        "[[effect]]\nkind = \"custom\"\nname = \"mine\"\nacts_on = \"force\"\nformula = \"F * (x + y)\"\n\
         [effect.parameters]\nF = { start = 1, lower = 0, upper = 2, unit = \"N\" }\n",
    );
    let error = ValveFile::parse(&text, "v.toml").unwrap_err();
    let ValveFileError::Formula { line, source, .. } = &error else { panic!("{error}") };
    assert_eq!((*line, source.position), (49, 10));
    assert!(error.to_string().starts_with("v.toml:49: formula \"F * (x + y)\", character 10"));
    let other = |from: &str, to: &str| refusal(&text.replacen("x + y", "x", 1).replacen(from, to, 1));
    assert!(other("\"force\"", "\"forces\"").contains("v.toml:48: effect.acts_on is \"forces\""));
    assert!(other("\"mine\"", "\"dry-friction\"").contains("v.toml:47: effect.name is \"dry-friction\""));
    assert!(other("start = 1", "start = 3").contains("v.toml:51: effect.mine.F"));
    assert!(other("\"N\"", "\"Nm/\"").contains("v.toml:51: effect.parameters.F.unit"));
    assert!(other("upper = 2, ", "").contains("\"effect.parameters.F.upper\" is missing"));
}

#[test]
fn a_formula_that_is_no_number_on_the_way_is_refused_by_name() {
    let with = |formula: &str| {
        with_end(&format!(
            "[[effect]]\nkind = \"custom\"\nname = \"sound\"\nacts_on = \"force\"\nformula = \"x\"\n\
             [[effect]]\nkind = \"custom\"\nname = \"odd\"\nacts_on = \"force\"\nformula = \"{formula}\"\n"
        ))
    };
    for formula in ["sqrt(x - 10)", "0 * sqrt(x - 0.5 * L)", "log(x - L / 4)", "1 / (x - x)"] {
        let found = refusal(&with(formula));
        assert!(found.starts_with("v.toml:54: formula of \"odd\" is no number "), "{formula}: {found}");
        assert!(
            found.contains("after the start of the valve's own cycle; expected one wherever the valve goes"),
            "{found}"
        );
    }
    read(&with("sqrt(max(x - 0.5 * L, 0))"));
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gone.toml");
    assert!(ValveFile::read(&path).unwrap_err().to_string().contains("gone.toml:1: cannot be read"));
    std::fs::write(&path, b"name = \"a\"\n# \xff\n").unwrap();
    assert!(ValveFile::read(&path).unwrap_err().to_string().contains("gone.toml:2: is not UTF-8"));
}

/// A valve file with effects, a custom formula and a history.
fn rich() -> String {
    let file = read(&with_end(
        "[[effect]]\nkind = \"custom\"\nname = \"bore\"\nacts_on = \"friction\"\nformula = \"F * exp(-x^2)\"\n\
         [effect.parameters]\nF = { start = 0.09, lower = 0, upper = 1.0, unit = \"kN\" }\n",
    ));
    let friction = valve_model::Effect::new(EffectKind::DRY_FRICTION, &[Some(20.0)]).unwrap();
    let added = file.with_effect(&friction).unwrap().without_custom("bore").unwrap();
    added.with_history(valve_file::HistoryEntry::new("swapped", "bench", 2.0, 1.0)).unwrap().to_string()
}

proptest::proptest! {
    #[test]
    fn no_slip_of_the_pen_makes_the_reader_panic(place in 0usize..2000, length in 0usize..12, slip in "\\PC{0,6}") {
        let text = rich();
        let characters: Vec<char> = text.chars().collect();
        let start = place % characters.len();
        let end = (start + length).min(characters.len());
        let changed: String =
            characters[..start].iter().copied().chain(slip.chars()).chain(characters[end..].iter().copied()).collect();
        match ValveFile::parse(&changed, "v.toml") {
            // What is accepted can be edited and reverted without a panic either.
            Ok(file) => {
                let _ = file.reverted();
                let _ = file.with_parameter(ParameterId::Stroke, 0.019);
                let _ = file.without_effect(EffectKind::DRY_FRICTION);
            }
            Err(error) => proptest::prop_assert!(error.to_string().starts_with("v.toml:")),
        }
    }
}

#[test]
fn values_that_hardly_can_be_are_doubted_with_their_line() {
    assert_eq!(read(VALVE).doubts(), []);
    for (from, to, expected) in [
        ("100 kPa", "101 Pa", "v.toml:25: pneumatics.ambient_pressure is 101 Pa absolute; is its unit right"),
        (
            "75 psig",
            "750 psig",
            "v.toml:24: pneumatics.supply_pressure is 51.7107 bar above the atmosphere; is its unit",
        ),
        (
            "20 degC",
            "293 degC",
            "v.toml:26: pneumatics.temperature is 566.15 K, which is 293.00 degC; is its unit right",
        ),
        (
            "40 cm3",
            "40 l",
            "v.toml:27: pneumatics.pipe_volume is 800.0 times the volume that the piston sweeps; are its",
        ),
        ("12 kN/m", "120 kN/m", "v.toml:12: spring.stiffness pushes with 6000 N at the closed stop, the supply with"),
    ] {
        assert!(VALVE.contains(from), "{from}");
        let doubts = read(&VALVE.replacen(from, to, 1)).doubts();
        assert!(doubts.len() == 1 && doubts[0].to_string().starts_with(expected), "{to}: {doubts:?}");
    }
    // A wrong length or area brings other doubts with it; its own is among them.
    for (from, to, expected) in [
        ("stroke = \"20 mm\"", "stroke = \"20 um\"", "actuator.stroke is 0.020 mm; is its unit right (mm, cm"),
        (
            "piston_area = \"25 cm2\"",
            "piston_area = \"0.25 mm2\"",
            "actuator.piston_area is that of a bore of 0.564 mm; is",
        ),
    ] {
        assert!(VALVE.contains(from), "{from}");
        let doubts = read(&VALVE.replacen(from, to, 1)).doubts();
        assert!(doubts.iter().any(|doubt| doubt.to_string().contains(expected)), "{to}: {doubts:?}");
    }
    let late = VALVE.replacen("close_within = \"3 s\"", "close_within = \"5 s\"", 1);
    assert!(read(&late).doubts()[0].to_string().contains("limits.close_within is 5 s, and the cycle leaves 4 s"));
}
