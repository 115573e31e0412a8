//! Drawing campaigns from a seed.

use rand::rngs::StdRng;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};

use crate::campaign::Campaign;
use crate::conditions::believed_valve;
use crate::effects::{CATALOGUE, Draft, Drawn, Scale, go_together, hide};
use crate::hidden::{Bristles, Hidden};
use crate::measure;
use crate::strange::{OUTSIDE, hide_outside};
use crate::truth::{Category, Channels, Scatter, Truth};
use crate::valve::{TOLERANCES, Valve};

/// Noise levels of the position sensor, one sigma.
pub const POSITION_NOISES_M: [f64; 3] = [0.03e-3, 0.1e-3, 0.3e-3];
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
    /// Whether strokes scatter even where none is repeated.
    pub always_scatters: bool,
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
            always_scatters: false,
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
pub(crate) fn category_of(index: usize, weights: [f64; 4]) -> (Category, usize) {
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
pub(crate) fn walk(seed: u64, rank: usize, ids: &[&'static str]) -> &'static str {
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

    // Stroke times say less than a trace: sizes as for a noisy position.
    let size_noise_m = if spec.timings_only { 2e-4 } else { noise_m };
    let scale = Scale::of(&believed, close_s);
    let draft = Draft { rng: &mut *rng, scale, noise_m: size_noise_m, parameters: Vec::new() };
    let Secret { mut hidden, effects, outside } = secret(seed, category, rank, &believed, draft);
    hidden.bristles = spec.bristles;
    let channels = if spec.timings_only {
        Channels::Timings
    } else if has_pressures {
        Channels::PositionAndPressures
    } else {
        Channels::Position
    };
    let mut factors = [1.0; 7];
    if rng.random_bool(spec.off_share) {
        for (factor, (_, sigma)) in factors.iter_mut().zip(TOLERANCES) {
            *factor = three_decimals(1.0 + sigma * measure::normal(rng).clamp(-2.0, 2.0));
        }
    }
    let actual = believed.scaled(&factors);
    let mut campaign = Campaign {
        name: format!("c{index:03}-{}", label(&effects, &outside)),
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
            channels,
            position_noise_m: noise_m,
            timing_noise_s: if spec.timings_only { measure::TIMING_NOISE_S } else { 0.0 },
            scatter: if spec.timings_only {
                Some(TIMING_SCATTER)
            } else {
                (repeats || spec.always_scatters).then_some(SCATTER)
            },
            repeats: repeats || spec.timings_only,
        },
    };
    if spec.timings_only {
        measure::take_times(&mut campaign, &actual, &hidden, &plan, rng)?;
    } else {
        measure::take_traces(&mut campaign, &actual, &hidden, &plan, rng)?;
    }
    Some(campaign)
}

/// What a drawn campaign hides, as the rig takes it and as it is told.
struct Secret {
    hidden: Hidden,
    effects: Vec<Drawn>,
    outside: Vec<Drawn>,
}

/// Draws the hidden effects of a category; `draft` says where their sizes come from.
fn secret(seed: u64, category: Category, rank: usize, believed: &Valve, mut draft: Draft<'_>) -> Secret {
    let mut secret = Secret { hidden: Hidden::default(), effects: Vec::new(), outside: Vec::new() };
    match category {
        Category::Nothing => {}
        Category::One => {
            let id = walk(seed, rank, &CATALOGUE);
            secret.effects.push(hide(id, &mut draft, &mut secret.hidden));
        }
        Category::Two => {
            let first = walk(seed, rank, &CATALOGUE);
            let others: Vec<_> = CATALOGUE.into_iter().filter(|other| go_together(first, other)).collect();
            let second = others[draft.rng.random_range(0..others.len())];
            for id in [first, second] {
                secret.effects.push(hide(id, &mut draft, &mut secret.hidden));
            }
        }
        Category::Outside => {
            let id = walk(seed, rank, &OUTSIDE);
            secret.outside.push(hide_outside(id, believed, &mut draft, &mut secret.hidden));
        }
    }
    secret
}

/// The part of a campaign's name that tells what is hidden.
pub(crate) fn label(effects: &[Drawn], outside: &[Drawn]) -> String {
    match (effects, outside) {
        ([], []) => "nothing".to_owned(),
        ([], [odd, ..]) => format!("outside-{}", odd.id),
        (known, _) => known.iter().map(|effect| effect.id).collect::<Vec<_>>().join("-and-"),
    }
}

pub(crate) fn three_decimals(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}
