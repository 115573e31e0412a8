//! The estimate of one valve.

use leak_table::TableBundle;

use super::assimilate::{Observation, PROPER_FROM};
use super::bank::{self, Outcome};
use super::config::{BayesConfig, Noise, StartPrior};
use super::ending::{Block, Ending, LONGEST, Line, Quantiles, waits};
use super::estimate::{BayesEstimate, Change, EndEstimate, FaultProbability, Wanted, fault_call};
use super::hypothesis::{Cause, Hypothesis, Mode, SEEN_FROM};
use super::law::Law;
use super::motion::{drift_turn, unsteadiness};
use super::plant::{CycleConditions, Plant};
use super::rate_prior::{Corrected, NODES, Node, RatePrior};
use super::special::quick_exp;
use super::start;
use super::state::{Baseline, ValveRecord, single};
use super::two_leaks::TwoLeaks;
use super::workspace::Workspace;
use crate::reading::Reading;

/// Shape of the noise's posterior where the noise is known.
const KNOWN_SHAPE: f64 = 1e6;
/// Shape up to which readings are remembered for the noise.
const LARGEST_SHAPE: f64 = 300.0;
/// Share below which a hypothesis does not count for the end of life.
const NEGLIGIBLE: f64 = 1e-3;
/// Logarithm of the weight below which a hypothesis's growth is not looked at.
const LN_IDLE: f64 = -9.0;
/// Shares up to which a hypothesis is told roughly, and less finely.
const SMALL: f64 = 0.03;
const LARGE: f64 = 0.3;
/// Halvings by which the severity of a table at a time is found, to a hundredth of a percent.
const BISECTIONS: usize = 13;
/// Share of the risk that is always left.
const LEAST_RISK: f64 = 0.25;
/// A pace of wear that has turned by this share of itself, one standard deviation, would be negative one time in twenty if it were
/// Gaussian. Wear does not heal little by little: from there on its pace is as unsure as that, and no more, since else half of
/// all such lives would never end.
const LARGEST_TURN: f64 = 1.0 / 1.645;

/// The recursive estimate of one valve.
#[derive(Clone, Debug)]
pub struct BayesEstimator {
    config: BayesConfig,
    record: ValveRecord,
}

impl BayesEstimator {
    /// An estimator that has seen nothing.
    pub fn new(config: &BayesConfig) -> Self {
        Self { config: *config, record: ValveRecord::new(noise_shape(config)) }
    }

    /// Goes on from what was remembered of a valve.
    pub fn resume(config: &BayesConfig, record: ValveRecord) -> Self {
        Self { config: *config, record }
    }

    /// What is remembered.
    pub fn record(&self) -> &ValveRecord {
        &self.record
    }

    /// Takes in one row and gives the estimate after it. Cycles must not fall, and may stay where a row tells the stroke that
    /// the one before did not; sorting out repeats is the caller's work.
    pub fn update(&mut self, tables: &TableBundle, reading: &Reading) -> BayesEstimate {
        self.update_in(&mut Workspace::default(), tables, reading, Wanted::Numbers)
    }

    /// The same in memory that is there.
    pub(crate) fn update_in(
        &mut self,
        workspace: &mut Workspace,
        tables: &TableBundle,
        reading: &Reading,
        wanted: Wanted,
    ) -> BayesEstimate {
        let start = self.config.start;
        self.meet(workspace, tables, reading, wanted, start)
    }

