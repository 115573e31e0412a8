//! From estimates to what goes out.

use leak_table::{BundleEntry, Condition, Stroke, TableBundle, mm2_from_m2};

use crate::bayes::{BayesConfig, BayesEstimate, Change, StartPrior};
use crate::fault_call::FaultCall;
use crate::notice::Notice;
use crate::ols::OlsEstimate;
use crate::reading::Reading;
use crate::record::{Prognosis, Status};

/// Probability of being a proper reading below which a timing is called a
/// outlier.
const OUTLIER_BELOW: f64 = 0.05;
/// Probability from which on wear can be told from none.
const SEEN: f64 = 0.8;
/// Probability up to which two leaks are not spoken of where one is named.
const HARDLY_BOTH: f64 = 0.1;
/// Most faults that are named together.
const LARGEST_GROUP: usize = 3;
/// Standard deviations by which a time may lie outside the tables as noise.
const OUTSIDE_FROM: f64 = 5.0;
/// Share of the hypotheses of growth from which on one is worth a word.
const MOSTLY: f64 = 0.5;
/// Share from which on it is said in so many words, once.
const SURELY: f64 = 0.95;
/// Share of the likeliest fault from which on others beside it are only not ruled out.
const LIKELY: f64 = 0.95;
/// A healthy time that is off by less than this share is not worth a word.
const SMALLEST_OFFSET: f64 = 0.01;
/// Standard deviations from which on it is believed.
const OFFSET_SIGMAS: f64 = 4.0;
/// Readings before it is: fewer do not tell an offset from early wear.
const OFFSET_READINGS: u64 = 10;
/// Standard deviations of healthy times from valve to valve, of those that differ most, beyond which a valve is none of them.
const FAR_SIGMAS: f64 = 2.0;
/// By how much a reading must count less for it to be said that noise goes on.
const CORRELATED_FROM: f64 = 3.0;

/// Notes strokes that did not finish or took too long; whether one of them
/// would mean end of life if it is no outlier.
pub(crate) fn limits(tables: &TableBundle, reading: &Reading, notices: &mut Vec<Notice>) -> [bool; 2] {
    Stroke::ALL.map(|stroke| {
        let limit_s = tables.manifest().limits.within_s(stroke);
        match reading.time_s(stroke) {
            None if reading.stalled[stroke as usize] => {
                notices.push(Notice::NotFinished { stroke });
                true
            }
            Some(time) if time > limit_s => {
                notices.push(Notice::AboveLimit { stroke, limit_s });
                true
            }
            _ => false,
        }
    })
}

/// Notes what the estimator found odd about a row.
pub(crate) fn remark(tables: &TableBundle, reading: &Reading, estimate: &BayesEstimate, notices: &mut Vec<Notice>) {
    for (i, stroke) in Stroke::ALL.into_iter().enumerate() {
        let Some(time) = reading.time_s(stroke) else {
            continue;
        };
        let margin = OUTSIDE_FROM * estimate.noise_sd_s;
        let span = |entry: BundleEntry| {
            let (a, b) = entry.table.curve(stroke).end_times_s();
            (a.min(b), a.max(b))
        };
        // Most times lie within the first table.
        let inside = |entry| (span(entry).0 - margin..=span(entry).1 + margin).contains(&time);
        if !inside(tables.entry(0)) {
            let spans = tables.entries().map(span);
            let (shortest_s, longest_s) =
                spans.fold((f64::INFINITY, f64::NEG_INFINITY), |all, one| (all.0.min(one.0), all.1.max(one.1)));
            if time < shortest_s - margin || time > longest_s + margin {
                notices.push(Notice::OutsideTables { stroke, found_s: time, shortest_s, longest_s });
            }
        }
        if estimate.inlier[i] < OUTLIER_BELOW
            && let Some(residual_s) = estimate.residual_s[i]
        {
            notices.push(Notice::Glitch { stroke, residual_s });
        }
    }
    notices.extend(estimate.change.map(|change| match change {
        Change::Repaired => Notice::Repaired,
        Change::Stepped => Notice::GrowthChanged,
        Change::Anew => Notice::BegunAnew,
        Change::AsBefore => Notice::AsBefore,
    }));
}

