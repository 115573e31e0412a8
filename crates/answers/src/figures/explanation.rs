//! Pictures of an explanation.

use model_lab::diagnosis::discrepancy::ModelDiscrepancy;
use model_lab::diagnosis::{CandidateReport, Explanation};
use model_lab::errors::{CALIBRATED, StepReport};
use model_lab::forward::{Predicted, record};
use report::figures::{
    Candidate, ExperimentFigure, LeaderboardFigure, MissingPoint, Prediction, StaircaseFigure, StaircaseStep, Standing,
    UnexplainedFigure,
};
use valve_model::custom::CustomTarget;
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{EffectKind, Prepared, Valve, simulate};

use crate::explanation::joined;

/// Every set of effects once, by evidence: as it was fitted to the end, else as it was looked at first.
pub fn distinct(answer: &Explanation) -> Vec<&CandidateReport> {
    let mut distinct: Vec<&CandidateReport> = Vec::new();
    for one in &answer.candidates {
        match distinct.iter_mut().find(|other| is_set(&other.kinds, &one.kinds)) {
            Some(other) if other.held_out.is_none() && one.held_out.is_some() => {
                *other = one;
            }
            Some(_) => {}
            None => distinct.push(one),
        }
    }
    distinct.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    distinct
}

/// Whether an answer names a candidate: as what is missing, or as what cannot be told from that.
pub fn is_told(answer: &Explanation, candidate: &CandidateReport) -> bool {
    is_set(&candidate.kinds, &answer.recommended) || is_alike(answer, &candidate.kinds)
}

fn is_alike(answer: &Explanation, kinds: &[EffectKind]) -> bool {
    answer.indistinguishable.iter().flat_map(|group| &group.with).any(|one| is_set(kinds, &one.kinds))
}

fn is_set(kinds: &[EffectKind], of: &[EffectKind]) -> bool {
    kinds.len() == of.len() && kinds.iter().all(|kind| of.contains(kind))
}

/// The candidates by the error that remains with each, what the verdict names among them.
pub fn leaderboard(answer: &Explanation, campaign: &str, headline: &str) -> LeaderboardFigure {
    let standing = |kinds: &[EffectKind]| {
        if is_set(kinds, &answer.recommended) {
            Standing::Recommended
        } else if is_alike(answer, kinds) {
            Standing::Alike
        } else {
            Standing::Rejected
        }
    };
    let text = |rmse_m: Option<f64>| rmse_m.map_or_else(String::new, |rmse| format!("{:.3} mm", 1e3 * rmse));
    let mut candidates: Vec<Candidate> = Vec::new();
    for one in distinct(answer) {
        let standing = standing(&one.kinds);
        if one.kinds.len() == 1 || standing != Standing::Rejected {
            candidates.push(Candidate {
                name: joined(&one.kinds),
                fitted: one.errors.normalised_rms,
                held_out: one.held_out.map(|errors| errors.normalised_rms),
                standing,
                text: text(one.errors.rmse_m),
            });
        }
    }
    let found = |name: String, step: &StepReport| Candidate {
        name,
        fitted: step.errors.normalised_rms,
        held_out: step.held_out.map(|errors| errors.normalised_rms),
        standing: Standing::Recommended,
        text: text(step.errors.rmse_m),
    };
    let is_there = candidates.iter().any(|one| one.standing == Standing::Recommended);
    if let Some(last) = answer.steps.last().filter(|_| !is_there && !answer.recommended.is_empty()) {
        candidates.push(found(joined(&answer.recommended), last));
    }
    candidates.extend(formula_step(answer).map(|step| found(step.step.clone(), &step)));
    let calibrated = answer.steps.iter().find(|step| step.step == CALIBRATED);
    LeaderboardFigure {
        title: campaign.to_owned(),
        subtitle: headline.to_owned(),
        candidates,
        without: calibrated.map(|step| step.errors.normalised_rms),
    }
}

