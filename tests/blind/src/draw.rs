//! Drawing campaigns from a seed.

use rand::rngs::StdRng;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};

use crate::campaign::{Campaign, Run, TimingRow};
use crate::conditions::{Plan, believed_valve};
use crate::effects::{CATALOGUE, Drawn, Scale, go_together, hide};
use crate::hidden::{Bristles, Hidden};
use crate::record::{Trace, record, stroke_times};
use crate::rig::Conditions;
use crate::spool::Edge;
use crate::strange::{OUTSIDE, hide_outside};
use crate::truth::{Category, Scatter, Truth};
use crate::valve::{TOLERANCES, Valve};

/// One sigma of recorded pressures.
pub const PRESSURE_NOISE_PA: f64 = 500.0;
/// Noise levels of the position sensor, one sigma.
pub const POSITION_NOISES_M: [f64; 3] = [0.03e-3, 0.1e-3, 0.3e-3];
/// Time between rows of a trace.
pub const INTERVAL_S: f64 = 1e-3;
/// One sigma of stroke times taken from limit switches.
const TIMING_NOISE_S: f64 = 3e-3;
/// Resolution of the position sensor.
const RESOLUTION_M: f64 = 5e-6;
/// Scatter where conditions are repeated.
const SCATTER: Scatter = Scatter { delay_s: 1e-3, preload: 0.003, flow: 0.003, supply: 0.003 };
/// Scatter of stroke times taken from limit switches.
const TIMING_SCATTER: Scatter = Scatter { delay_s: 0.0, preload: 0.002, flow: 0.002, supply: 0.0 };

/// What to draw. Where an option is none, the campaign's own random numbers decide evenly.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawSpec {
    /// Weights of the categories nothing, one, two, outside, in this order.
    pub weights: [f64; 4],
    /// Whether pressures are recorded.
    pub pressures: Option<bool>,
    /// Whether conditions are repeated, with scatter from stroke to stroke.
    pub repeats: Option<bool>,
    /// Position noise, one sigma.
    pub position_noise_m: Option<f64>,
    /// Share of campaigns on the testbed valve; the others have a drawn valve.
    pub testbed_share: f64,
    /// Whether only stroke times are taken.
    pub timings_only: bool,
    /// How dry friction gives before it slides.
    pub bristles: Bristles,
    /// Share of campaigns whose tolerated parameters are all off; in the others they are exact.
    pub off_share: f64,
}

impl Default for DrawSpec {
    fn default() -> Self {
        Self {
            weights: [0.25, 0.45, 0.15, 0.15],
            pressures: None,
            repeats: None,
            position_noise_m: None,
            testbed_share: 0.3,
            timings_only: false,
            bristles: Bristles::Compliant,
            off_share: 0.9,
        }
    }
}