    /// The same, of a valve of whose first reading something is known.
    fn meet(
        &mut self,
        workspace: &mut Workspace,
        tables: &TableBundle,
        reading: &Reading,
        wanted: Wanted,
        start: StartPrior,
    ) -> BayesEstimate {
        let stated =
            CycleConditions { supply_pressure_pa: reading.supply_pressure_pa, temperature_k: reading.temperature_k };
        let plant = Plant::new(tables, stated);
        let config = &self.config;
        let record = &mut self.record;
        let first = record.readings == 0;
        let shape = f64::from(record.shape);
        let Workspace { hypotheses, turning, meeting, .. } = workspace;
        if first {
            let sd = config.noise.expected_sd_s();
            *hypotheses = start::hypotheses(&plant, &BayesConfig { start, ..*config }, shape, shape * sd * sd);
        } else {
            record.unpack(hypotheses);
        }
        let cycles = if first { 0 } else { reading.cycle.saturating_sub(record.cycle) };
        if let Some(longer) = (cycles > 0).then(|| record.pace(cycles)).flatten() {
            for hypothesis in hypotheses.iter_mut() {
                hypothesis.rescale(longer);
            }
        }
        let unit = f64::from(record.unit);
        let weight = 1.0 / f64::from(record.inflation);
        let observed = Observation {
            time_s: [reading.close_time_s, reading.open_time_s],
            stalled: reading.stalled,
            outlier_share: config.outlier_share,
            weight,
            shape,
            ln_idle: LN_IDLE,
        };
        let rates = RatePrior::new(config, unit);
        let outcome = bank::step(
            (hypotheses, turning, meeting),
            &plant,
            config,
            &rates,
            &observed,
            &bank::Past {
                cycles: cycles as f64 / unit,
                readings: record.readings as f64,
                healthy: record.healthy,
                before: record.before,
            },
        );
        if outcome.as_before {
            record.before = None;
        }
        let proper = |stroke: usize| observed.time_s[stroke].is_none() || outcome.update.inlier[stroke] >= PROPER_FROM;
        if record.doubted(proper(0) && proper(1)) {
            *record = record.anew(noise_shape(config));
            let estimate = self.meet(workspace, tables, reading, wanted, StartPrior::Unknown);
            return BayesEstimate { change: Some(Change::Anew), ..estimate };
        }
        let told = observed.time_s.iter().zip(outcome.update.inlier).filter(|(time, _)| time.is_some());
        let gained: f64 = told.map(|(_, inlier)| 0.5 * inlier * weight).sum();
        let grown = shape + gained;
        // A stated noise is not learnt.
        let kept = if matches!(config.noise, Noise::Known { .. }) { shape } else { grown.min(LARGEST_SHAPE) };
        for hypothesis in hypotheses.iter_mut() {
            hypothesis.scale *= kept / grown;
        }
        record.shape = single(kept);
        let shape = f64::from(record.shape);
        for hypothesis in hypotheses.iter_mut() {
            hypothesis.inflate();
            if hypothesis.is_untuned(hypothesis.scale / shape) {
                hypothesis.retune(start::priors(hypothesis, &plant), hypothesis.scale / shape);
            }
        }
        let likeliest = hypotheses.iter().max_by(|a, b| a.ln_weight.total_cmp(&b.ln_weight));
        record.inflation = single(likeliest.map_or(1.0, |hypothesis| hypothesis.inflation));
        record.cycle = reading.cycle;
        record.readings += 1;
        record.keep(hypotheses);
        let estimate = self.estimate(workspace, &plant, &rates, &outcome, reading.cycle as f64, wanted);
        // The risk of a cycle counts once, however many rows tell of it.
        let is_new = first || cycles > 0;
        let soon = estimate.end.filter(|_| is_new).map_or(0.0, |end| end.soon);
        let spent = if estimate.change == Some(Change::Repaired) { 0.0 } else { f64::from(self.record.spent) };
        self.record.spent = single(spent + soon);
        if estimate.probability.none >= self.config.healthy_from {
            let none = workspace.hypotheses.iter().filter(|hypothesis| hypothesis.cause == Cause::None);
            let likeliest = none.max_by(|a, b| a.ln_weight.total_cmp(&b.ln_weight));
            self.record.healthy = likeliest.map(|none| Baseline::of(none, none.scale / shape));
        }
        estimate
    }

    /// What is left of the risk of an end in service, of which every cycle that the valve stayed takes its part.
    fn risk_left(&self) -> f64 {
        (self.config.risk - f64::from(self.record.spent)).max(LEAST_RISK * self.config.risk)
    }

