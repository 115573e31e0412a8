//! One life: what really is, and what the log says.

use std::f64::consts::TAU;

use super::catalogue::{Scenario, Weather};
use super::path::Path;
use super::world::{ValveState, Wear, World};
use crate::reading::Reading;
use crate::study::noise::NoiseSource;

/// One-sigma share of a supply pressure that varies at random.
const RANDOM_SUPPLY: f64 = 0.03;
/// Amplitude of a supply pressure that swings, Pa (3 psi), and its period.
const SWING_PA: f64 = 3.0 * 6894.757;
const SWING_CYCLES: f64 = 24.0;
/// Amplitude of a season, K, and the cycles of a year.
const SEASON_K: f64 = 15.0;
const SEASON_CYCLES: f64 = 120.0;
/// The smaller of two leaks that grow together, over the larger one.
const LESSER_LEAK: [f64; 2] = [0.1, 1.0];
/// Severity of the first leak at which a second one begins, and the logarithm of that one's growth over the first one's.
const SECOND_AT: [f64; 2] = [0.3, 0.7];
const LN_SECOND_PACE: [f64; 2] = [-1.1, 1.1];
/// Times the severity of its own end up to which a life with both leaks is looked at.
/// Leaks that hide each other for longer are drawn anew.
const LONGEST_TOGETHER: f64 = 1.9;
/// Decimals of a written time: 0.1 ms.
const WRITTEN_S: f64 = 1e-4;

/// A life with its log.
pub(crate) struct Life {
    pub readings: Vec<Reading>,
    /// Largest severity of any wear at each reading.
    pub severity: Vec<f64>,
    /// The first cycle in which a stroke really took longer than its limit, or did not arrive: under a supply pressure below
    /// the reference that is before the end.
    pub over_from: f64,
    pub end_cycle: f64,
    pub begins: f64,
    /// What is really there; empty for a healthy valve.
    pub wear: Vec<Wear>,
    /// The wear that is not there from the beginning, and the cycle from which on it is.
    pub later: Option<(Wear, f64)>,
}

/// The severity of each wear over the path of a life.
struct Course {
    /// When the path is at 1.
    share: [f64; Wear::ALL.len()],
    /// What begins when the path is somewhere, and its growth over that of the path.
    later: Option<(Wear, f64, f64)>,
}

impl Course {
    fn state(&self, path: f64) -> ValveState {
        let mut severity = self.share.map(|part| part * path);
        if let Some((wear, at, pace)) = self.later {
            severity[wear as usize] = pace * (path - at).max(0.0);
        }
        ValveState { severity, ..ValveState::HEALTHY }
    }

    /// Where a stroke of a valve whose healthy times are off by some factors crosses its limit, if it does so soon enough.
    fn end(&self, world: &dyn World, offset: [f64; 2], largest: f64) -> Option<f64> {
        let over = |path: f64| {
            let times = world.times_s(&self.state(path));
            (0..2).any(|i| times[i].is_none_or(|time| time * offset[i] > world.limits_s()[i]))
        };
        over(largest).then(|| crossing(over, largest))
    }
}

