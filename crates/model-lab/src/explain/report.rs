//! The answer, put together from what the search found.

use rayon::prelude::*;
use valve_model::{EffectKind, Valve};

use super::experiment::{Experiment, best_experiment};
use super::held_out::held_out_rms;
use super::model::{Model, is_practical};
use super::outside::{Outside, outside};
use super::search::{Found, INEXACT, excess};
use super::twins::{Twin, twins};
use super::view::{View, fits};
use super::{Progress, Watch};
use crate::certainty::widened;
use crate::fit::Fit;
use crate::scatter::{Origin, Scatter};

/// The verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing is missing beyond noise and the stated tolerances.
    Adequate,
    /// Effects of the catalogue explain the data.
    EffectFound,
    /// Something is missing and nothing in the catalogue explains it.
    OutsideCatalogue,
    /// Something is missing and too many effects could be it, or the search was cut short.
    NotEnoughData,
}

impl Verdict {
    /// The word in the output.
    pub fn id(self) -> &'static str {
        match self {
            Self::Adequate => "adequate",
            Self::EffectFound => "effect-found",
            Self::OutsideCatalogue => "outside-catalogue",
            Self::NotEnoughData => "not-enough-data",
        }
    }
}

/// A fitted parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedParameter {
    /// The effect.
    pub effect: EffectKind,
    /// The parameter's key.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Value, SI.
    pub value: f64,
    /// One standard deviation, SI.
    pub sigma: f64,
}

/// One candidate.
#[derive(Debug, Clone)]
pub struct CandidateReport {
    /// Its effects.
    pub kinds: Vec<EffectKind>,
    /// Their parameters.
    pub parameters: Vec<FittedParameter>,
    /// Root mean square of the residuals in units of the noise.
    pub normalised_rms: f64,
    /// The same on conditions left out, where it was worth computing.
    pub held_out_normalised_rms: Option<f64>,
    /// Change of the Bayesian information criterion against the calibrated model.
    pub delta_bic: f64,
    /// Fall of chi-squared with priors against the calibrated model.
    pub gain: f64,
    /// Strokes of which it takes off misfit, and all of them, where it was fitted as the best was.
    pub agreeing: Option<(usize, usize)>,
    /// Why it was not chosen.
    pub rejected: Option<String>,
}

/// One step of the ladder.
#[derive(Debug, Clone, PartialEq)]
pub struct StepReport {
    /// "datasheet", "calibrated", then the effect added.
    pub step: String,
    /// Root mean square of the residuals in units of the noise.
    pub normalised_rms: f64,
    /// The same on conditions left out.
    pub held_out_normalised_rms: Option<f64>,
}

/// What cannot be told from a recommended effect.
#[derive(Debug, Clone)]
pub struct TwinReport {
    /// The recommended effect.
    pub kind: EffectKind,
    /// The others.
    pub with: Vec<Twin>,
    /// Cosine of the angle between what both change in the records, after the tolerated parameters
    /// took their share; for each of the others.
    pub likeness: Vec<f64>,
    /// What would tell it from the closest.
    pub experiment: Option<Experiment>,
}

/// The whole answer.
#[derive(Debug)]
pub struct Explanation {
    /// The verdict.
    pub verdict: Verdict,
    /// The effects to add, in the order they were found.
    pub recommended: Vec<EffectKind>,
    /// Their parameters.
    pub parameters: Vec<FittedParameter>,
    /// For each recommended effect, what cannot be told from it.
    pub twins: Vec<TwinReport>,
    /// Every candidate tried, best first.
    pub candidates: Vec<CandidateReport>,
    /// The ladder.
    pub steps: Vec<StepReport>,
    /// What sits outside the catalogue.
    pub outside: Option<Outside>,
    /// Lack of fit of the last step, in standard deviations of pure noise.
    pub lack: f64,
    /// The scatter from stroke to stroke.
    pub scatter: Scatter,
    /// The calibrated model.
    pub calibrated: Fit,
    /// The last accepted model.
    pub best: Fit,
    /// What else the reader should know.
    pub notes: Vec<String>,
    /// Whether the search was cut short.
    pub interrupted: bool,
}

/// Lack of fit beyond what is accepted in the search from which something is missing for sure.
const MARGIN: f64 = 1.3;

/// Share of what effects of the catalogue have explained that they may leave, where no formula explains as much
/// as they do.
const NEARLY_ALL: f64 = 0.02;

/// Root mean square of the residuals of a model that does not fit.
const FAR: f64 = 3.0;

/// A group larger than this names nothing.
const LARGEST_GROUP: usize = 4;

