//! Whole draws: each realism does what it says, and nothing else does.

use super::*;
use crate::truth::Category;

fn spec(realisms: Realisms) -> WorldSpec {
    WorldSpec {
        weights: [1.0, 0.0, 0.0, 0.0],
        class: Some(Class::Common),
        realisms: Some(realisms),
        ..WorldSpec::of(World::Plant)
    }
}

fn only(name: &'static str, size: f64) -> Recording {
    draw_world(21, 0, &spec(Realisms::only(name, size)))
}

fn first_edge(file: &File) -> Option<usize> {
    file.command.as_ref()?.iter().position(|closes| *closes)
}

fn full_range(file: &File) -> (f64, f64) {
    file.position_m.iter().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(*x), high.max(*x)))
}

#[test]
fn a_draw_depends_on_its_seed_index_and_world_alone() {
    let spec = WorldSpec { class: Some(Class::Common), ..WorldSpec::of(World::Laboratory) };
    let once = draw_world(5, 2, &spec);
    assert_eq!(once, draw_world(5, 2, &spec));
    assert_ne!(once.valve, draw_world(6, 2, &spec).valve);
    assert_ne!(once.valve, draw_world(5, 3, &spec).valve);
    let plant = WorldSpec { class: Some(Class::Common), ..WorldSpec::of(World::Plant) };
    assert_ne!(once.valve, draw_world(5, 2, &plant).valve);
}

#[test]
fn without_realisms_strokes_are_full_and_rows_even() {
    let plain = draw_world(21, 0, &spec(Realisms::default()));
    for file in &plain.files {
        let (low, high) = full_range(file);
        assert!(low < 0.02 * plain.valve.stroke_m && high > 0.98 * plain.valve.stroke_m);
        let steps: Vec<f64> = file.time_s.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(steps.iter().all(|step| (step - steps[0]).abs() < 1e-9));
        assert!(file.pressures_pa.iter().all(|(name, _)| *name != "supply_pressure_kpa"));
    }
    assert_eq!(plain.truth["needed"], serde_json::json!([]));
    assert_eq!(plain.truth["category"], Category::Nothing.word());
}

#[test]
fn records_begin_where_they_say() {
    let stroke = |r: &Recording| r.valve.stroke_m;
    let moving = only("begins-moving", 1.0);
    assert!(moving.files.iter().all(|file| first_edge(file) == Some(0)));
    // Some of them have left the open stop when the record begins.
    let rest = |r: &Recording| r.files.iter().filter(|f| f.position_m[0] > 0.97 * stroke(r)).count();
    assert!(rest(&moving) < moving.files.len());
    let filling = only("begins-filling", 1.0);
    assert!(filling.files.iter().all(|file| first_edge(file) == Some(0)));
    let unrest = only("begins-before-rest", 1.0);
    assert!(unrest.files.iter().all(|file| first_edge(file).is_some_and(|row| row > 0)));
    assert!(rest(&unrest) < unrest.files.len());
    let many = only("many-cycles", 1.0);
    let command = many.files[0].command.as_ref().unwrap();
    assert!(command.windows(2).filter(|w| w[1] && !w[0]).count() >= 3);
}

#[test]
fn loggers_are_slow_lose_rows_and_run_fast() {
    let rows_to_close = |r: &Recording| {
        let file = &r.files[0];
        let shut = file.position_m.iter().position(|x| *x < 0.02 * r.valve.stroke_m).unwrap();
        shut - first_edge(file).unwrap()
    };
    let slow = only("slow-logger", 40.0);
    assert!((20..200).contains(&rows_to_close(&slow)), "{}", rows_to_close(&slow));
    assert!(rows_to_close(&draw_world(21, 0, &spec(Realisms::default()))) > 400);
    let gappy = only("lost-rows", 0.05);
    let steps: Vec<f64> = gappy.files[0].time_s.windows(2).map(|w| w[1] - w[0]).collect();
    assert!(steps.iter().any(|step| *step > 1.5 * steps[0]));
    let fast = only("clock-rate", 1e-3);
    let (even, ran) = (&draw_world(21, 0, &spec(Realisms::default())).files[0].time_s, &fast.files[0].time_s);
    assert!((ran[100] / even[100] - 1.0).abs() > 9e-4);
}

