//! Where the model fails first, by how much and under which conditions, in numbers and in words.

use std::fmt::Write;

use valve_model::Conditions;

use super::Comparison;
use super::phases::{LEVELS, Phase};
use super::runs::{RunComparison, StrokeComparison};
use super::trend::{Condition, Trend, trends};
use crate::crossing::Direction;

/// Time errors below this are not worth a word, s.
const LEAST_ERROR_S: f64 = 1e-3;

/// An error is seen when it is this many of its standard errors.
const SEEN_SIGMAS: f64 = 3.5;

/// A trend is clear when it is this many of its standard errors, and this share of the error itself.
const TREND_SIGMAS: f64 = 2.5;
const TREND_SHARE: f64 = 0.3;

/// A phase is named beside a worse one of the same stroke from this share of its error.
const WORTH_NAMING: f64 = 0.25;

/// The time error of one phase (or of whole strokes) of one direction over all runs.
#[derive(Debug, Clone)]
pub struct PhaseError {
    /// Which way.
    pub direction: Direction,
    /// The phase; nothing: the whole stroke up to the limit switch.
    pub phase: Option<Phase>,
    /// Strokes that tell it.
    pub strokes: usize,
    /// Mean over strokes of measured minus simulated duration, s.
    pub mean_s: f64,
    /// Root mean square over strokes, s.
    pub rms_s: f64,
    /// Standard error of one stroke's error: sensor noise and stroke-to-stroke variability, s.
    pub standard_error_s: f64,
    /// How it changes with the conditions.
    pub trends: Vec<Trend>,
}

impl PhaseError {
    /// Whether it stands out from noise and variability.
    pub fn is_seen(&self) -> bool {
        // The mean of many strokes shows less than their root mean square.
        let mean_error = self.standard_error_s / (self.strokes.max(1) as f64).sqrt();
        self.rms_s > LEAST_ERROR_S
            && (self.rms_s > SEEN_SIGMAS * self.standard_error_s || self.mean_s.abs() > SEEN_SIGMAS * mean_error)
    }

    /// The trends that stand out.
    pub fn clear_trends(&self) -> impl Iterator<Item = &Trend> {
        self.trends.iter().filter(|trend| {
            trend.change.abs() > (TREND_SIGMAS * trend.standard_error).max(TREND_SHARE * self.rms_s).max(LEAST_ERROR_S)
        })
    }
}

/// What the model gets wrong in one direction.
#[derive(Debug, Clone)]
pub struct Finding {
    /// Which way.
    pub direction: Direction,
    /// The first phase that fails; nothing for stroke times without traces.
    pub phase: Option<Phase>,
    /// Its mean time error, measured minus simulated, s.
    pub time_error_s: f64,
    /// Root mean square of that error over the strokes, s.
    pub rms_s: f64,
    /// Conditions with which it changes, and by how much over the range tested, s.
    pub conditions: Vec<(Condition, f64)>,
    /// Where in the stroke, m, if the travel fails in one place.
    pub between_m: Option<(f64, f64)>,
    /// The finding as a sentence.
    pub words: String,
}

/// The time errors of all phases over the runs.
pub(super) fn phase_errors(runs: &[RunComparison]) -> Vec<PhaseError> {
    let phases = [None].into_iter().chain(Phase::ALL.into_iter().map(Some));
    Direction::ALL
        .into_iter()
        .flat_map(|direction| phases.clone().map(move |phase| (direction, phase)))
        .filter_map(|(direction, phase)| phase_error(runs, direction, phase))
        .collect()
}

fn stroke_error(stroke: &StrokeComparison, phase: Option<Phase>) -> Option<(f64, f64)> {
    match phase {
        Some(phase) => stroke.phase_time_error(phase),
        None => Some((stroke.time_error_s()?, stroke.levels.last()?.standard_error_s)),
    }
}

