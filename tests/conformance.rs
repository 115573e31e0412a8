//! Lanes and scalar path are one model, with every effect; effects that are not there change nothing.

mod reference_valve;

use reference_valve::{CYCLE, base_valve, periodic, testbed, typical, with_effect};
use valve_model::custom::{CustomEffect, CustomTarget};
use valve_model::cycle::cycle_commands;
use valve_model::dispatch::InstructionSet;
use valve_model::effects::{EffectParameter, Search};
use valve_model::params::Switches;
use valve_model::simulate::{DEFAULT_STEP_S, simulate_scalar, simulate_with};
use valve_model::state::State;
use valve_model::stroke::strokes;
use valve_model::{CommandEdge, Conditions, Effect, EffectKind, Prepared, Run, Start, Trajectory, Valve, simulate};

/// Halving the step changes no stroke time by more, with any effect, s.
const STEP_S: f64 = 0.1e-3;

/// Scalar path and lanes agree in every stroke time within this, s.
const SAME_TIME_S: f64 = 1e-9;

/// The commands of six runs.
fn commands() -> Vec<Vec<CommandEdge>> {
    let of_run = |index: usize| {
        let mut commands = cycle_commands(&CYCLE);
        commands[1].time_s += 0.1237 * index as f64;
        commands
    };
    (0..6).map(of_run).collect()
}

/// Six runs of a valve that differ in everything that may differ from lane to lane.
fn runs(valve: &Valve) -> Vec<Prepared> {
    let nominal = Conditions::nominal(valve.parameters());
    let mut conditions = vec![nominal; 6];
    conditions[1].leak_to_atmosphere_m2 = 0.3e-6;
    conditions[2].leak_to_atmosphere_m2 = 0.64e-6;
    conditions[3].leak_from_supply_m2 = 0.1e-6;
    conditions[4].leak_from_supply_m2 = 0.21e-6;
    conditions[5].supply_pressure_pa *= 0.8;
    conditions[5].temperature_k = 270.0;
    let run = |((index, conditions), commands): ((usize, Conditions), Vec<CommandEdge>)| {
        let run =
            Run { conditions, commands, end_s: CYCLE.end_s - 0.5 * index as f64, prescribed: None, start: Start::Rest };
        Prepared::new(valve, &run, DEFAULT_STEP_S)
    };
    conditions.into_iter().enumerate().zip(commands()).map(run).collect()
}

/// Every number of a run, as bits.
fn bits(nodes: &Trajectory, end: &State<f64>) -> Vec<u64> {
    let channels = [
        &nodes.time_s,
        &nodes.position_m,
        &nodes.velocity_m_per_s,
        &nodes.chamber_pressure_pa,
        &nodes.pipe_pressure_pa,
    ];
    let mut all: Vec<f64> = channels.into_iter().flatten().copied().collect();
    all.extend([end.x, end.v, end.chamber_mass, end.pipe_mass, end.chamber_temperature, end.pipe_temperature]);
    all.extend([end.line_pressure, end.bristle]);
    all.into_iter().map(f64::to_bits).collect()
}

fn with_lanes(runs: &[Prepared]) -> Vec<Vec<u64>> {
    let mut all = vec![Vec::new(); runs.len()];
    simulate(runs, true, |index, nodes, end| all[index] = bits(nodes, end));
    all
}

fn with_set(set: InstructionSet, runs: &[Prepared]) -> Vec<Vec<u64>> {
    let mut all = vec![Vec::new(); runs.len()];
    simulate_with(set, runs, true, |index, nodes, end| all[index] = bits(nodes, end));
    all
}

fn one_by_one(runs: &[Prepared]) -> Vec<Vec<u64>> {
    let mut all = vec![Vec::new(); runs.len()];
    simulate_scalar(runs, true, |index, nodes, end| all[index] = bits(nodes, end));
    all
}

fn available() -> impl Iterator<Item = InstructionSet> {
    InstructionSet::ALL.into_iter().filter(|set| set.is_available())
}