    fn estimate(
        &self,
        Workspace { hypotheses, weights, paces, lines, blocks, .. }: &mut Workspace,
        plant: &Plant,
        prior: &RatePrior,
        outcome: &Outcome,
        cycle: f64,
        wanted: Wanted,
    ) -> BayesEstimate {
        let shape = f64::from(self.record.shape);
        let sigma2 = |hypothesis: &Hypothesis| hypothesis.scale / shape;
        let correct = |hypothesis: &Hypothesis, i: usize| {
            prior.correct(
                hypothesis.mean[i],
                (hypothesis.cov[i][i] * sigma2(hypothesis)).max(0.0).sqrt(),
                hypothesis.mode,
            )
        };
        let hypotheses = hypotheses.as_slice();
        weights.clear();
        paces.clear();
        lines.clear();
        for hypothesis in hypotheses {
            let (factor, pace) = match hypothesis.cause {
                // Too unlikely for its prior to matter.
                _ if hypothesis.ln_weight < LN_IDLE => (0.0, None),
                Cause::None | Cause::Other => (0.0, None),
                Cause::Wear(_) => {
                    let pace = correct(hypothesis, 1);
                    (pace.ln_factor(), Some(pace))
                }
                Cause::Both => {
                    let factor = |i: usize| {
                        let sd = (hypothesis.cov[i][i] * sigma2(hypothesis)).max(0.0).sqrt();
                        prior.correct(hypothesis.mean[i], sd, Mode::Steady).ln_factor()
                    };
                    (factor(2) + factor(3), None)
                }
            };
            weights.push(hypothesis.ln_weight + factor);
            paces.push(pace);
        }
        let top = weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        for weight in weights.iter_mut() {
            *weight = quick_exp(*weight - top);
        }
        let total: f64 = weights.iter().sum();
        let mut probability = FaultProbability::new(plant);
        for (hypothesis, weight) in hypotheses.iter().zip(weights.iter_mut()) {
            *weight /= total;
            probability.add(hypothesis.cause, *weight);
        }
        let (leading, share) = probability.leading();
        let mine = |hypothesis: &Hypothesis| hypothesis.cause == leading;
        let heaviest =
            hypotheses.iter().zip(weights.iter()).max_by(|a, b| a.1.total_cmp(b.1)).map(|(hypothesis, _)| hypothesis);
        let heaviest = heaviest.copied().unwrap_or_else(|| hypotheses[0]);
        let wears = probability.none < self.config.healthy_from;
        let mut estimate = BayesEstimate {
            probability,
            leading: fault_call(leading, plant),
            severity: 0.0,
            growth: 0.0,
            end: None,
            readings: self.record.readings,
            noise_sd_s: sigma2(&heaviest).sqrt(),
            inflation: f64::from(self.record.inflation),
            doubt: heaviest.noise.expected_inflation(),
            unit: [0, 1].map(|stroke| unit(&heaviest, plant, stroke, sigma2(&heaviest))),
            inlier: outcome.update.inlier,
            residual_s: outcome.update.residual_s,
            change: outcome.change(),
            curved: 0.0,
            rough: 0.0,
            resting: 0.0,
            seen: 0.0,
        };
        let wearing = hypotheses.iter().zip(weights.iter()).filter(|(hypothesis, _)| hypothesis.cause != Cause::None);
        let (all, seen) = wearing.fold((0.0, 0.0), |(all, seen), (hypothesis, weight)| {
            (all + weight, if is_seen(hypothesis, sigma2(hypothesis)) { seen + weight } else { seen })
        });
        estimate.seen = seen / all.max(f64::MIN_POSITIVE);
        let named = hypotheses
            .iter()
            .zip(weights.iter())
            .filter(|(hypothesis, _)| mine(hypothesis))
            .max_by(|a, b| a.1.total_cmp(b.1))
            .map_or(Cause::None, |(hypothesis, _)| hypothesis.cause);
        for ((hypothesis, weight), pace) in hypotheses.iter().zip(weights.iter()).zip(paces.iter()) {
            let own = weight / share.max(f64::MIN_POSITIVE);
            // One leak may turn out to be two, and the other way round.
            let leaks = plant.knows_both_leaks() && [hypothesis.cause, named].iter().all(|cause| is_leak(*cause));
            if wears && own > NEGLIGIBLE && (mine(hypothesis) || leaks) {
                let pace = pace.unwrap_or_else(|| correct(hypothesis, 1));
                self.lines(hypothesis, plant, prior, pace, own, lines);
            }
            if !mine(hypothesis) {
                continue;
            }
            let (severity, growth) = severity_of(hypothesis, plant);
            estimate.severity += own * severity;
            estimate.growth += own * growth / f64::from(self.record.unit);
            estimate.curved += if hypothesis.law == Law::Linear { 0.0 } else { own };
            estimate.rough += if matches!(hypothesis.mode, Mode::Rough | Mode::Wander) { own } else { 0.0 };
            estimate.resting += if hypothesis.mode == Mode::Rest { own } else { 0.0 };
        }
        estimate.end = (wears && !lines.is_empty()).then(|| self.end(lines, blocks, cycle, wanted));
        estimate
    }