fn phase_error(runs: &[RunComparison], direction: Direction, phase: Option<Phase>) -> Option<PhaseError> {
    let mut errors: Vec<(Conditions, f64, f64)> = runs
        .iter()
        .flat_map(|run| run.strokes.iter().map(move |stroke| (run.conditions, stroke)))
        .filter(|(_, stroke)| stroke.window.direction == direction)
        .filter_map(|(conditions, stroke)| {
            let (error, standard_error) = stroke_error(stroke, phase)?;
            Some((conditions, error, standard_error))
        })
        .collect();
    if errors.is_empty() {
        return None;
    }
    let variability = replicate_variance(&errors);
    for (_, _, standard_error) in &mut errors {
        *standard_error = (*standard_error * *standard_error + variability).sqrt();
    }
    let count = errors.len() as f64;
    let mean = |value: &dyn Fn(&(Conditions, f64, f64)) -> f64| errors.iter().map(value).sum::<f64>() / count;
    Some(PhaseError {
        direction,
        phase,
        strokes: errors.len(),
        mean_s: mean(&|error| error.1),
        rms_s: mean(&|error| error.1 * error.1).sqrt(),
        standard_error_s: mean(&|error| error.2 * error.2).sqrt(),
        trends: trends(&errors),
    })
}

/// Variance of an error between strokes under the same conditions beyond what the sensor explains.
fn replicate_variance(errors: &[(Conditions, f64, f64)]) -> f64 {
    let (mut sum, mut freedom, mut noise) = (0.0, 0.0, 0.0);
    for (index, (conditions, _, _)) in errors.iter().enumerate() {
        if errors[..index].iter().any(|(other, _, _)| other == conditions) {
            continue;
        }
        let group: Vec<&(Conditions, f64, f64)> = errors.iter().filter(|error| error.0 == *conditions).collect();
        if group.len() > 1 {
            let mean = group.iter().map(|error| error.1).sum::<f64>() / group.len() as f64;
            let degrees = group.len() as f64 - 1.0;
            sum += group.iter().map(|error| (error.1 - mean).powi(2)).sum::<f64>();
            noise += degrees / group.len() as f64 * group.iter().map(|error| error.2 * error.2).sum::<f64>();
            freedom += degrees;
        }
    }
    if freedom > 0.0 { ((sum - noise) / freedom).max(0.0) } else { 0.0 }
}

/// The findings, the worst direction first.
pub(super) fn findings(errors: &[PhaseError], runs: &[RunComparison], stroke_m: f64) -> Vec<Finding> {
    let mut found: Vec<Finding> = Direction::ALL
        .into_iter()
        .filter_map(|direction| {
            let of_direction: Vec<&PhaseError> = errors.iter().filter(|error| error.direction == direction).collect();
            finding(&of_direction, runs, stroke_m)
        })
        .collect();
    found.sort_by(|a, b| b.rms_s.total_cmp(&a.rms_s));
    found
}