/// The base valve and the valve with each effect at its typical size.
fn all_valves() -> Vec<(String, Valve)> {
    let base = ("base".to_owned(), base_valve(testbed()));
    let effects = EffectKind::ALL.iter().map(|kind| (kind.id().to_owned(), with_effect(typical(*kind))));
    std::iter::once(base).chain(effects).collect()
}

/// The same, and valves with two effects and with formulas: those have loops of their own, or share one.
fn valves_for_every_loop() -> Vec<(String, Valve)> {
    let pairs = [
        (EffectKind::PROCESS_FORCE, EffectKind::DRY_FRICTION),
        (EffectKind::CLOSING_CUSHION, EffectKind::GAS_HEATING),
        (EffectKind::PROCESS_FORCE, EffectKind::SUPPLY_DROOP),
        (EffectKind::DRY_FRICTION, EffectKind::GAS_HEATING),
        (EffectKind::DRY_FRICTION, EffectKind::SUPPLY_DROOP),
        (EffectKind::SOLENOID_LAG, EffectKind::GAS_HEATING),
    ];
    let with = |effects: Vec<Effect>, custom: Vec<CustomEffect>| {
        Valve::new(testbed(), Switches::default(), effects, custom).expect("possible")
    };
    let pair = |(a, b): (EffectKind, EffectKind)| {
        (format!("{} and {}", a.id(), b.id()), with(vec![typical(a), typical(b)], Vec::new()))
    };
    let formula = |name: &str, target: CustomTarget, formula: &str| {
        CustomEffect::new(name, target, formula, Vec::new()).expect("a formula")
    };
    let table = formula("table", CustomTarget::Friction, "table(x, 0, L, 10, 20, 60, 20, 10)");
    let bump = formula("bump", CustomTarget::Force, "-40*exp(-((x - 0.012)/0.002)^2) + 5*sin(v/0.01)*sign(v)");
    let formulas = [("friction", vec![table.clone()]), ("force", vec![bump.clone()]), ("both", vec![table, bump])];
    let custom = formulas.map(|(name, custom)| (format!("formula for {name}"), with(Vec::new(), custom)));
    all_valves().into_iter().chain(pairs.map(pair)).chain(custom).collect()
}

#[test]
fn lanes_that_fuse_nothing_give_the_bits_of_the_scalar_path() {
    for (name, valve) in valves_for_every_loop() {
        let runs = runs(&valve);
        let (lanes, scalar) = (with_set(InstructionSet::Baseline, &runs), one_by_one(&runs));
        assert!(scalar.iter().all(|run| run.len() > 10_000), "{name}: a run has thousands of nodes");
        assert!(lanes == scalar, "{name}: lanes differ from the scalar path");
    }
}

#[test]
fn lanes_that_fuse_give_the_same_bits_in_registers_of_any_width() {
    for (name, valve) in valves_for_every_loop() {
        let runs = runs(&valve);
        let widest = with_lanes(&runs);
        for set in available().filter(|set| *set != InstructionSet::Baseline) {
            assert!(with_set(set, &runs) == widest, "{name}: lanes with {} differ", set.name());
            for (run, beside) in runs.iter().zip(&widest) {
                let alone = with_set(set, std::slice::from_ref(run));
                assert!(alone[0] == *beside, "{name}: a run alone with {} differs from one beside others", set.name());
            }
        }
    }
}

#[test]
fn every_stroke_time_is_that_of_the_scalar_path_within_a_nanosecond() {
    let mut worst: f64 = 0.0;
    for (name, valve) in valves_for_every_loop() {
        let runs = runs(&valve);
        let commands = commands();
        let times = |index: usize, nodes: &Trajectory| strokes(&valve, &commands[index], nodes);
        let mut scalar = vec![Vec::new(); runs.len()];
        simulate_scalar(&runs, false, |index, nodes, _| scalar[index] = times(index, nodes));
        assert!(scalar.iter().flatten().filter(|stroke| stroke.time_s.is_some()).count() >= 10, "{name}: strokes");
        for set in available() {
            simulate_with(set, &runs, false, |index, nodes, _| {
                for (lane, alone) in times(index, nodes).iter().zip(&scalar[index]) {
                    assert_eq!(lane.time_s.is_some(), alone.time_s.is_some(), "{name}, {}, run {index}", set.name());
                    let off = lane.time_s.zip(alone.time_s).map_or(0.0, |(a, b)| (a - b).abs());
                    assert!(off < SAME_TIME_S, "{name}, {}, run {index}: {off:e} s apart", set.name());
                    worst = worst.max(off);
                }
            });
        }
    }
    println!("largest difference {worst:e} s");
}