#[test]
fn a_sagging_supply_is_seen_where_it_is_recorded() {
    let deepest = (0..12)
        .filter_map(|index| {
            let sagging = draw_world(22, index, &spec(Realisms::only("supply-sag", 0.08)));
            let (_, shown) =
                sagging.files[0].pressures_pa.iter().find(|(name, _)| *name == "supply_pressure_kpa")?.clone();
            let (low, high) = shown.iter().fold((f64::MAX, f64::MIN), |(low, high), p| (low.min(*p), high.max(*p)));
            Some((high - low) / (high - crate::valve::AMBIENT_PA))
        })
        .fold(0.0, f64::max);
    assert!((0.06..0.12).contains(&deepest), "{deepest}");
}

#[test]
fn gauges_commands_and_strokes_are_off_by_their_sizes() {
    // Time from the first command to half of the stroke, of the first file.
    let half_s = |r: &Recording| {
        let file = &r.files[0];
        let half = file.position_m.iter().position(|x| *x < 0.5 * r.valve.stroke_m).unwrap();
        file.time_s[half] - file.time_s[first_edge(file).unwrap()]
    };
    let plain = draw_world(23, 0, &spec(Realisms::default()));
    let off = |name: &'static str, size: f64| {
        let other = draw_world(23, 0, &spec(Realisms::only(name, size)));
        assert_eq!(other.valve, plain.valve, "{name}");
        half_s(&other) - half_s(&plain)
    };
    let late = off("late-command", 0.05);
    assert!((late.abs() - 0.05).abs() < 0.01, "{late}");
    assert!(off("supply-gauge", 0.04).abs() > 2e-3);
    assert!(off("untolerated", 0.02).abs() > 5e-4);
    assert!(off("scatter", 0.04).abs() > 1e-3);
}

#[test]
fn a_cylinder_without_a_spring_has_no_command_and_is_driven_by_its_pipe() {
    let spec = WorldSpec { class: Some(Class::Springless), ..WorldSpec::of(World::Laboratory) };
    for index in 0..4 {
        let falling = draw_world(24, index, &spec);
        let (threshold, hysteresis) = falling.driven_above_pa.unwrap();
        for file in &falling.files {
            let pipe = &file.pressures_pa[0].1;
            let above = pipe.iter().any(|p| *p > threshold + 0.5 * hysteresis);
            assert!(above && pipe.iter().any(|p| *p < threshold - 0.5 * hysteresis), "{}", falling.name);
        }
    }
    let falling = draw_world(24, 1, &spec);
    assert!(falling.campaign_toml().contains("pipe_pressure = \"measured\""));
    assert!(falling.valve_toml().contains("stiffness = \"0 N/m\"") && falling.valve_toml().contains("[tolerance]"));
    for file in &falling.files {
        assert!(file.command.is_none() && file.to_csv().starts_with("time_s,position_mm,pipe_pressure_kpa\n"));
    }
}

#[test]
fn tolerances_and_noise_are_stated_now_and_then() {
    let drawn: Vec<Recording> = (0..24).map(|index| draw_world(25, index, &spec(Realisms::default()))).collect();
    let silent = drawn.iter().filter(|r| !r.valve_toml().contains("[tolerance]")).count();
    assert!((1..=12).contains(&silent), "{silent}");
    let stated = drawn.iter().filter(|r| r.campaign_toml().contains("position_noise")).count();
    assert!((1..=12).contains(&stated), "{stated}");
}

#[test]
fn what_is_hidden_has_a_visible_size_and_a_right_answer() {
    let spec = WorldSpec {
        weights: [0.0, 1.0, 0.0, 0.0],
        class: Some(Class::Common),
        realisms: Some(Realisms::default()),
        ..WorldSpec::of(World::Laboratory)
    };
    let (mut plain, mut faint) = (0, 0);
    for index in 0..17 {
        let truth = draw_world(26, index, &spec).truth;
        let visible = truth["visible"].as_object().unwrap().values().next().unwrap();
        let nats = visible["nats"].as_f64().unwrap();
        assert!(visible["position_rms_mm"].as_f64().unwrap() > 0.0, "{truth}");
        assert_eq!(truth["needed"].as_array().unwrap().len(), usize::from(nats >= visible::PLAIN_NATS), "{truth}");
        if nats >= visible::PLAIN_NATS { plain += 1 } else { faint += 1 }
    }
    assert!(plain >= 9 && faint <= 8, "{plain} plain, {faint} faint");
}