/// Whether a row is off in every stroke that it tells.
pub(crate) fn is_off(reading: &Reading, estimate: &BayesEstimate) -> bool {
    let mut told = Stroke::ALL.into_iter().filter(|stroke| reading.time_s(*stroke).is_some()).peekable();
    let is_outlier = |stroke: Stroke| estimate.inlier[stroke as usize] < OUTLIER_BELOW;
    told.peek().is_some() && told.all(is_outlier)
}

/// How far the times of a row are on the way from those of a healthy valve to their limits, of the stroke that is farther.
pub(crate) fn way_to_limit(tables: &TableBundle, reading: &Reading) -> f64 {
    let way = |stroke: Stroke| {
        let healthy_s = tables.entry(0).table.points().first()?.time_s(stroke)?;
        let limit_s = tables.manifest().limits.within_s(stroke);
        Some((reading.time_s(stroke)? - healthy_s) / (limit_s - healthy_s))
    };
    Stroke::ALL.into_iter().filter_map(way).fold(0.0, f64::max)
}

/// What is said once of a valve, as far as it holds now.
pub(crate) fn findings(
    tables: &TableBundle,
    reading: &Reading,
    estimate: &BayesEstimate,
    one: &Prognosis,
    config: &BayesConfig,
) -> Vec<Notice> {
    let begins_healthy = config.start == StartPrior::Healthy;
    let mut found = Vec::new();
    if one.fault.wears() && estimate.curved > SURELY {
        found.push(Notice::GrowthCurved);
    }
    if one.fault.wears() && estimate.resting > SURELY {
        found.push(Notice::GrowthRests);
    }
    if one.fault == FaultCall::Other {
        found.push(Notice::Unexplained);
    }
    for (stroke, (share, sd)) in Stroke::ALL.into_iter().zip(estimate.unit) {
        if tells_offset(estimate, config, one.fault) && off(share, sd) {
            found.push(Notice::Offset { stroke, share, begins_healthy });
        }
    }
    if !covered(tables, reading) {
        found.push(Notice::ConditionsNotCovered);
    }
    found
}

fn off(share: f64, sd: f64) -> bool {
    share.abs() > SMALLEST_OFFSET.max(OFFSET_SIGMAS * sd)
}

/// Whether a healthy time is so far from the tables' that hardly any sister of their valve has it: that nothing has changed since is no
/// reason to call the valve healthy.
pub(crate) fn is_far_off(estimate: &BayesEstimate, config: &BayesConfig) -> bool {
    let believed = FAR_SIGMAS * config.unit_sd.max(config.unit_far_sd);
    estimate.unit.iter().any(|(share, sd)| off(*share, *sd) && share.abs() > believed)
}

/// Whether an offset is told: once it is known, or where nothing seems to wear for want of a valve like this one.
fn tells_offset(estimate: &BayesEstimate, config: &BayesConfig, fault: FaultCall) -> bool {
    let is_known = estimate.readings >= OFFSET_READINGS && fault != FaultCall::Other;
    is_known || fault == FaultCall::None && is_far_off(estimate, config)
}

/// Whether the tables cover the conditions that a row states.
fn covered(tables: &TableBundle, reading: &Reading) -> bool {
    let stated =
        [(Condition::SupplyPressure, reading.supply_pressure_pa), (Condition::Temperature, reading.temperature_k)];
    stated.into_iter().all(|(condition, value)| {
        let Some(value) = value else { return true };
        tables.condition_range().is_some_and(|range| {
            let (low, high) = range.get(condition);
            low <= value && value <= high
        })
    })
}

pub(crate) fn blank(name: &str, cycle: u64) -> Prognosis {
    Prognosis {
        valve: name.to_owned(),
        cycle,
        time: None,
        fault: FaultCall::Undecided,
        fault_probability: None,
        leak_area_mm2: None,
        leak_rate_mm2_per_cycle: None,
        severity: None,
        eol_cycle: None,
        rul_cycles: None,
        rul_p05: None,
        rul_p50: None,
        rul_p95: None,
        replace_by_cycle: None,
        eol_time: None,
        replace_by: None,
        fault_group: Vec::new(),
        caveat: None,
        status: Status::Unknown,
        noise_s: None,
        notices: Vec::new(),
    }
}

