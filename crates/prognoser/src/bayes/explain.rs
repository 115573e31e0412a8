//! Other stories for the last readings, tried when they look suspicious.

use super::change::{Change, LN_RARE, Suspicion};
use super::config::GrowthLaw;
use super::estimator::BayesEstimator;
use super::history::RECENT;
use super::hypotheses::{Hypotheses, Shape, StartViews};
use super::model::FaultModel;
use super::view::View;
use crate::reading::Reading;

/// Rates of exponential growth tried, per cycle.
const RATES: [f64; 8] = [0.01, 0.02, 0.04, 0.06, 0.09, 0.14, 0.2, 0.3];
/// Largest product of rate and cycles.
const MOST_FOLDS: f64 = 50.0;
/// Multiples of the best of them that are tried as well.
const CLOSER: [f64; 4] = [0.8, 0.9, 1.1, 1.25];
/// Cycles after which an exponential rate is looked for again.
const RATE_EVERY: u64 = 4;
/// Logarithm of the odds at which exponential growth replaces linear growth.
const LN_EXPONENTIAL: f64 = 9.0;
/// Readings before the law of growth is questioned.
const LAW_FROM: u64 = 10;
/// Numbers of last readings to which a change is fitted.
const CHANGE_WINDOWS: [usize; 2] = [3, RECENT];

impl BayesEstimator {
    /// Looks for a story that explains the last readings better than the one
    /// followed so far, and follows it if there is one.
    pub(super) fn explain(&mut self, models: &[FaultModel; 2], suspicion: Suspicion) -> Option<Change> {
        if suspicion.law
            && self.growth == GrowthLaw::Auto
            && self.history.seen() >= LAW_FROM
            && self.try_exponential(models)
        {
            return Some(Change::Exponential);
        }
        if !suspicion.change {
            return None;
        }
        let all = self.all.as_ref()?;
        let (mut best, mut best_gain) = (None, LN_RARE);
        for window in CHANGE_WINDOWS {
            let entries = self.history.recent();
            let entries = &entries[entries.len().saturating_sub(window)..];
            let present: f64 = entries.iter().map(|entry| entry.ln_predicted).sum();
            let readings: Vec<Reading> = entries.iter().map(|entry| entry.reading).collect();
            let from = readings[0].cycle;
            let known = |views: &[View]| StartViews {
                healthy: views.to_vec(),
                unknown: Vec::new(),
                none: self.restart.none.clone(),
            };
            let any = StartViews { healthy: Vec::new(), ..self.restart.clone() };
            for (kind, origin, starts) in [
                (Change::Reread, all.origin, &self.starts),
                (Change::Repaired, from, &known(&self.restart.healthy)),
                (Change::Broken, from, &any),
            ] {
                // A few readings alone cannot speak against all before them.
                if kind == Change::Reread && window < RECENT {
                    continue;
                }
                let shape = if kind == Change::Reread { all.shape } else { Shape::Linear };
                let fit = Hypotheses::fit(models, &readings, origin, shape, starts, &self.priors);
                let gain = fit.ln_total() - present;
                if gain > best_gain {
                    best_gain = gain;
                    best = Some((kind, readings.len(), fit));
                }
            }
        }
        let (kind, keep, fit) = best?;
        self.all = Some(fit);
        self.history.restart(keep);
        if kind != Change::Reread {
            self.starts = self.restart.clone();
        }
        Some(kind)
    }

    /// Compares linear with exponential growth on the sample of the past.
    fn try_exponential(&mut self, models: &[FaultModel; 2]) -> bool {
        let Some(all) = &self.all else { return false };
        let (origin, noise) = (all.origin, all.tracks[all.leading() as usize].state.sigma2);
        let sample = self.history.sample();
        let fit = |shape| Hypotheses::fit(models, &sample, origin, shape, &self.starts, &self.priors);
        let linear = fit(Shape::Linear).ln_total();
        let best = self.best_exponential(models);
        // A step fits no exponential: the noise would have to be larger.
        let quiet = best.tracks[best.leading() as usize].state.sigma2 < 2.0 * noise;
        if quiet && best.ln_total() > linear + LN_EXPONENTIAL && best.shape != all.shape {
            self.all = Some(best);
            return true;
        }
        false
    }

    /// The most probable rate: the best of a coarse list, then of its closer
    /// neighbours.
    fn best_exponential(&self, models: &[FaultModel; 2]) -> Hypotheses {
        let sample = self.history.sample();
        let origin = self.all.as_ref().map_or(0, |all| all.origin);
        let fit = |rate: f64| {
            let shape = Shape::Exponential { rate };
            let all = Hypotheses::fit(models, &sample, origin, shape, &self.starts, &self.priors);
            (rate, all)
        };
        let better = |a: (f64, Hypotheses), b: (f64, Hypotheses)| {
            if b.1.ln_total() > a.1.ln_total() { b } else { a }
        };
        // Beyond so many e-foldings the start would have been too small to be
        // one.
        let span = sample.last().map_or(0.0, |last| last.cycle.saturating_sub(origin) as f64);
        let slowest = RATES[0].min(MOST_FOLDS / span.max(1.0));
        let coarse = RATES
            .iter()
            .skip(1)
            .filter(|rate| **rate * span <= MOST_FOLDS)
            .map(|rate| fit(*rate))
            .fold(fit(slowest), better);
        let rate = coarse.0;
        CLOSER.iter().map(|factor| fit(rate * factor)).fold(coarse, better).1
    }

    /// Once growth is exponential, or with such growth asked for, its rate is
    /// found again from the sample every few cycles.
    pub(super) fn follow_exponential(&mut self, models: &[FaultModel; 2]) {
        let seen = self.history.seen();
        let asked = self.growth == GrowthLaw::Exponential && seen >= 3;
        let known = self.all.as_ref().is_some_and(|all| all.shape != Shape::Linear);
        if (asked || known) && (seen <= RECENT as u64 || seen.is_multiple_of(RATE_EVERY)) {
            self.all = Some(self.best_exponential(models));
        }
    }
}