/// The model sequence, which ends with the formula where there is one.
pub fn steps(answer: &Explanation) -> Vec<StepReport> {
    answer.steps.iter().cloned().chain(formula_step(answer)).collect()
}

fn formula_step(answer: &Explanation) -> Option<StepReport> {
    let discrepancy = answer.discrepancy.as_ref()?;
    Some(StepReport::of(format!("formula ({})", discrepancy.effect.name()), discrepancy.errors, discrepancy.held_out))
}

/// Points of a formula's curve.
const CURVE: u32 = 400;

/// Where something sits that no effect explains: the table without a law, and the formula for it.
pub fn unexplained(discrepancy: &ModelDiscrepancy, campaign: &str) -> UnexplainedFigure {
    let (label, factor) = match discrepancy.axis.variable {
        "x" => ("position (mm)", 1e3),
        "v" => ("velocity (mm/s), + opens", 1e3),
        _ => ("time since the command (s)", 1.0),
    };
    let (quantity, scale) = match discrepancy.axis.target {
        CustomTarget::Force => ("missing force (N), + opens", 1.0),
        CustomTarget::Friction => ("missing friction (N)", 1.0),
        CustomTarget::PipeFlow => ("missing flow into the pipe (g/s)", 1e3),
        CustomTarget::ChamberFlow => ("missing flow into the chamber (g/s)", 1e3),
    };
    let (from, to) = (discrepancy.knots[0], discrepancy.knots[discrepancy.knots.len() - 1]);
    let places = (0..=CURVE).map(|i| from + (to - from) * f64::from(i) / f64::from(CURVE));
    let table = discrepancy.knots.iter().zip(&discrepancy.values).zip(&discrepancy.sigmas);
    UnexplainedFigure {
        title: format!("{campaign}: no effect of the catalogue explains it"),
        subtitle: format!("what is missing, fitted without a law, and {}", discrepancy.effect.formula().source()),
        axis: label.to_owned(),
        quantity: quantity.to_owned(),
        table: table
            .map(|((at, value), sigma)| MissingPoint {
                at: at * factor,
                value: value * scale,
                standard_error: sigma * scale,
            })
            .collect(),
        formula: places.map(|at| [at * factor, discrepancy.formula_at(at) * scale]).collect(),
    }
}

/// What the closest two effects that cannot be told apart predict for the run that would tell them apart.
pub fn next_experiment(answer: &Explanation) -> Option<ExperimentFigure> {
    let groups = answer.indistinguishable.iter().find(|groups| groups.experiment.is_some())?;
    let (plan, other) = (groups.experiment.as_ref()?, groups.with.first()?);
    let time_s: Vec<f64> = (0..=CURVE).map(|i| plan.run.end_s * f64::from(i) / f64::from(CURVE)).collect();
    let predict = |kind: EffectKind, valve: &Valve| {
        let mut predicted = Predicted::default();
        simulate(&[Prepared::new(valve, &plan.run, DEFAULT_STEP_S)], false, |_, nodes, _| {
            record(valve, nodes, &time_s, &mut predicted);
        });
        Prediction { name: kind.id().to_owned(), position_mm: predicted.position_m.iter().map(|x| x * 1e3).collect() }
    };
    Some(ExperimentFigure {
        title: format!("next: {}", plan.purpose),
        subtitle: format!("expected difference of chi-squared: {:.0}", plan.separation),
        predictions: vec![predict(groups.kind, &answer.valve), predict(other.kind, &other.valve)],
        noise_mm: answer.noise_m.unwrap_or(1e-4) * 1e3,
        time_s,
    })
}

/// The error after each step of a model sequence.
pub fn staircase(title: &str, subtitle: &str, steps: &[StepReport]) -> StaircaseFigure {
    StaircaseFigure {
        title: title.to_owned(),
        subtitle: subtitle.to_owned(),
        steps: steps
            .iter()
            .map(|step| StaircaseStep {
                name: step.told(),
                fitted: step.errors.normalised_rms,
                held_out: step.held_out.map(|errors| errors.normalised_rms),
            })
            .collect(),
    }
}
