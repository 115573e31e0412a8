//! The pictures of `valve explain`.

use identify::select::SelectOptions;
use model_lab::diagnosis::outside::Outside;
use model_lab::diagnosis::{CandidateReport, Explanation};
use model_lab::forward::{Predicted, record};
use report::figures::{
    Candidate, ExperimentFigure, LeaderboardFigure, MissingPoint, Prediction, TwinBracket, UnexplainedFigure,
};
use valve_model::custom::CustomTarget;
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{EffectKind, Prepared, Valve, simulate};

/// The candidates and what each explains.
pub fn leaderboard(answer: &Explanation, campaign: &str, headline: &str) -> LeaderboardFigure {
    let shown: Vec<&CandidateReport> = answer
        .candidates
        .iter()
        .filter(|candidate| candidate.kinds.len() == 1 || candidate.rejected.is_none())
        .take(18)
        .collect();
    let candidates = shown.iter().map(|candidate| Candidate {
        name: candidate.kinds.iter().map(|kind| kind.id()).collect::<Vec<_>>().join(" + "),
        gain: candidate.gain,
        held_out_gain: None,
        agreeing: None,
        recommended: candidate.rejected.is_none(),
    });
    let row = |kind: EffectKind| shown.iter().position(|candidate| candidate.kinds == [kind]);
    let brackets = answer.twins.iter().filter_map(|twins| {
        let rows: Vec<usize> =
            twins.with.iter().map(|twin| twin.kind).chain([twins.kind]).map(row).collect::<Option<_>>()?;
        let (first, last) = (*rows.iter().min()?, *rows.iter().max()?);
        (first < last).then(|| TwinBracket { rows: [first, last], text: "twins".into() })
    });
    LeaderboardFigure {
        title: campaign.to_owned(),
        subtitle: headline.to_owned(),
        brackets: brackets.collect(),
        candidates: candidates.collect(),
        acceptance_gain: SelectOptions::default().accept,
    }
}

/// Points of a formula's curve.
const CURVE: u32 = 400;

/// Where something sits that no effect explains: the table without a law, and the formula for it.
pub fn unexplained(outside: &Outside, campaign: &str) -> UnexplainedFigure {
    let (label, factor) = match outside.axis.variable {
        "x" => ("position (mm)", 1e3),
        "v" => ("velocity (mm/s), + opens", 1e3),
        _ => ("time since the command (s)", 1.0),
    };
    let (quantity, scale) = match outside.axis.target {
        CustomTarget::Force => ("missing force (N), + opens", 1.0),
        CustomTarget::Friction => ("missing friction (N)", 1.0),
        CustomTarget::PipeFlow => ("missing flow into the pipe (g/s)", 1e3),
        CustomTarget::ChamberFlow => ("missing flow into the chamber (g/s)", 1e3),
    };
    let (from, to) = (outside.knots[0], outside.knots[outside.knots.len() - 1]);
    let places = (0..=CURVE).map(|i| from + (to - from) * f64::from(i) / f64::from(CURVE));
    let table = outside.knots.iter().zip(&outside.values).zip(&outside.sigmas);
    UnexplainedFigure {
        title: format!("{campaign}: no effect of the catalogue explains it"),
        subtitle: format!("what is missing, fitted without a law, and {}", outside.effect.formula().source()),
        axis: label.to_owned(),
        quantity: quantity.to_owned(),
        table: table
            .map(|((at, value), sigma)| MissingPoint {
                at: at * factor,
                value: value * scale,
                standard_error: sigma * scale,
            })
            .collect(),
        formula: places.map(|at| [at * factor, outside.formula_at(at) * scale]).collect(),
    }
}

/// What the closest two effects that cannot be told apart predict for the run that would tell them apart.
pub fn next_experiment(answer: &Explanation) -> Option<ExperimentFigure> {
    let twins = answer.twins.iter().find(|twins| twins.experiment.is_some())?;
    let (plan, other) = (twins.experiment.as_ref()?, twins.with.first()?);
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
        predictions: vec![predict(twins.kind, &answer.valve), predict(other.kind, &other.valve)],
        noise_mm: answer.noise_m.unwrap_or(1e-4) * 1e3,
        time_s,
    })
}
