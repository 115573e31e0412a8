//! A first impression of a campaign: a few of its runs, recorded under conditions that lie far apart.
//!
//! Where a candidate had best start, and how much it may gain from there, a few runs tell nearly as well as
//! all of them; what it gains is then found on all.

use std::sync::Arc;

use valve_model::Conditions;

use crate::data::Dataset;
use crate::fit::Fit;
use crate::scatter::Scatter;

/// Runs of a first impression at most.
const RUNS: usize = 3;

/// Conditions with stroke times of a first impression at most; each tells two numbers.
const TIMED: usize = 4;

/// Standard deviations by which noise may be less than expected.
const LUCK: f64 = 4.0;

/// Some of the units of a campaign, simulated roughly.
#[derive(Debug, Clone)]
pub struct Impression {
    /// The units alone.
    pub data: Dataset,
    /// The scatter of their strokes.
    pub scatter: Scatter,
    /// Which units of the whole campaign they are.
    units: Vec<usize>,
}

impl Impression {
    /// The impression of a campaign that is simulated roughly.
    pub fn of(rough: &Dataset, scatter: &Scatter) -> Self {
        let runs = rough.runs.iter().map(|run| {
            let edge = |close: bool| run.run.commands.iter().find(|edge| edge.close == close).map(|edge| edge.time_s);
            let hold_s = edge(false).unwrap_or(run.run.end_s) - edge(true).unwrap_or(0.0);
            place(&run.run.conditions, hold_s)
        });
        let timed = rough.timing_groups.iter().map(|group| place(&group.conditions, 0.0));
        let mut units = far_apart(&runs.collect::<Vec<_>>(), RUNS);
        units.extend(far_apart(&timed.collect::<Vec<_>>(), TIMED).iter().map(|group| rough.runs.len() + group));
        let keep = |unit: usize| units.contains(&unit);
        Self { data: rough.only(keep), scatter: scatter.only(rough, keep), units }
    }

    /// The least that a model can cost on the units that it does not show, judged by a fit to the whole
    /// campaign: what that fit costs there, or their noise where it does not fit.
    pub fn least_elsewhere(&self, rough: &Dataset, fit: &Fit) -> f64 {
        let shown = self.shown(rough, fit).residual;
        let elsewhere = (fit.residual.len() - shown.len()) as f64;
        let cost = fit.chi2 - self.scatter.dot(&shown, &shown);
        (cost.min(elsewhere) - LUCK * (2.0 * elsewhere).sqrt()).max(0.0)
    }

    /// What it shows of a fit to the whole campaign.
    pub fn shown(&self, rough: &Dataset, fit: &Fit) -> Fit {
        let rows = |values: &[f64]| rough.rows_of(values, |unit| self.units.contains(&unit));
        Fit {
            residual: rows(&fit.residual),
            jacobian: Arc::new(fit.jacobian.iter().map(|column| rows(column)).collect()),
            ..fit.clone()
        }
    }
}

/// Where a unit lies among the others.
fn place(conditions: &Conditions, hold_s: f64) -> [f64; 5] {
    let c = conditions;
    [c.supply_pressure_pa, c.temperature_k, c.leak_to_atmosphere_m2, c.leak_from_supply_m2, hold_s]
}

/// Units that lie far apart, each as far from the ones before as can be; no two alike.
fn far_apart(points: &[[f64; 5]], most: usize) -> Vec<usize> {
    let widths: [f64; 5] = core::array::from_fn(|axis| {
        let values = || points.iter().map(|point| point[axis]);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    });
    let distance = |a: usize, b: usize| -> f64 {
        (0..5).filter(|axis| widths[*axis] > 0.0).map(|i| ((points[a][i] - points[b][i]) / widths[i]).powi(2)).sum()
    };
    let lowest = (0..points.len()).min_by(|a, b| points[*a][0].total_cmp(&points[*b][0]));
    let mut chosen: Vec<usize> = lowest.into_iter().collect();
    while !chosen.is_empty() && chosen.len() < most {
        let nearest = |run: usize| chosen.iter().map(|other| distance(run, *other)).fold(f64::INFINITY, f64::min);
        let farthest = (0..points.len()).max_by(|a, b| nearest(*a).total_cmp(&nearest(*b)).then(b.cmp(a)));
        match farthest.filter(|run| nearest(*run) > 0.0) {
            Some(run) => chosen.push(run),
            None => break,
        }
    }
    chosen.sort_unstable();
    chosen
}