fn finding(errors: &[&PhaseError], runs: &[RunComparison], stroke_m: f64) -> Option<Finding> {
    let by_phase: Vec<&PhaseError> = errors.iter().copied().filter(|error| error.phase.is_some()).collect();
    let candidates = if by_phase.is_empty() { errors.to_vec() } else { by_phase };
    let seen: Vec<&PhaseError> = candidates.into_iter().filter(|error| error.is_seen()).collect();
    let largest = seen.iter().map(|error| error.rms_s).fold(0.0, f64::max);
    let named: Vec<&PhaseError> = seen.into_iter().filter(|error| error.rms_s >= WORTH_NAMING * largest).collect();
    let first = *named.first()?;
    let place = |error: &PhaseError| {
        (error.phase == Some(Phase::Travel)).then(|| place_in_travel(runs, error.direction, stroke_m)).flatten()
    };
    let mut words = format!("{}: {}", first.direction.name(), clause(first, place(first)));
    for error in &named[1..] {
        words.push_str(", then ");
        words.push_str(&clause(error, place(error)));
    }
    let ends_right = named.last().is_some_and(|last| last.phase.is_some_and(|phase| phase != Phase::Seating));
    if ends_right {
        words.push_str(", the rest of the stroke is then right");
    }
    // The whole stroke gathers what its phases have in common; its trend is the clearest.
    let source = named.iter().max_by(|a, b| a.rms_s.total_cmp(&b.rms_s)).copied().unwrap_or(first);
    let conditions: Vec<(Condition, f64)> =
        source.clear_trends().map(|trend| (trend.condition, trend.change)).collect();
    for trend in source.clear_trends() {
        let verb = if source.mean_s * trend.change >= 0.0 { "grows" } else { "shrinks" };
        let size = trend.change.abs() * 1e3;
        let condition = trend.condition.words();
        // Writing to a string cannot fail.
        let _ = write!(words, "; {verb} with {condition} (by {size:.0} ms over the range)");
    }
    Some(Finding {
        direction: first.direction,
        phase: first.phase,
        time_error_s: first.mean_s,
        rms_s: source.rms_s,
        conditions,
        between_m: place(first),
        words,
    })
}

fn clause(error: &PhaseError, place_m: Option<(f64, f64)>) -> String {
    let mixed = error.mean_s.abs() < 0.5 * error.rms_s;
    let size = if mixed { error.rms_s } else { error.mean_s.abs() } * 1e3;
    let size = if size < 9.95 { format!("{size:.1} ms") } else { format!("{size:.0} ms") };
    let late = error.mean_s < 0.0;
    let place = place_m.map_or_else(String::new, |(low, high)| {
        format!(", mostly between x = {:.0} and {:.0} mm", low * 1e3, high * 1e3)
    });
    match (error.phase, mixed) {
        (Some(Phase::DeadTime), false) => {
            format!("the model breaks away {size} {}", if late { "late" } else { "early" })
        }
        (Some(Phase::DeadTime), true) => {
            format!("the model breaks away {size} off (rms), early in some runs and late in others")
        }
        (phase, false) => {
            format!("the model takes {size} too {} {}{place}", if late { "long" } else { "short" }, part(phase))
        }
        (phase, true) => {
            format!("the model is {size} off (rms) {}, slow in some runs and fast in others{place}", part(phase))
        }
    }
}

fn part(phase: Option<Phase>) -> &'static str {
    match phase {
        Some(Phase::DeadTime | Phase::Breakaway) => "to get under way (2 to 10 % of the stroke)",
        Some(Phase::Travel) => "to travel (10 to 90 % of the stroke)",
        Some(Phase::Seating) => "to seat (90 to 100 % of the stroke)",
        None => "for the stroke",
    }
}

/// The part of the travel, m from closed, that has most of the time error, if one has.
fn place_in_travel(runs: &[RunComparison], direction: Direction, stroke_m: f64) -> Option<(f64, f64)> {
    // Steps of a tenth of the stroke from 10 to 90 %.
    let mut steps = [0.0_f64; 8];
    for stroke in runs.iter().flat_map(|run| &run.strokes).filter(|stroke| stroke.window.direction == direction) {
        for (step, sum) in steps.iter_mut().enumerate() {
            if let (Some(before), Some(after)) = (stroke.levels[step + 2].error_s(), stroke.levels[step + 3].error_s())
            {
                *sum += (after - before).powi(2);
            }
        }
    }
    let total: f64 = steps.iter().sum();
    let (first, most) =
        (0..6).map(|step| (step, steps[step..step + 3].iter().sum::<f64>())).max_by(|a, b| a.1.total_cmp(&b.1))?;
    if most < 0.8 * total || total <= 0.0 {
        return None;
    }
    let (from, to) = (LEVELS[first + 2] * stroke_m, LEVELS[first + 5] * stroke_m);
    Some(match direction {
        Direction::Closing => (stroke_m - to, stroke_m - from),
        Direction::Opening => (from, to),
    })
}