pub(super) fn assemble(datasheet_rms: f64, found: &Found, watch: &Watch<'_>) -> Explanation {
    let (data, scatter) = (&found.view.fine, &found.view.scatter);
    let best = found.steps[found.steps.len() - 1].clone();
    let calibrated = found.steps[0].fit.clone();
    let mut notes = Vec::new();
    watch.tell(Progress::Doing("left-out conditions"));
    let held: Vec<Option<f64>> = found
        .steps
        .par_iter()
        .map(|step| if watch.is_stopped() { None } else { held_out(&found.view, &step.fit) })
        .collect();
    let mut steps =
        vec![StepReport { step: "datasheet".into(), normalised_rms: datasheet_rms, held_out_normalised_rms: None }];
    for (index, (model, held_out)) in found.steps.iter().zip(&held).enumerate() {
        let step = match index {
            0 => "calibrated".into(),
            _ => model
                .kinds
                .iter()
                .map(|kind| kind.id())
                .filter(|id| steps.iter().all(|s| s.step != *id))
                .collect::<Vec<_>>()
                .join(" + "),
        };
        steps.push(StepReport {
            step,
            normalised_rms: model.fit.normalised_rms(scatter),
            held_out_normalised_rms: *held_out,
        });
    }
    let left = excess(scatter, &best.fit);
    let mut missing = found.lack > MARGIN * fits(scatter) && left > INEXACT * best.gain;
    let mut found_outside = None;
    if missing && !watch.is_stopped() {
        watch.tell(Progress::Doing("tables along position, velocity and time"));
        found_outside = outside(&found.view, &calibrated, watch);
        let explains_less = |outside: &Outside| outside.fit.cost > best.fit.cost;
        if !watch.is_stopped() && left < NEARLY_ALL * best.gain && found_outside.as_ref().is_none_or(explains_less) {
            (missing, found_outside) = (false, None);
            notes.push(format!(
                "an error of {:.3} is left, more than noise; nothing in or outside the catalogue explains as much as the effects named",
                best.fit.normalised_rms(scatter)
            ));
        }
    }
    let mut twin_reports = Vec::new();
    if !best.kinds.is_empty() && !missing && !watch.is_stopped() {
        watch.tell(Progress::Doing("effects that could stand in"));
        for (kind, with) in best.kinds.iter().zip(twins(found, watch)) {
            let likeness = with.iter().map(|twin| likeness(scatter, &calibrated, &best.fit, &twin.model.fit)).collect();
            let experiment = with.first().and_then(|twin| best_experiment(data, &best.fit, &twin.model.fit));
            twin_reports.push(TwinReport { kind: *kind, with, likeness, experiment });
        }
    }
    let group = twin_reports.iter().map(|twin| 1 + twin.with.len()).max().unwrap_or(1);
    let interrupted = found.interrupted || watch.is_stopped();
    let verdict = match (best.kinds.is_empty(), missing) {
        // What was not tried cannot be ruled out.
        (_, true) | (true, false) if interrupted => Verdict::NotEnoughData,
        (_, true) => Verdict::OutsideCatalogue,
        (true, false) => Verdict::Adequate,
        (false, false) if group > LARGEST_GROUP => Verdict::NotEnoughData,
        (false, false) => Verdict::EffectFound,
    };
    match scatter.origin {
        Origin::Repeats => {}
        Origin::Unknown => notes.push(
            "no condition was repeated, so the scatter from stroke to stroke is unknown; repeats would show whether small effects are real"
                .into(),
        ),
        Origin::Supposed => notes.push(format!(
            "no condition was repeated; what is left looks as if single strokes differed by {} (one standard deviation), and this answer takes it for that: repeat one stroke three times or more to see whether they do",
            scatter.words()
        )),
    }
    if interrupted {
        notes.push("the search was cut short; this is what was known by then".into());
    }
    // Beside something outside the catalogue no effect of it is certain.
    let recommended = if verdict == Verdict::OutsideCatalogue { Vec::new() } else { best.kinds.clone() };
    Explanation {
        verdict,
        parameters: fitted_parameters(&best.fit, &recommended, scatter),
        recommended,
        twins: twin_reports,
        candidates: candidates(found, &best, missing, &held, watch),
        steps,
        outside: found_outside,
        lack: found.lack,
        scatter: scatter.clone(),
        calibrated,
        best: best.fit,
        notes,
        interrupted,
    }
}

/// The parameters of effects at the best point of a fit, with standard deviations.
pub fn fitted_parameters(fit: &Fit, kinds: &[EffectKind], scatter: &Scatter) -> Vec<FittedParameter> {
    // What is left above the noise makes every parameter less sure.
    let inflation = fit.normalised_rms(scatter).max(1.0);
    let covariance = widened(scatter, fit, &(inflation * inflation * &fit.covariance));
    let mut all = Vec::new();
    for kind in kinds {
        let Some(values) = fit.space.effect_values(*kind, &fit.u) else { continue };
        let slopes: Vec<Vec<f64>> = (0..fit.u.len())
            .map(|index| {
                let coordinate = &fit.space.coordinates[index];
                let step = 0.1 * fit.sigma(index).clamp(1e-6, 1.0);
                let step = if fit.u[index] + step > coordinate.upper { -step } else { step };
                let mut moved = fit.u.clone();
                moved[index] += step;
                let changed = fit.space.effect_values(*kind, &moved).unwrap_or_else(|| values.clone());
                changed.iter().zip(&values).map(|(a, b)| (a - b) / step).collect()
            })
            .collect();
        for (index, parameter) in kind.parameters().iter().enumerate() {
            let mut variance = 0.0;
            for (i, a) in slopes.iter().enumerate() {
                for (j, b) in slopes.iter().enumerate() {
                    variance += a[index] * covariance[(i, j)] * b[index];
                }
            }
            all.push(FittedParameter {
                effect: *kind,
                name: parameter.name,
                unit: parameter.si_unit,
                value: values[index],
                sigma: variance.max(0.0).sqrt(),
            });
        }
    }
    all
}