impl Life {
    pub(crate) fn draw(world: &dyn World, scenario: &Scenario, noise_sd_s: f64, seed: u64) -> Self {
        let name = scenario.name.bytes().fold(7_u64, |hash, byte| hash.wrapping_mul(131).wrapping_add(u64::from(byte)));
        let mut noise = NoiseSource::new(seed, name ^ noise_sd_s.to_bits());
        let path = Path::draw(scenario.growth, &mut noise, scenario.healthy_cycles);
        let healthy = scenario.healthy_cycles > 0;
        let course = course(world, scenario, &mut noise);
        let offset = [0, 1].map(|_| 1.0 + scenario.unit_spread * noise.normal());
        let mut path = path;
        let mut later = None;
        if scenario.unit_spread > 0.0 && !healthy {
            // The limit is one of the stroke time, which this valve reaches elsewhere.
            path = path.ending_at(course.end(world, offset, 1.1).unwrap_or(1.1));
        }
        if let Some((wear, at, _)) = course.later {
            let begins = (at * path.end_cycle).ceil();
            path = path.ending_at(course.end(world, offset, LONGEST_TOGETHER).unwrap_or(LONGEST_TOGETHER));
            path.begins = begins;
            later = Some((wear, begins));
        }
        let phase = TAU * noise.uniform();
        let keep = (1.0 - scenario.correlation.powi(2)).sqrt();
        let mut error = [noise.normal(), noise.normal()];
        let mut readings = Vec::with_capacity(path.severity.len());
        let mut over_from = f64::INFINITY;
        for (k, severity) in path.severity.iter().enumerate() {
            let cycle = k as f64;
            let mut state = course.state(*severity);
            match scenario.weather {
                Weather::Steady => {}
                Weather::RandomSupply => state.supply_ratio = 1.0 + RANDOM_SUPPLY * noise.normal().clamp(-3.0, 3.0),
                Weather::SwingingSupply => {
                    let swing = SWING_PA * (TAU * cycle / SWING_CYCLES + phase).sin();
                    state.supply_ratio = 1.0 + swing / world.reference_supply_pa();
                }
                Weather::Season => state.warmer_k = SEASON_K * (TAU * cycle / SEASON_CYCLES + phase).sin(),
            }
            let truth = world.times_s(&state);
            if (0..2).any(|i| truth[i].is_none_or(|time| time * offset[i] > world.limits_s()[i])) {
                over_from = cycle.min(over_from);
            }
            if k > 0 {
                error = error.map(|e| scenario.correlation * e + keep * noise.normal());
            }
            let mut stalled = [false; 2];
            let mut times = [None; 2];
            for stroke in 0..2 {
                let blank = noise.uniform() < scenario.blanks;
                match truth[stroke] {
                    _ if blank => {}
                    None => stalled[stroke] = true,
                    Some(time) => {
                        let read = time * offset[stroke] + noise_sd_s * error[stroke];
                        times[stroke] = Some((read.max(0.0) / WRITTEN_S).round() * WRITTEN_S);
                    }
                }
            }
            readings.push(Reading {
                cycle: k as u64,
                close_time_s: times[0],
                open_time_s: times[1],
                stalled,
                supply_pressure_pa: (matches!(scenario.weather, Weather::RandomSupply | Weather::SwingingSupply))
                    .then(|| state.supply_ratio * world.reference_supply_pa()),
                temperature_k: (scenario.weather == Weather::Season)
                    .then(|| world.reference_temperature_k() + state.warmer_k),
            });
        }
        let mut wear = Vec::new();
        if !healthy {
            let last = course.state(1.0).severity;
            wear.extend(Wear::ALL.into_iter().filter(|wear| last[*wear as usize] > 0.0));
        }
        Self {
            readings,
            severity: path.severity,
            over_from,
            end_cycle: path.end_cycle,
            begins: path.begins,
            wear,
            later,
        }
    }
}

/// What wears, and how much of it.
fn course(world: &dyn World, scenario: &Scenario, noise: &mut NoiseSource) -> Course {
    let mut share = [0.0; Wear::ALL.len()];
    let count = scenario.wear.len() as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place in a short list")]
    let place = (noise.uniform() * count).floor() as usize;
    let drawn = scenario.wear[place.min(scenario.wear.len() - 1)];
    if !scenario.together && !scenario.later {
        share[drawn as usize] = 1.0;
        return Course { share, later: None };
    }
    let mut between = |[low, high]: [f64; 2]| low + (high - low) * noise.uniform();
    // What hides the other for too long is drawn anew.
    loop {
        if scenario.later {
            share[drawn as usize] = 1.0;
            let second = scenario.wear.iter().copied().find(|wear| *wear != drawn).unwrap_or(drawn);
            let course = Course { share, later: Some((second, between(SECOND_AT), between(LN_SECOND_PACE).exp())) };
            let end = course.end(world, [1.0; 2], LONGEST_TOGETHER);
            if end.is_some_and(|end| course.state(end).severity[second as usize] < LONGEST_TOGETHER) {
                return course;
            }
            continue;
        }
        for wear in scenario.wear {
            share[*wear as usize] = if *wear == drawn { 1.0 } else { between(LESSER_LEAK) };
        }
        // Together they reach a limit elsewhere than each alone.
        let course = Course { share, later: None };
        if let Some(scale) = course.end(world, [1.0; 2], LONGEST_TOGETHER) {
            return Course { share: share.map(|part| part * scale), later: None };
        }
    }
}

/// The smallest number at which something is over, by halving.
fn crossing(over: impl Fn(f64) -> bool, largest: f64) -> f64 {
    let (mut low, mut high) = (0.0, largest);
    for _ in 0..40 {
        let middle = f64::midpoint(low, high);
        if over(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}