/// The fault to name, and the group it stands for if it cannot be told from
/// others.
pub(crate) fn named(estimate: &BayesEstimate, config: &BayesConfig) -> (FaultCall, Vec<FaultCall>) {
    let probability = &estimate.probability;
    if probability.none >= config.healthy_from {
        return (FaultCall::None, Vec::new());
    }
    // Where noise goes on, how far it goes is uncertain too, and an excursion of
    // it looks like wear for a while.
    let name_from = 1.0 - (1.0 - config.name_from) / estimate.doubt.powi(2);
    // That something wears, but hardly any of it, is as likely a healthy valve whose noise is not as assumed.
    if estimate.seen < SEEN {
        return (FaultCall::Undecided, Vec::new());
    }
    let mut ranked = probability.ranked();
    // One leak is two of which one is nothing: that much is no reason to speak of two.
    let both = ranked.iter().position(|(fault, _)| *fault == FaultCall::BothLeaks);
    if let Some(both) = both.filter(|place| *place > 0 && ranked[*place].1 < HARDLY_BOTH)
        && ranked[0].0.fault().is_some()
    {
        ranked[0].1 += ranked[both].1;
        ranked.remove(both);
    }
    let mut sum = 0.0;
    for (count, (_, share)) in ranked.iter().enumerate().take(LARGEST_GROUP) {
        sum += share;
        if sum >= name_from {
            let group =
                if count == 0 { Vec::new() } else { ranked[..=count].iter().map(|(fault, _)| *fault).collect() };
            return (ranked[0].0, group);
        }
    }
    (FaultCall::Undecided, Vec::new())
}

/// What a number with so many decimals is a whole multiple of one over.
const SCALES: [f64; 10] = [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9];

/// Rounds to a number of decimals: no more is meant, and it is quicker to write.
fn rounded(value: f64, decimals: usize) -> f64 {
    let scaled = value * SCALES[decimals];
    if scaled.is_nan() || scaled.abs() >= 4e15 {
        return value;
    }
    #[expect(clippy::cast_possible_truncation, reason = "below 2^52")]
    let whole = (scaled.abs() + 0.5) as i64 as f64;
    whole.copysign(value) / SCALES[decimals]
}

pub(crate) fn from_bayes(
    name: &str,
    tables: &TableBundle,
    reading: &Reading,
    estimate: &BayesEstimate,
    config: &BayesConfig,
) -> Prognosis {
    let (fault, fault_group) = named(estimate, config);
    let mut prognosis = blank(name, reading.cycle);
    prognosis.fault = fault;
    prognosis.fault_group = fault_group;
    prognosis.fault_probability = Some(estimate.probability.map(|share| rounded(share, 9)));
    prognosis.noise_s = Some(rounded(estimate.noise_sd_s, 7));
    prognosis.caveat = caveat(tables, reading, estimate, &prognosis, config);
    if fault == FaultCall::None {
        return prognosis;
    }
    prognosis.severity = Some(rounded(estimate.severity, 6));
    if let Some(leak) = estimate.leading.fault() {
        let limit_mm2 = mm2_from_m2(tables.limit_area_m2(leak));
        prognosis.leak_area_mm2 = Some(rounded(estimate.severity * limit_mm2, 9));
        prognosis.leak_rate_mm2_per_cycle = Some(rounded(estimate.growth * limit_mm2, 9));
    }
    let Some(end) = estimate.end else { return prognosis };
    let remaining = |eol: f64| rounded((eol - reading.cycle as f64).max(0.0), 4);
    prognosis.eol_cycle = Some(rounded(end.cycle, 4));
    prognosis.rul_cycles = Some(remaining(end.cycle));
    prognosis.rul_p05 = Some(remaining(end.quantiles.p05));
    prognosis.rul_p50 = Some(remaining(end.quantiles.p50));
    prognosis.rul_p95 = Some(remaining(end.quantiles.p95));
    if fault.wears() {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "cycles not below zero")]
        let by = end.at_risk.max(0.0).floor() as u64;
        prognosis.replace_by_cycle = Some(by);
    }
    prognosis
}

