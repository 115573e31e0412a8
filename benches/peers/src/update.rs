//! A reading in, the end of life out: the prognoser's estimate beside a particle filter, over whole lives.

use std::hint::black_box;

use leak_table::{Fault, Stroke, TableBundle};
use prognoser::bayes::{BayesConfig, BayesEstimator, Noise};
use prognoser::study::NoiseSource;
use prognoser::{OlsEstimator, Reading};

use crate::filter::{End, Filter, Settings};
use crate::markdown::{Table, figures, percent, time};
use crate::pace::{Call, by_turns, median};
use crate::reference_valve::{spread, tables};

/// Lives of valves with a leak to atmosphere that grows by the same area every cycle.
const LIVES: usize = 100;
/// Their shortest and longest, cycles; between them as likely at any order of size.
const ENDS: (f64, f64) = (15.0, 60.0);
/// Noise of the timings, s.
const NOISE_S: f64 = 0.01;
/// The first cycle whose prediction counts, as in the studies of the prognoser.
const FIRST: usize = 2;
/// As many as in the older work's kind of filter.
const PARTICLES: usize = 1000;
/// Random walks of the growth that the filter is tried with; the one with which it is most accurate counts.
const WALKS: [f64; 6] = [0.0, 0.001, 0.003, 0.01, 0.03, 0.1];

struct Life {
    end_cycle: f64,
    readings: Vec<Reading>,
}

/// Lives with the table's times and noise.
fn lives(tables: &TableBundle) -> Vec<Life> {
    let table = tables.table(Fault::Atmosphere);
    let limit_m2 = tables.limit_area_m2(Fault::Atmosphere);
    let life = |(index, u): (usize, f64)| {
        let end_cycle = ENDS.0 * (ENDS.1 / ENDS.0).powf(u);
        let mut noise = NoiseSource::new(index as u64, 0);
        let mut time = |stroke: Stroke, share: f64| {
            Some(table.curve(stroke).extrapolated_time_and_slope(share * limit_m2).0 + NOISE_S * noise.normal())
        };
        let cycles = (0_u32..).take_while(|cycle| f64::from(*cycle) < end_cycle);
        let readings = cycles.map(|cycle| {
            let share = f64::from(cycle) / end_cycle;
            Reading {
                cycle: u64::from(cycle),
                close_time_s: time(Stroke::Close, share),
                open_time_s: time(Stroke::Open, share),
                ..Reading::default()
            }
        });
        Life { end_cycle, readings: readings.collect() }
    };
    spread(LIVES, 0.4).enumerate().map(life).collect()
}

/// One life seen by one method: the end after each reading, where it tells one.
type Seen<'a> = dyn Fn(u64, &Life) -> Vec<Option<End>> + 'a;

/// What predictions are worth.
struct Worth {
    /// Relative accuracy of a life: the median over lives, and what nine in ten exceed.
    accuracy: f64,
    accuracy_p10: f64,
    /// Share of predictions whose 90 % interval holds the end.
    coverage: f64,
}

fn worth(lives: &[Life], seen: &Seen<'_>) -> Worth {
    let (mut accuracies, mut held, mut count) = (Vec::new(), 0.0, 0.0);
    for (seed, life) in lives.iter().enumerate() {
        let ends = seen(seed as u64, life);
        let counted = &ends[FIRST.min(ends.len())..];
        let accuracy = counted.iter().enumerate().map(|(index, end)| {
            let remaining = life.end_cycle - (FIRST + index) as f64;
            let told = |end: &End| (end.median - (FIRST + index) as f64).max(0.0);
            end.map_or(0.0, |end| (1.0 - (remaining - told(&end)).abs() / remaining).max(0.0))
        });
        accuracies.push(accuracy.sum::<f64>() / counted.len() as f64);
        let holds = |end: &&Option<End>| end.is_some_and(|end| end.p05 <= life.end_cycle && life.end_cycle <= end.p95);
        held += counted.iter().filter(holds).count() as f64;
        count += counted.len() as f64;
    }
    accuracies.sort_by(f64::total_cmp);
    Worth { accuracy_p10: accuracies[LIVES / 10], accuracy: median(accuracies), coverage: held / count }
}

fn prognoser_seen(tables: &TableBundle, config: &BayesConfig, life: &Life) -> Vec<Option<End>> {
    let mut estimator = BayesEstimator::new(config);
    let end = |reading| {
        let end = estimator.update(tables, reading).end?;
        Some(End { median: end.cycle, p05: end.quantiles.p05, p95: end.quantiles.p95 })
    };
    life.readings.iter().map(end).collect()
}