    /// The end that some lines lead to.
    fn end(&self, lines: &mut Vec<Line>, blocks: &mut Vec<Block>, cycle: f64, wanted: Wanted) -> EndEstimate {
        let ending = Ending::new(lines);
        let unit = f64::from(self.record.unit);
        if let Wanted::Standing(cycles) = wanted
            && let Some((at_least, soon)) =
                ending.standing(self.risk_left(), cycles.map(|cycles| cycles / unit), blocks)
        {
            let at = cycle + at_least * unit;
            return EndEstimate { cycle: at, quantiles: Quantiles { p05: at, p50: at, p95: at }, at_risk: at, soon };
        }
        let (left, soon) = ending.quantiles([0.05, 0.5, 0.95, self.risk_left()], blocks);
        let at = left.map(|left| cycle + left.min(LONGEST) * unit);
        EndEstimate {
            cycle: match ending.best(blocks) {
                0.0 => (cycle - ending.ago() * unit).max(0.0),
                left => cycle + left.min(LONGEST) * unit,
            },
            quantiles: Quantiles { p05: at[0], p50: at[1], p95: at[2] },
            at_risk: at[3],
            soon,
        }
    }

    /// The severity at which the limit is reached under the supply pressure that is expected to be worst.
    fn expected_end(&self, wear: u8, plant: &Plant) -> f64 {
        self.config.expected_supply_pa.map_or(1.0, |range| {
            range.map(|supply_pa| plant.end_at_supply(wear, supply_pa)).into_iter().fold(f64::INFINITY, f64::min)
        })
    }

    /// The ways in which a hypothesis may come to its end.
    fn lines(
        &self,
        hypothesis: &Hypothesis,
        plant: &Plant,
        prior: &RatePrior,
        pace: Corrected,
        weight: f64,
        lines: &mut Vec<Line>,
    ) {
        let sigma2 = hypothesis.scale / f64::from(self.record.shape);
        let wear = match hypothesis.cause {
            Cause::Wear(wear) => wear,
            Cause::Both if plant.knows_both_leaks() => {
                let ends = [0, 1].map(|leak| self.expected_end(leak, plant));
                let two = TwoLeaks { hypothesis, plant, sigma2, ends };
                return two.lines(prior, weight, weight > SMALL, lines);
            }
            Cause::Both => return lines.push(Line { weight, ..crossing(hypothesis, plant, sigma2) }),
            Cause::Other | Cause::None => {
                return drift_lines(hypothesis, plant, sigma2, weight, weight > SMALL, lines);
            }
        };
        let by_unit = plant.end_shift(wear);
        let slope = hypothesis.law.severity(1.0).1;
        let nearer: f64 = (0..2).map(|stroke| hypothesis.mean[2 + stroke] * by_unit[stroke] / slope).sum();
        let nearer = nearer + 1.0 - hypothesis.law.coordinate(self.expected_end(wear, plant));
        let leaps = self.config.growth_prior.leaps;
        let [var_level, cov, var_growth] =
            [hypothesis.cov[0][0], hypothesis.cov[0][1], hypothesis.cov[1][1]].map(|v| v * sigma2);
        let level = hypothesis.mean[0] + nearer;
        let resume = self.config.growth_prior.resume_after(hypothesis.rested);
        let mut add = |line: Line| {
            if hypothesis.mode == Mode::Rest && weight <= SMALL {
                lines.push(Line { rest: 1.0 / resume, ..line });
            } else if hypothesis.mode == Mode::Rest {
                let waits = waits(resume);
                let share = line.weight / waits.len() as f64;
                lines.extend(waits.map(|rest| Line { weight: share, rest, ..line }));
            } else {
                lines.push(line);
            }
        };
        let rough = |growth: f64| if hypothesis.mode == Mode::Rough { (leaps * growth).powi(2) } else { 0.0 };
        let unsteadiness = unsteadiness(hypothesis, &self.config.growth_prior);
        let turns = |growth: f64| (unsteadiness * growth).powi(2);
        let turns_until = if unsteadiness > 0.0 { (LARGEST_TURN / unsteadiness).powi(2) } else { 0.0 };
        match pace {
            Corrected::Narrow { mean, .. } => {
                let level = level + cov / var_growth.max(1e-300) * (mean - hypothesis.mean[1]);
                let rough = rough(mean);
                add(Line {
                    weight,
                    level,
                    growth: mean,
                    var_level,
                    cov,
                    var_growth,
                    rough,
                    turns: turns(mean),
                    turns_until,
                    rest: 0.0,
                });
            }
            Corrected::Wide { nodes, .. } => {
                // Neighbours together, all of them where the hypothesis hardly counts.
                let together = match weight {
                    _ if weight > LARGE => 2,
                    _ if weight > SMALL => 4,
                    _ => NODES,
                };
                for nodes in nodes.chunks(together) {
                    let share: f64 = nodes.iter().map(|node| node.weight).sum();
                    let growth = nodes.iter().map(|node| node.weight * node.growth).sum::<f64>() / share.max(1e-300);
                    let node = Node { growth, weight: share };
                    let along = cov / var_growth;
                    add(Line {
                        weight: weight * node.weight,
                        level: level + along * (node.growth - hypothesis.mean[1]),
                        growth: node.growth,
                        var_level: (var_level - along * cov).max(0.0),
                        cov: 0.0,
                        var_growth: 0.0,
                        rough: rough(node.growth),
                        turns: turns(node.growth),
                        turns_until,
                        rest: 0.0,
                    });
                }
            }
        }
    }
}