/// A run is off by itself if its worst stroke time is off by this many times the median of all.
const FAR: f64 = 3.0;

/// The run whose stroke time is off most, if by far: its file, the stroke's direction, and measured minus simulated time, s.
fn farthest(comparison: &Comparison) -> Option<(&str, &'static str, f64)> {
    let strokes = comparison.runs.iter().flat_map(|run| run.strokes.iter().map(move |stroke| (run, stroke)));
    let mut errors: Vec<(&str, &'static str, f64)> = strokes
        .filter_map(|(run, stroke)| Some((run.file.as_str(), stroke.window.direction.name(), stroke.time_error_s()?)))
        .collect();
    errors.sort_by(|a, b| a.2.abs().total_cmp(&b.2.abs()));
    let worst = *errors.last()?;
    let median = errors[errors.len() / 2].2.abs();
    (worst.2.abs() > FAR * median).then_some(worst)
}

/// The findings as sentences.
pub(super) fn words(comparison: &Comparison) -> Vec<String> {
    let mut words: Vec<String> = Direction::ALL
        .into_iter()
        .flat_map(|direction| [true, false].map(|valve| not_both(&comparison.runs, direction, valve)))
        .flatten()
        .collect();
    words.extend(comparison.findings.iter().map(|finding| finding.words.clone()));
    if words.is_empty() {
        let size = comparison.overall.errors.normalised_rms;
        words.push(if size < 1.05 {
            format!("no phase of a stroke is off by more than the noise shows; the error is {size:.3} times the noise")
        } else {
            let alike = "no phase is off alike in all strokes";
            match farthest(comparison) {
                Some((file, direction, error_s)) => format!(
                    "{alike}, but the error is {size:.2} times the noise: {file} is off most, its {direction} time by {:+.1} ms; are its \
                     conditions all stated, such as a leak that was opened on purpose?",
                    1e3 * error_s
                ),
                None => format!("{alike}, but the error is {size:.2} times the noise"),
            }
        });
    }
    words
}

/// Runs that a sentence names.
const NAMED_RUNS: usize = 3;

/// In how many strokes of a direction only the valve gets to the limit, or only the model does, and in which runs; nothing where
/// there is none.
fn not_both(runs: &[RunComparison], direction: Direction, valve: bool) -> Option<String> {
    let of_run = |run: &RunComparison| {
        let strokes = run.strokes.iter().filter(|stroke| stroke.window.direction == direction);
        let is_so = |stroke: &&StrokeComparison| {
            let reached = stroke.levels.last().map(|limit| [limit.measured_s.is_some(), limit.simulated_s.is_some()]);
            reached == Some([valve, !valve])
        };
        [strokes.clone().filter(is_so).count(), strokes.count()]
    };
    let counted: Vec<(&str, [usize; 2])> = runs.iter().map(|run| (run.file.as_str(), of_run(run))).collect();
    let [found, all] = counted.iter().fold([0, 0], |[found, all], (_, [some, of])| [found + some, all + of]);
    if found == 0 {
        return None;
    }
    let what =
        if valve { "the valve gets there, the model does not" } else { "the model gets there, the valve does not" };
    let names: Vec<&str> = counted.iter().filter(|(_, [some, _])| *some > 0).map(|(file, _)| *file).collect();
    let named = names[..names.len().min(NAMED_RUNS)].join(", ");
    let more = match names.len().saturating_sub(NAMED_RUNS) {
        0 => String::new(),
        1 => " and 1 more run".to_owned(),
        more => format!(" and {more} more runs"),
    };
    let strokes = match (found, all) {
        (1, 1) => "the only stroke".to_owned(),
        _ if found == all => format!("all {all} strokes"),
        _ => format!("{found} of {all} strokes"),
    };
    Some(format!("{}: {what}, in {strokes} ({named}{more})", direction.name()))
}
