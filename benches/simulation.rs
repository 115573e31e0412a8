//! Simulation: a step, a cycle, both tables, a fleet.

#[path = "../tests/reference_valve/mod.rs"]
mod reference_valve;

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use leak_table::Fault;
use lut_builder::{Options, build};
use rayon::prelude::*;
use reference_valve::plain::Plain;
use reference_valve::{CYCLE, base_valve, leaking, spread, table_model, testbed, testbed_file, typical, with_effect};
use valve_model::cycle::{cycle_commands, cycles};
use valve_model::dispatch::InstructionSet;
use valve_model::simulate::{ABREAST, DEFAULT_STEP_S, simulate_scalar, simulate_with};
use valve_model::{Conditions, EffectKind, ParameterId, Prepared, Run, Start, Valve, simulate};

/// Effects of which the price of a step is printed, one for each group of terms.
const WITH_EFFECTS: [EffectKind; 5] = [
    EffectKind::DRY_FRICTION,
    EffectKind::GAS_HEATING,
    EffectKind::PROCESS_FORCE,
    EffectKind::SOLENOID_LAG,
    EffectKind::SUPPLY_DROOP,
];

/// Valves of the fleet.
const FLEET: usize = 10_000;

/// A leaking cycle of the reference valve, as many times as runs advance together.
fn leaking_runs(valve: &Valve) -> Vec<Prepared> {
    let conditions = leaking(valve, Fault::Atmosphere, 0.1e-6);
    let run =
        Run { conditions, commands: cycle_commands(&CYCLE), end_s: CYCLE.end_s, prescribed: None, start: Start::Rest };
    vec![Prepared::new(valve, &run, DEFAULT_STEP_S); ABREAST]
}

fn step_count(runs: &[Prepared]) -> u64 {
    let mut steps = 0;
    simulate_scalar(runs, false, |_, nodes, _| steps += nodes.time_s.len() as u64 - 1);
    steps
}

/// The fastest of some calls.
fn fastest(mut call: impl FnMut()) -> Duration {
    let time = |()| {
        let start = Instant::now();
        call();
        start.elapsed()
    };
    std::iter::repeat_n((), 9).map(time).min().unwrap_or_default()
}

fn plain_steps(valve: &Valve, steps: u64) {
    let conditions = leaking(valve, Fault::Atmosphere, 0.1e-6);
    let plain = Plain::new(valve.parameters(), &conditions, 1e-3);
    let mut state = plain.rest();
    for index in 0..steps {
        state = plain.step(state, index < steps / 2, DEFAULT_STEP_S);
    }
    black_box(state);
}

/// Time per step and lane: plain program, scalar path, lanes with each instruction set.
fn step(criterion: &mut Criterion) {
    const PLAIN_STEPS: u64 = 8000;
    let valve = base_valve(testbed());
    let runs = leaking_runs(&valve);
    let steps = step_count(&runs);
    let mut group = criterion.benchmark_group("step");
    group.throughput(Throughput::Elements(PLAIN_STEPS));
    group.bench_function("plain scalar with powf", |b| b.iter(|| plain_steps(&valve, PLAIN_STEPS)));
    group.throughput(Throughput::Elements(steps));
    group.bench_function("scalar", |b| b.iter(|| simulate_scalar(&runs, false, |_, nodes, _| keep(nodes))));
    let sets = || InstructionSet::ALL.into_iter().filter(|set| set.is_available());
    for set in sets() {
        let name = format!("lanes, {}", set.name());
        group.bench_function(name, |b| b.iter(|| simulate_with(set, &runs, false, |_, nodes, _| keep(nodes))));
    }
    group.finish();

    let plain = ns_each(fastest(|| plain_steps(&valve, PLAIN_STEPS)), PLAIN_STEPS);
    println!("lane-step: plain scalar with powf {plain:.1} ns");
    for set in sets() {
        let lanes = ns_each(fastest(|| simulate_with(set, &runs, false, |_, nodes, _| keep(nodes))), steps);
        println!("lane-step: {} {lanes:.1} ns, {:.1} times faster", set.name(), plain / lanes);
    }
    for kind in WITH_EFFECTS {
        let runs = leaking_runs(&with_effect(typical(kind)));
        let steps = step_count(&runs);
        let lanes = ns_each(fastest(|| simulate(&runs, false, |_, nodes, _| keep(nodes))), steps);
        println!("lane-step with {}: {lanes:.1} ns", kind.id());
    }
}

fn keep(nodes: &valve_model::Trajectory) {
    black_box(nodes.position_m.last());
}

fn ns_each(time: Duration, count: u64) -> f64 {
    time.as_secs_f64() * 1e9 / count as f64
}

/// One healthy cycle from rest with its stroke times.
fn cycle(criterion: &mut Criterion) {
    let valve = base_valve(testbed());
    let conditions = Conditions::nominal(valve.parameters());
    let mut group = criterion.benchmark_group("cycle");
    for count in [1, ABREAST] {
        let valves = vec![(&valve, conditions); count];
        group.throughput(Throughput::Elements(count as u64));
        let name = if count == 1 { "one valve" } else { "sixteen valves in lanes" };
        group.bench_function(name, |b| b.iter(|| cycles(black_box(&valves), &CYCLE, 1, DEFAULT_STEP_S)));
    }
    group.finish();
}

/// Both tables of the reference valve.
fn tables(criterion: &mut Criterion) {
    let file = testbed_file();
    let text = file.canonical_model();
    let mut group = criterion.benchmark_group("both tables");
    group.sample_size(10);
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        let build = || build(&table_model(&file, &text), &Options::default(), &|_| {}).expect("has tables");
        group.bench_function(format!("threads: {threads}"), |b| b.iter(|| pool.install(build)));
    }
    group.finish();
}

/// Valves with every parameter of their own.
fn fleet() -> Vec<Valve> {
    let one = |index: usize| {
        let mut parameters = testbed();
        let factors = spread(ParameterId::ALL.len(), 0.001 * index as f64);
        for (&id, factor) in ParameterId::ALL.iter().zip(factors) {
            if id != ParameterId::AmbientPressure {
                parameters.set(id, parameters.get(id) * (0.9 + 0.2 * factor));
            }
        }
        base_valve(parameters)
    };
    (0..FLEET).map(one).collect()
}

/// One cycle of every valve of a fleet; printed, since once is enough.
fn sweep(_: &mut Criterion) {
    let valves = fleet();
    let runs: Vec<_> = valves.iter().map(|valve| (valve, Conditions::nominal(valve.parameters()))).collect();
    let mut alone = 0.0;
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        let start = Instant::now();
        let sweep = || runs.par_chunks(4 * ABREAST).flat_map_iter(|batch| cycles(batch, &CYCLE, 1, DEFAULT_STEP_S));
        let closed = pool.install(|| sweep().filter(|times| times[0].close_time_s.is_some()).count());
        let pace = FLEET as f64 / start.elapsed().as_secs_f64();
        if threads == 1 {
            alone = pace;
        }
        println!(
            "fleet of {FLEET}, {threads} threads: {pace:.0} cycles/s ({:.2} times one), {closed} closed",
            pace / alone
        );
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    targets = step, cycle, tables, sweep
}
criterion_main!(benches);