fn noise_shape(config: &BayesConfig) -> f64 {
    match config.noise {
        Noise::Known { .. } => KNOWN_SHAPE,
        Noise::Estimated { prior_readings, .. } => 0.5 * prior_readings,
    }
}

/// Relative error of the tables for a valve, with its standard deviation.
fn unit(hypothesis: &Hypothesis, plant: &Plant, stroke: usize, sigma2: f64) -> (f64, f64) {
    let (i, scale) = match hypothesis.cause {
        Cause::None | Cause::Wear(_) => (2 + stroke, 1.0),
        Cause::Both => return (hypothesis.unit[stroke], 0.0),
        Cause::Other => (stroke, 1.0 / plant.healthy_s(stroke)),
    };
    (hypothesis.mean[i] * scale, (hypothesis.cov[i][i] * sigma2).max(0.0).sqrt() * scale)
}

/// Whether what wears is a leak or two.
fn is_leak(cause: Cause) -> bool {
    matches!(cause, Cause::Both | Cause::Wear(0 | 1))
}

/// Whether the wear of a hypothesis can be told from none.
fn is_seen(hypothesis: &Hypothesis, sigma2: f64) -> bool {
    let clear = |i: usize| hypothesis.mean[i].powi(2) > (SEEN_FROM * SEEN_FROM) * hypothesis.cov[i][i] * sigma2;
    match hypothesis.cause {
        Cause::None => false,
        Cause::Wear(_) => clear(0) && hypothesis.mean[0] > 0.0,
        Cause::Both | Cause::Other => clear(0) || clear(1),
    }
}

/// Severity and its growth a cycle under a hypothesis.
fn severity_of(hypothesis: &Hypothesis, plant: &Plant) -> (f64, f64) {
    match hypothesis.cause {
        Cause::None => (0.0, 0.0),
        Cause::Wear(_) => {
            let (severity, slope) = hypothesis.law.severity(hypothesis.mean[0]);
            let grows = if hypothesis.mode == Mode::Rest { 0.0 } else { hypothesis.mean[1] };
            (severity.max(0.0), (slope * grows).max(0.0))
        }
        Cause::Both => {
            (hypothesis.mean[0].max(hypothesis.mean[1]).max(0.0), hypothesis.mean[2].max(hypothesis.mean[3]).max(0.0))
        }
        Cause::Other => {
            let way = |stroke: usize| {
                let room = plant.limit_s(stroke) - plant.healthy_s(stroke);
                (hypothesis.mean[stroke] / room, hypothesis.mean[2 + stroke] / room)
            };
            let (close, open) = (way(0), way(1));
            if close.0 > open.0 { close } else { open }
        }
    }
}