/// Draws the campaign `index` of `seed`. The same arguments give the same campaign, whatever else
/// was drawn before. Categories follow their weights over consecutive indices as evenly as they
/// can, and seventeen campaigns of one category go through the catalogue once.
pub fn draw(seed: u64, index: usize, spec: &DrawSpec) -> Campaign {
    let (category, rank) = category_of(index, spec.weights);
    for attempt in 0_u64.. {
        let mixed =
            seed ^ (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ attempt.wrapping_mul(0xd1b5_4a32_d192_ed03);
        let mut rng = StdRng::seed_from_u64(mixed);
        if let Some(campaign) = attempt_draw(seed, index, category, rank, spec, &mut rng) {
            return campaign;
        }
    }
    unreachable!("the attempts are endless")
}

/// The category of an index and how many of that category came before it: at every index the one
/// that lags most behind its weight.
fn category_of(index: usize, weights: [f64; 4]) -> (Category, usize) {
    const ORDER: [Category; 4] = [Category::Nothing, Category::One, Category::Two, Category::Outside];
    let total: f64 = weights.iter().sum();
    let mut counts = [0_usize; 4];
    let mut last = 0;
    for step in 0..=index {
        let behind = |k: usize| weights[k] / total * (step + 1) as f64 - counts[k] as f64;
        last = (0..4).filter(|&k| weights[k] > 0.0).max_by(|&a, &b| behind(a).total_cmp(&behind(b))).unwrap_or(0);
        counts[last] += 1;
    }
    (ORDER[last], counts[last] - 1)
}

/// The entry `rank` of an endless walk through `ids`, every lap in an order of its own.
fn walk(seed: u64, rank: usize, ids: &[&'static str]) -> &'static str {
    let lap = (rank / ids.len()) as u64;
    let mut order = ids.to_vec();
    order.shuffle(&mut StdRng::seed_from_u64(seed ^ (lap << 40)));
    order[rank % ids.len()]
}

/// One try; none when the valve it drew does not make full strokes under all conditions.
fn attempt_draw(
    seed: u64,
    index: usize,
    category: Category,
    rank: usize,
    spec: &DrawSpec,
    rng: &mut StdRng,
) -> Option<Campaign> {
    let testbed = rng.random_bool(spec.testbed_share);
    let has_pressures = spec.pressures.unwrap_or_else(|| rng.random_bool(0.5));
    let repeats = spec.repeats.unwrap_or_else(|| rng.random_bool(0.5));
    let noise_m =
        spec.position_noise_m.unwrap_or_else(|| POSITION_NOISES_M[rng.random_range(0..POSITION_NOISES_M.len())]);
    let (believed, plan, close_s) = believed_valve(testbed, spec.timings_only, repeats, rng)?;

    let mut hidden = Hidden { bristles: spec.bristles, ..Hidden::default() };
    let scale = Scale::of(&believed, close_s);
    // Stroke times say less than a trace: sizes as for a noisy position.
    let size_noise_m = if spec.timings_only { 2e-4 } else { noise_m };
    let mut effects = Vec::new();
    let mut outside: Vec<Drawn> = Vec::new();
    match category {
        Category::Nothing => {}
        Category::One => effects.push(hide(walk(seed, rank, &CATALOGUE), scale, size_noise_m, rng, &mut hidden)),
        Category::Two => {
            let first = walk(seed, rank, &CATALOGUE);
            let others: Vec<_> = CATALOGUE.into_iter().filter(|other| go_together(first, other)).collect();
            let second = others[rng.random_range(0..others.len())];
            effects.push(hide(first, scale, size_noise_m, rng, &mut hidden));
            effects.push(hide(second, scale, size_noise_m, rng, &mut hidden));
        }
        Category::Outside => {
            let id = walk(seed, rank, &OUTSIDE);
            outside.push(hide_outside(id, &believed, scale, size_noise_m, rng, &mut hidden));
        }
    }

    let mut factors = [1.0; 7];
    if rng.random_bool(spec.off_share) {
        for (factor, (_, sigma)) in factors.iter_mut().zip(TOLERANCES) {
            *factor = three_decimals(1.0 + sigma * normal(rng).clamp(-2.0, 2.0));
        }
    }
    let actual = believed.scaled(&factors);
    let label = match (category, effects.first(), outside.first()) {
        (_, Some(one), _) => {
            effects.get(1).map_or_else(|| one.id.to_owned(), |two| format!("{}-and-{}", one.id, two.id))
        }
        (_, None, Some(one)) => format!("outside-{}", one.id),
        _ => "nothing".to_owned(),
    };
    let mut campaign = Campaign {
        name: format!("c{index:03}-{label}"),
        valve: believed,
        runs: Vec::new(),
        timings: Vec::new(),
        truth: Truth {
            seed,
            index,
            category,
            effects,
            outside,
            factors,
            testbed_valve: testbed,
            bristles: spec.bristles,
            has_pressures: has_pressures && !spec.timings_only,
            timings_only: spec.timings_only,
            position_noise_m: noise_m,
            timing_noise_s: if spec.timings_only { TIMING_NOISE_S } else { 0.0 },
            scatter: if spec.timings_only { Some(TIMING_SCATTER) } else { repeats.then_some(SCATTER) },
            repeats: repeats || spec.timings_only,
        },
    };
    if spec.timings_only {
        take_times(&mut campaign, &actual, &hidden, &plan, rng)?;
    } else {
        take_traces(&mut campaign, &actual, &hidden, &plan, rng)?;
    }
    Some(campaign)
}

/// The valve and conditions of one stroke, scattered.
fn scattered(actual: &Valve, set: &Conditions, scatter: Option<Scatter>, rng: &mut StdRng) -> (Valve, Conditions, f64) {
    let (mut valve, mut conditions, mut delay_s) = (actual.clone(), set.clone(), 0.0);
    if let Some(sigma) = scatter {
        delay_s = (sigma.delay_s * normal(rng)).clamp(-10e-3, 10e-3);
        valve.preload_m *= 1.0 + sigma.preload * normal(rng);
        let flow = 1.0 + sigma.flow * normal(rng);
        valve.solenoid_area_m2 *= flow;
        valve.port_area_m2 *= flow;
        conditions.leak_to_atmosphere_m2 *= flow;
        conditions.leak_from_supply_m2 *= flow;
        conditions.supply_psig *= 1.0 + sigma.supply * normal(rng);
    }
    (valve, conditions, delay_s)
}

fn take_traces(campaign: &mut Campaign, actual: &Valve, hidden: &Hidden, plan: &Plan, rng: &mut StdRng) -> Option<()> {
    let edges = [Edge { at_s: 0.0, close: true }, Edge { at_s: campaign.valve.open_at_s, close: false }];
    for set in &plan.conditions {
        let (valve, conditions, delay_s) = scattered(actual, set, campaign.truth.scatter, rng);
        let ideal = record(&valve, hidden, &conditions, &edges, delay_s, plan.end_s, INTERVAL_S);
        if !full_strokes(&ideal, &campaign.valve) {
            return None;
        }
        campaign.runs.push(measured(set.clone(), ideal, &campaign.truth, rng));
    }
    Some(())
}

/// Whether the valve closed before it was let go and opened again before the end, with time to
/// spare for the rests.
fn full_strokes(trace: &Trace, valve: &Valve) -> bool {
    let until = |end: f64| trace.time_s.iter().filter(|&&t| t <= end).count();
    let shut = until(0.9 * valve.open_at_s);
    let end = trace.time_s.len();
    trace.position_m[..shut].iter().any(|&x| x <= 0.0)
        && trace.position_m[end - end / 50..].iter().all(|&x| x >= valve.stroke_m)
}

/// What the sensors make of an ideal trace.
fn measured(set: Conditions, ideal: Trace, truth: &Truth, rng: &mut StdRng) -> Run {
    let position_m = ideal
        .position_m
        .iter()
        .map(|x| ((x + truth.position_noise_m * normal(rng)) / RESOLUTION_M).round() * RESOLUTION_M)
        .collect();
    let mut gauge = |pressures: &[f64]| -> Vec<f64> {
        pressures.iter().map(|p| ((p + PRESSURE_NOISE_PA * normal(rng)) / 10.0).round() * 10.0).collect()
    };
    let pressures_pa = truth.has_pressures.then(|| (gauge(&ideal.chamber_pa), gauge(&ideal.pipe_pa)));
    Run { conditions: set, time_s: ideal.time_s, command: ideal.command, position_m, pressures_pa }
}

fn take_times(campaign: &mut Campaign, actual: &Valve, hidden: &Hidden, plan: &Plan, rng: &mut StdRng) -> Option<()> {
    for set in &plan.conditions {
        let (valve, conditions, _) = scattered(actual, set, campaign.truth.scatter, rng);
        let leaks = set.leak_to_atmosphere_m2 > 0.0 || set.leak_from_supply_m2 > 0.0;
        let (close, open) = stroke_times(&valve, hidden, &conditions, if leaks { 2 } else { 1 });
        let mut read = |t: f64| ((t + TIMING_NOISE_S * normal(rng)) * 1e4).round() / 1e4;
        campaign.timings.push(TimingRow {
            conditions: set.clone(),
            close_s: Some(read(close?)),
            open_s: Some(read(open?)),
        });
    }
    Some(())
}

fn normal(rng: &mut StdRng) -> f64 {
    Normal::new(0.0, 1.0).map_or(0.0, |n| n.sample(rng))
}

fn three_decimals(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}