/// The error on conditions left out; where much is left, a rough simulation shows it as well.
fn held_out(view: &View, fit: &Fit) -> Option<f64> {
    let far = fit.normalised_rms(&view.scatter) > FAR;
    held_out_rms(if far { &view.rough } else { &view.fine }, &view.scatter, fit)
}

/// So many of the best candidates are also asked to predict left-out conditions, if their error is within
/// this many times that of the best.
const PREDICTING: usize = 4;
const NEAR: f64 = 2.0;

fn candidates(
    found: &Found,
    best: &Model,
    missing: bool,
    held: &[Option<f64>],
    watch: &Watch<'_>,
) -> Vec<CandidateReport> {
    let (data, scatter) = (&found.view.fine, &found.view.scatter);
    let base = &found.steps[0];
    // Residuals that hang together count less than their number.
    let count = data.residual_count() as f64;
    let mut models: Vec<&Model> = found.steps[1..].iter().chain(&found.singles).chain(&found.alternatives).collect();
    models.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut distinct: Vec<&Model> = Vec::new();
    for model in models {
        if distinct.iter().all(|other| other.kinds != model.kinds) {
            distinct.push(model);
        }
    }
    let unexplained = scatter.dot_by_unit(data, &base.fit.residual);
    let agreeing = |fit: &Fit| {
        let left = scatter.dot_by_unit(data, &fit.residual);
        (unexplained.iter().zip(&left).filter(|(before, after)| after < before).count(), left.len())
    };
    let best_rms = best.fit.normalised_rms(scatter);
    let predicts: Vec<Option<f64>> = distinct
        .par_iter()
        .take(PREDICTING)
        .map(|model| match found.steps.iter().position(|step| step.kinds == model.kinds) {
            Some(step) => held[step],
            None if watch.is_stopped() || model.fit.normalised_rms(scatter) > NEAR * best_rms => None,
            None => held_out(&found.view, &model.fit),
        })
        .collect();
    let predicts = predicts.into_iter().chain(std::iter::repeat(None));
    let mut reports: Vec<CandidateReport> = Vec::new();
    for (model, predicts) in distinct.into_iter().zip(predicts) {
        let gain = model.gain + model.score() - model.fit.cost;
        let added = (model.fit.u.len() - base.fit.u.len()) as f64;
        let rms = model.fit.normalised_rms(scatter);
        let deflation = rms.max(1.0).powi(2);
        let behind = best.gain - model.gain;
        let rejected = if model.kinds == best.kinds {
            missing.then(|| "explains most, and far too little".into())
        } else if !is_practical(model, scatter) {
            Some("is too small to be of any use".into())
        } else if best.kinds.is_empty() {
            Some(format!("improves chi-squared by {gain:.1} only"))
        } else if found.steps.iter().any(|step| step.kinds == model.kinds) {
            Some("another effect beside it explains more".into())
        } else if model.kinds.len() > best.kinds.len() && best.kinds.iter().all(|kind| model.kinds.contains(kind)) {
            Some("adds too little to be believed".into())
        } else if behind < super::twins::TWIN {
            Some("explains the data as well; these data cannot tell it apart".into())
        } else {
            Some(format!("explains less: chi-squared is {behind:.0} higher"))
        };
        reports.push(CandidateReport {
            kinds: model.kinds.clone(),
            parameters: fitted_parameters(&model.fit, &model.kinds, scatter),
            normalised_rms: rms,
            held_out_normalised_rms: predicts,
            delta_bic: added * count.ln() - gain / deflation,
            gain,
            agreeing: predicts.map(|_| agreeing(&model.fit)),
            rejected,
        });
    }
    reports
}

/// Cosine of the angle between the changes that two models make to the calibrated one, after the
/// tolerated parameters took their share (1: the data cannot tell them apart).
fn likeness(scatter: &Scatter, calibrated: &Fit, one: &Fit, other: &Fit) -> f64 {
    let change =
        |fit: &Fit| -> Vec<f64> { fit.residual.iter().zip(&calibrated.residual).map(|(a, b)| a - b).collect() };
    let (a, b) = (change(one), change(other));
    scatter.dot(&a, &b) / (scatter.dot(&a, &a) * scatter.dot(&b, &b)).sqrt().max(1e-300)
}

impl Explanation {
    /// The valve with what is recommended.
    pub fn valve(&self) -> Valve {
        self.best.valve()
    }
}