/// Of a valve of which nothing can be named yet so many faults are told, each from this probability on.
const UNDECIDED_BETWEEN: usize = 3;
const WORTH_NAMING: f64 = 0.05;

/// What to be careful about, in words; the weightiest first.
fn caveat(
    tables: &TableBundle,
    reading: &Reading,
    estimate: &BayesEstimate,
    one: &Prognosis,
    config: &BayesConfig,
) -> Option<String> {
    let mut parts: Vec<String> = Vec::new();
    if one.fault == FaultCall::None && is_far_off(estimate, config) {
        parts.push("worn when the log began, or not the valve of the tables".to_owned());
    }
    if let [first, others @ ..] = one.fault_group.as_slice() {
        let others = others.iter().map(|fault| fault.name()).collect::<Vec<_>>().join(" or ");
        let share = estimate.probability.ranked().first().map_or(0.0, |(_, share)| *share);
        parts.push(if share >= LIKELY {
            format!("{others} not quite ruled out")
        } else {
            format!("{} cannot be told from {others}", first.name())
        });
    }
    if one.fault == FaultCall::Undecided && one.fault_group.is_empty() {
        let mut ranked = estimate.probability.ranked();
        ranked.push((FaultCall::None, estimate.probability.none));
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        let likely = ranked.iter().take(UNDECIDED_BETWEEN).filter(|(_, share)| *share >= WORTH_NAMING);
        let likely: Vec<String> =
            likely.map(|(fault, share)| format!("{} {:.0} %", fault.name(), 100.0 * share)).collect();
        if !likely.is_empty() {
            parts.push(format!("so far {}", likely.join(", ")));
        }
    }
    if one.fault == FaultCall::Other {
        parts.push("no table explains these times; the end is where they would go on to".to_owned());
    }
    if one.fault.wears() {
        let words = [
            (estimate.resting, "growth rests; when it goes on is a guess"),
            (estimate.rough, "growth varies from cycle to cycle"),
            (estimate.curved, "growth is not steady"),
        ];
        parts.extend(words.into_iter().filter(|(share, _)| *share > MOSTLY).map(|(_, words)| words.to_owned()));
    }
    if tells_offset(estimate, config, one.fault) {
        for (stroke, (share, sd)) in Stroke::ALL.into_iter().zip(estimate.unit) {
            if off(share, sd) {
                parts.push(format!("{stroke} time {:+.1} % off the tables", 100.0 * share));
            }
        }
    }
    if estimate.inflation > CORRELATED_FROM {
        parts.push("noise goes on from cycle to cycle".to_owned());
    }
    if !covered(tables, reading) {
        parts.push("conditions not corrected for".to_owned());
    }
    (!parts.is_empty()).then(|| parts.join("; "))
}

pub(crate) fn from_ols(name: &str, reading: &Reading, estimate: &OlsEstimate) -> Prognosis {
    let mut prognosis = blank(name, reading.cycle);
    let Some(fault) = estimate.fault else {
        return prognosis;
    };
    prognosis.fault = fault.into();
    prognosis.leak_area_mm2 = estimate.leak_area_m2.map(mm2_from_m2);
    prognosis.leak_rate_mm2_per_cycle = estimate.leak_rate_m2.map(mm2_from_m2);
    prognosis.eol_cycle = estimate.eol_cycle;
    prognosis.rul_cycles = estimate.rul_cycles;
    prognosis
}

#[cfg(test)]
mod tests {
    use super::rounded;

    #[test]
    fn rounded_is_to_the_nearest_of_so_many_decimals() {
        for i in -4_000..4_000 {
            let value = f64::from(i) * 0.173_21 + 1e-7;
            assert_eq!(rounded(value, 4), (value * 1e4).round() / 1e4, "{value}");
        }
        assert_eq!(rounded(-0.000_04, 4), 0.0);
        assert_eq!(rounded(1e300, 9), 1e300);
        assert_eq!(rounded(f64::INFINITY, 4), f64::INFINITY);
        assert!(rounded(f64::NAN, 4).is_nan());
    }
}