/// The ways of times that drift freely to the limit of the stroke that comes there first; levels are shares of what lies between
/// its healthy time and its limit. Where it is looked at closely, straight on is one way of several: the nearer a stroke is to its
/// end, the more it slows down for the same wear, in each table in another way.
fn drift_lines(hypothesis: &Hypothesis, plant: &Plant, sigma2: f64, weight: f64, closely: bool, lines: &mut Vec<Line>) {
    let turn = drift_turn(hypothesis.cause, plant);
    let of = |stroke: usize| {
        let room = plant.limit_s(stroke) - plant.healthy_s(stroke);
        let (level, pace) = (stroke, 2 + stroke);
        let growth = hypothesis.mean[pace] / room;
        let by_room = |i: usize, j: usize| hypothesis.cov[i][j] * sigma2 / (room * room);
        let line = Line {
            level: hypothesis.mean[level] / room,
            growth,
            var_level: by_room(level, level),
            cov: by_room(level, pace),
            var_growth: by_room(pace, pace),
            turns: (turn * growth).powi(2),
            turns_until: (LARGEST_TURN / turn).powi(2),
            ..Line::default()
        };
        (stroke, line)
    };
    let [close, open] = [of(0), of(1)];
    let first = close.1.end().0.total_cmp(&open.1.end().0).then(open.1.level.total_cmp(&close.1.level));
    let (stroke, straight) = if first.is_le() { close } else { open };
    let begun = lines.len();
    lines.push(straight);
    if closely && straight.growth > 0.0 {
        let time_s = plant.healthy_s(stroke) + hypothesis.mean[stroke];
        let quicker = (0..plant.wears()).filter_map(|wear| quicker_than_straight(plant, wear, stroke, time_s));
        lines.extend(quicker.map(|by| Line {
            growth: by * straight.growth,
            cov: by * straight.cov,
            var_growth: by * by * straight.var_growth,
            turns: by * by * straight.turns,
            ..straight
        }));
    }
    // As likely as not it is one of them.
    let others = lines.len() - begun - 1;
    let of_straight = if others > 0 { 0.5 } else { 1.0 };
    lines[begun].weight = of_straight * weight;
    for line in &mut lines[begun + 1..] {
        line.weight = (1.0 - of_straight) * weight / others as f64;
    }
}

/// How many times sooner than straight on a stroke that takes so long comes to its end if it slows down as by a wear; nothing where
/// that wear does not slow it down, or has ended before.
fn quicker_than_straight(plant: &Plant, wear: u8, stroke: usize, time_s: f64) -> Option<f64> {
    let at = |severity: f64| plant.times_and_slopes(wear, severity)[stroke];
    if time_s <= at(0.0).0 || time_s >= at(1.0).0 {
        return None;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = f64::midpoint(low, high);
        if at(middle).0 < time_s {
            low = middle;
        } else {
            high = middle;
        }
    }
    let straight = (plant.limit_s(stroke) - time_s) / at(low).1;
    let quicker = straight / (1.0 - low);
    (quicker.is_finite() && quicker > 1.0).then_some(quicker)
}

/// Where two leaks of which there is no table cross their limit: as a line whose level counts the cycles.
fn crossing(hypothesis: &Hypothesis, plant: &Plant, sigma2: f64) -> Line {
    let time_and_slope = |stroke: usize, t: f64| -> (f64, [f64; 4]) {
        let at = [0, 1].map(|i| hypothesis.mean[i] + t * hypothesis.mean[2 + i]);
        let (time, [by_first, by_second]) = plant.both_leaks(at)[stroke];
        (time, [by_first, by_second, t * by_first, t * by_second])
    };
    let end = |stroke: usize| -> Option<f64> {
        let over = |t: f64| time_and_slope(stroke, t).0 >= plant.limit_s(stroke);
        if over(0.0) {
            return Some(0.0);
        }
        let (mut low, mut high) = (0.0, 1.0);
        while !over(high) {
            low = high;
            high *= 2.0;
            if high > LONGEST {
                return None;
            }
        }
        for _ in 0..30 {
            let middle = f64::midpoint(low, high);
            if over(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        Some(high)
    };
    let ends = [0, 1].map(end);
    let (stroke, t) = match ends {
        [Some(a), Some(b)] if a <= b => (0, a),
        [_, Some(b)] => (1, b),
        [Some(a), None] => (0, a),
        [None, None] => (0, LONGEST),
    };
    let (_, slope) = time_and_slope(stroke, t);
    let known: f64 = (0..4).map(|i| (0..4).map(|j| slope[i] * hypothesis.cov[i][j] * slope[j]).sum::<f64>()).sum();
    // The pace goes on changing until then.
    let turned: f64 = [2, 3]
        .map(|i| (slope[i - 2] * drift_turn(hypothesis.cause, plant) * hypothesis.mean[i]).powi(2))
        .into_iter()
        .sum();
    let variance = known + turned * t.powi(3) / (3.0 * sigma2);
    let pace = slope[0] * hypothesis.mean[2] + slope[1] * hypothesis.mean[3];
    let sd = ((variance * sigma2).max(0.0).sqrt() / pace.abs().max(1e-9)).min(LONGEST);
    Line { weight: 0.0, level: 1.0 - t, growth: 1.0, var_level: sd * sd, ..Line::default() }
}