#[test]
fn lanes_do_not_depend_on_their_neighbours() {
    let valve = base_valve(testbed());
    let runs = runs(&valve);
    let together = with_lanes(&runs);
    let mut reversed: Vec<Prepared> = runs.iter().rev().cloned().collect();
    reversed.extend(runs.iter().cloned());
    let mut other = with_lanes(&reversed);
    let again = other.split_off(runs.len());
    other.reverse();
    assert!(together == other && together == again);
}

#[test]
fn every_effect_acts_at_its_typical_size() {
    let base = with_lanes(&runs(&base_valve(testbed())));
    for (name, valve) in all_valves().into_iter().skip(1) {
        let kind = EffectKind::from_id(&name).expect("from the catalogue");
        // These change the record of a run, not the run.
        let measurement = kind.info().acts_on.is_measurement();
        assert_eq!(with_lanes(&runs(&valve)) == base, measurement, "{name}");
    }
}

#[test]
fn neutral_effects_change_nothing() {
    let base = with_lanes(&runs(&base_valve(testbed())));
    let mut neutral = Vec::new();
    for &kind in EffectKind::ALL {
        let at_neutral = |(parameter, value): (&EffectParameter, &f64)| match parameter.search {
            Search::ExcessOver { .. } => Some(kind.info().neutral),
            _ if parameter.is_size() => Some(kind.info().neutral),
            _ => Some(*value),
        };
        let values: Vec<_> = kind.parameters().iter().zip(typical(kind).values()).map(at_neutral).collect();
        let Ok(effect) = Effect::new(kind, &values) else {
            assert!(kind.info().neutral.is_nan(), "{}: it is off by being absent", kind.id());
            continue;
        };
        assert!(with_lanes(&runs(&with_effect(effect))) == base, "{}", kind.id());
        neutral.push(effect);
    }
    let all = Valve::new(testbed(), Switches::default(), neutral, Vec::new()).expect("possible");
    assert!(with_lanes(&runs(&all)) == base, "all of them together");
}

#[test]
fn halving_the_step_changes_little_with_any_effect() {
    let mut worst = Vec::new();
    for (name, valve) in all_valves() {
        let nominal = Conditions::nominal(valve.parameters());
        let mut conditions = [nominal; 4];
        conditions[1].leak_to_atmosphere_m2 = 0.3e-6;
        conditions[2].leak_from_supply_m2 = 0.1e-6;
        conditions[3].supply_pressure_pa *= 0.85;
        let valves: Vec<_> = conditions.iter().map(|conditions| (&valve, *conditions)).collect();
        let whole = periodic(&valves, &CYCLE, DEFAULT_STEP_S);
        let half = periodic(&valves, &CYCLE, 0.5 * DEFAULT_STEP_S);
        for (index, (whole, half)) in whole.iter().zip(&half).enumerate() {
            for (a, b) in [(whole.close_time_s, half.close_time_s), (whole.open_time_s, half.open_time_s)] {
                assert_eq!(a.is_some(), b.is_some(), "{name}, run {index}");
                let change = a.zip(b).map_or(0.0, |(a, b)| (a - b).abs());
                worst.push((change, format!("{name}, run {index}: {a:?} s and {b:?} s")));
            }
        }
    }
    let beyond: Vec<_> = worst.iter().filter(|(change, _)| *change >= STEP_S).collect();
    assert!(beyond.is_empty(), "{beyond:#?}");
}