fn least_squares_seen(tables: &TableBundle, life: &Life) -> Vec<Option<End>> {
    let mut estimator = OlsEstimator::new();
    let end = |reading| {
        let cycle = estimator.update(tables, reading).eol_cycle?;
        Some(End { median: cycle, p05: cycle, p95: cycle })
    };
    life.readings.iter().map(end).collect()
}

fn filter_seen(tables: &TableBundle, settings: &Settings, seed: u64, life: &Life) -> Vec<Option<End>> {
    let mut filter = Filter::new(settings, tables, seed);
    life.readings.iter().map(|reading| Some(filter.update(reading))).collect()
}

/// The filter with the random walk that suits these lives best.
fn best_filter(tables: &TableBundle, lives: &[Life], strokes: &'static [Stroke], walks_on: bool) -> Settings {
    let config = BayesConfig::default();
    let with = |walk: f64| Settings {
        particles: PARTICLES,
        noise_s: NOISE_S,
        strokes,
        life: (config.life_median_cycles, config.life_ln_sd),
        walk,
        walks_on,
    };
    let accuracy = |settings: &Settings| worth(lives, &|seed, life| filter_seen(tables, settings, seed, life)).accuracy;
    let tried = WALKS.map(|walk| (with(walk), accuracy(&with(walk))));
    let [first, others @ ..] = tried;
    others.into_iter().fold(first, |best, other| if other.1 > best.1 { other } else { best }).0
}

/// All methods on all lives.
pub fn compare() {
    let tables = tables();
    let lives = lives(&tables);
    let filters = [
        ("closing times, straight on to the limit", best_filter(&tables, &lives, &[Stroke::Close], false)),
        ("closing times, cycle by cycle to the limit", best_filter(&tables, &lives, &[Stroke::Close], true)),
        ("both times, straight on to the limit", best_filter(&tables, &lives, &Stroke::ALL, false)),
    ];
    let config = BayesConfig::default();
    let told = BayesConfig { noise: Noise::Known { sd_s: NOISE_S }, ..config };
    let tables = &tables;
    let mut methods: Vec<(String, Box<Seen<'_>>)> = vec![
        ("prognoser, Bayes".to_owned(), Box::new(|_, life| prognoser_seen(tables, &config, life))),
        ("prognoser, Bayes, told the noise".to_owned(), Box::new(|_, life| prognoser_seen(tables, &told, life))),
        ("prognoser, least squares".to_owned(), Box::new(|_, life| least_squares_seen(tables, life))),
    ];
    for (how, settings) in &filters {
        let name = format!("{PARTICLES} particles, {how} (walk {})", settings.walk);
        methods.push((name, Box::new(move |seed, life| filter_seen(tables, settings, seed, life))));
    }
    let worths: Vec<Worth> = methods.iter().map(|(_, seen)| worth(&lives, seen)).collect();
    // One life in ten is timed: so many turns of the filter with all of them would take minutes.
    let timed: Vec<&Life> = lives.iter().step_by(10).collect();
    let updates: usize = timed.iter().map(|life| life.readings.len()).sum();
    let call = |seen: &'_ Seen<'_>| timed.iter().for_each(|life| drop(black_box(seen(0, life))));
    let mut calls: Vec<Call<'_>> = Vec::new();
    for (_, seen) in &methods {
        let call = &call;
        calls.push(Box::new(move || call(seen)));
    }
    let paces = by_turns(&mut calls);
    let rows = methods.iter().zip(&worths).zip(&paces).map(|(((name, seen), worth), pace)| {
        let has_interval = seen(0, &lives[0]).iter().flatten().any(|end| end.p05 < end.p95);
        vec![
            name.clone(),
            time(pace.call_s / updates as f64),
            format!("{} times", figures(pace.to_first)),
            percent(worth.accuracy),
            percent(worth.accuracy_p10),
            if has_interval { percent(worth.coverage) } else { "-".to_owned() },
        ]
    });
    Table {
        title: "An update of the remaining life".to_owned(),
        about: format!(
            "{LIVES} lives of {} to {} cycles, both times with noise of {:.0} ms. The filter is told the fault, the noise \
             and that growth is steady, and has the random walk of {} with which it is most accurate on these very lives; \
             the prognoser has to find all that.",
            ENDS.0,
            ENDS.1,
            1e3 * NOISE_S,
            WALKS.len()
        ),
        head: vec![
            "by",
            "time an update",
            "as long as Bayes",
            "relative accuracy, median",
            "exceeded by nine in ten",
            "90 % interval holds",
        ],
        rows: rows.collect(),
    }
    .print();
}
