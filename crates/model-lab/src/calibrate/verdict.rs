//! Whether tolerances, noise and instruments explain a campaign, or something is missing.

use identify::FitOptions;
use identify::left::{left_nats, left_to_explain};
use identify::select::{Model, SelectOptions};

use super::lack_of_fit::lack_of_fit;
use crate::diagnosis::MovedParameter;
use crate::errors;
use crate::identification::ValveProblem;
use crate::identification::setup::Kind;

/// Standard deviations of the sum of squared pulls that are.
const FAR_TOGETHER: f64 = 4.0;

/// What replicated strokes have in common counts as nothing beside what they differ by below this ratio of mean squares: one of
/// the order of ten independent readings each exceeds it in one case of ten.
const LARGEST_LACK_OF_FIT: f64 = 2.3;

/// What a calibration comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Parameters within their tolerances, noise, instruments and conditions explain everything.
    Explained,
    /// What is left is more than noise, and no more than common instruments do.
    SomethingLeft,
    /// Parameters that had to go too far explain everything: values of the valve file are not what they are believed to be, or
    /// physics is missing that they stand in for.
    ValuesBeyondTolerance,
    /// Too much is left: physics is missing.
    BeyondTolerance,
}

impl Verdict {
    /// Its name in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::Explained => "explained",
            Self::SomethingLeft => "something-left",
            Self::ValuesBeyondTolerance => "values-beyond-tolerance",
            Self::BeyondTolerance => "beyond-tolerance",
        }
    }

    /// Whether what was found may be no more than a stand-in for physics that is missing.
    pub fn is_doubtful(self) -> bool {
        matches!(self, Self::ValuesBeyondTolerance | Self::BeyondTolerance)
    }
}

/// Conflicts of prior and data: parameters that a fit puts too far from where they are believed to be.
pub(super) fn prior_data_conflicts(parameters: &[MovedParameter]) -> Vec<String> {
    let far = parameters.iter().filter(|one| one.is_far());
    let mut reasons: Vec<String> =
        far.map(|one| format!("{} would have to be {:.1} tolerances off", one.id.key(), one.pull)).collect();
    let together: f64 = parameters.iter().map(|one| one.pull.powi(2)).sum();
    let count = parameters.len() as f64;
    if reasons.is_empty() && (together - count) / (2.0 * count).sqrt() > FAR_TOGETHER {
        reasons.push(format!(
            "the parameters together would have to be further off than their tolerances allow \
             (sum of squares {together:.0} for {count} of them)"
        ));
    }
    reasons
}

/// The verdict and its reasons, by the numbers with which a search begins: where it would look no further everything is
/// explained.
pub(super) fn judge(model: &Model<ValveProblem<'_>>, conflicts: &[String]) -> (Verdict, Vec<String>) {
    let limits = SelectOptions::default();
    let options = FitOptions::new(model.problem.setup().groups.clone());
    let noise = &model.fit.noise.groups;
    let has_traces = model.problem.setup().recordings.iter().any(|recording| matches!(recording.kind, Kind::Trace(_)));
    let left = left_nats(&model.problem, &model.fit, &options);
    let is_left = left_to_explain(&model.problem, &model.fit, &options) > limits.accept;
    let is_large = errors::is_large(model, limits.large);
    let mut reasons = conflicts.to_vec();
    if !is_left && reasons.is_empty() {
        let all = "tolerances, noise and what instruments and conditions may be off by explain everything";
        return (Verdict::Explained, vec![all.to_owned()]);
    }
    if !is_left && !is_large {
        return (Verdict::ValuesBeyondTolerance, reasons);
    }
    let replicates = lack_of_fit(model).filter(|statistic| *statistic < LARGEST_LACK_OF_FIT);
    if replicates.is_some() && !is_large && reasons.is_empty() {
        let differ = "what is left is no more than strokes repeated under one condition differ by among each other";
        return (Verdict::Explained, vec![differ.to_owned()]);
    }
    if left > limits.accept {
        reasons.push(if has_traces {
            format!(
                "what is left is not noise: an error of {:.2} % of the stroke at full speed that hangs together over \
                 {:.0} ms",
                100.0 * noise[0].discrepancy,
                1e3 * noise[0].time_s
            )
        } else {
            format!("stroke times differ by {:.1} times their noise", noise[2].multiplier)
        });
    } else if conflicts.is_empty() {
        reasons.push("instruments and conditions would have to be off by more than they usually are".to_owned());
    }
    let is_beyond = !conflicts.is_empty() || (is_large && left > limits.accept);
    (if is_beyond { Verdict::BeyondTolerance } else { Verdict::SomethingLeft }, reasons)
}
