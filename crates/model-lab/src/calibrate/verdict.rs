//! Whether tolerances, noise and repeatability explain a campaign, or something is missing.

use valve_model::ParameterId;

use super::Settled;
use crate::compare::Comparison;
use crate::compare::averages::{LongAverage, long_averages};
use crate::data::{Dataset, RunData};
use crate::fit::Fit;
use crate::scatter::{Origin, Scatter};
use crate::space::Target;

/// Residuals are more than noise when an average exceeds it by this many standard deviations ...
const EXCESS_SIGMAS: f64 = 4.5;

/// ... and by this share: what numerical errors and a rough noise figure can do is no physics.
const LEAST_EXCESS: f64 = 0.08;

/// The same where the noise was not stated but estimated.
const LEAST_EXCESS_ESTIMATED: f64 = 0.2;

/// A parameter this many tolerances off is a sign of missing physics.
const FAR_SHIFT: f64 = 3.0;

/// Standard deviations of the sum of squared shifts that are.
const FAR_TOGETHER: f64 = 4.0;

/// What a calibration comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Parameters within their tolerances, noise and repeatability explain everything.
    Explained,
    /// Something is left, or parameters had to go too far: physics is missing.
    BeyondTolerance,
}

impl Verdict {
    /// Its name in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::Explained => "explained",
            Self::BeyondTolerance => "beyond-tolerance",
        }
    }
}

/// What is left after a fit, scatter between strokes taken out.
#[derive(Debug, Clone, PartialEq)]
pub struct LackOfFit {
    /// chi-squared of all residuals over their number less that of the parameters; 1 for noise.
    pub chi2_per_reading: f64,
    /// Residuals that went into it.
    pub readings: usize,
    /// Averages over longer times; empty for stroke times alone.
    pub averages: Vec<LongAverage>,
    least_excess: f64,
}

impl LackOfFit {
    pub(super) fn new(data: &Dataset, fit: &Fit, scatter: &Scatter) -> Self {
        let clean = scatter.without_scatter(&fit.residual);
        let readings = fit.residual.len();
        let chi2 = scatter.dot(&fit.residual, &fit.residual);
        let free = readings.saturating_sub(fit.u.len()).max(1);
        Self {
            chi2_per_reading: chi2 / free as f64,
            readings,
            averages: long_averages(&data.runs.iter().collect::<Vec<&RunData>>(), &clean),
            least_excess: if data.noise_is_stated { LEAST_EXCESS } else { LEAST_EXCESS_ESTIMATED },
        }
    }

    /// chi-squared as an average over no time, for stroke times.
    fn total(&self) -> LongAverage {
        LongAverage { average_s: 0.0, mean_square: self.chi2_per_reading, count: self.readings }
    }

    fn all(&self) -> impl Iterator<Item = LongAverage> {
        self.averages.iter().copied().chain([self.total()])
    }

    /// By how much what is left weakens the data: the mean square of the averages that exceed noise.
    pub(super) fn inflation(&self) -> f64 {
        let clear = self.all().filter(|average| average.excess_sigmas() > 3.0);
        clear.map(|average| average.mean_square).fold(1.0, f64::max)
    }

    /// The average that exceeds noise most clearly, if one does.
    pub fn excess(&self) -> Option<LongAverage> {
        self.all()
            .filter(|average| average.excess_sigmas() > EXCESS_SIGMAS && average.mean_square > 1.0 + self.least_excess)
            .max_by(|a, b| a.excess_sigmas().total_cmp(&b.excess_sigmas()))
    }
}

/// What is wrong with where a fit had to go: parameters too far from where they are believed to be.
fn strayed(shifts: &[(ParameterId, f64)]) -> Vec<String> {
    let far = shifts.iter().filter(|(_, shift)| shift.abs() > FAR_SHIFT);
    let mut reasons: Vec<String> =
        far.map(|(id, shift)| format!("{} would have to be {shift:.1} tolerances off", id.key())).collect();
    let together: f64 = shifts.iter().map(|(_, shift)| shift.powi(2)).sum();
    let count = shifts.len() as f64;
    if reasons.is_empty() && (together - count) / (2.0 * count).sqrt() > FAR_TOGETHER {
        reasons.push(format!(
            "the parameters together would have to be further off than their tolerances allow \
             (sum of squares {together:.0} for {count} of them)"
        ));
    }
    reasons
}

/// The verdict and its reasons.
pub(super) fn judge(found: &Settled, lack: &LackOfFit, after: &Comparison) -> (Verdict, Vec<String>) {
    let mut reasons = strayed(&shifts(&found.fit));
    if let Some(excess) = lack.excess() {
        let over = if excess.average_s > 0.0 {
            format!("averages of the error over {:.0} ms are", excess.average_s * 1e3)
        } else {
            "the error is".to_owned()
        };
        let than = match found.scatter.origin {
            Origin::Unknown => "noise allows",
            Origin::Repeats | Origin::Supposed => "noise and scatter between strokes allow",
        };
        reasons.push(format!("{over} {:.2} times larger than {than}", excess.mean_square.sqrt()));
        reasons.extend(after.words().into_iter().map(|words| format!("still wrong, {words}")));
    }
    if !reasons.is_empty() {
        return (Verdict::BeyondTolerance, reasons);
    }
    let reason = match found.scatter.origin {
        Origin::Repeats => "calibration and repeatability explain everything".to_owned(),
        Origin::Unknown => "calibration within the tolerances explains everything; without repeated strokes, \
                            scatter from stroke to stroke is unknown"
            .to_owned(),
        Origin::Supposed => format!(
            "calibration within the tolerances explains everything if single strokes differ by {}; none was \
             repeated: repeat one three times or more to see whether they do",
            found.scatter.words()
        ),
    };
    (Verdict::Explained, vec![reason])
}

/// Whether no parameter had to go further than its tolerance lets it.
pub fn is_within_tolerances(fit: &Fit) -> bool {
    strayed(&shifts(fit)).is_empty()
}

/// How far every parameter moved, in tolerances.
fn shifts(fit: &Fit) -> Vec<(ParameterId, f64)> {
    let moved = fit.space.coordinates.iter().zip(&fit.u);
    moved
        .filter_map(|(coordinate, u)| match coordinate.target {
            Target::Base(id) => Some((id, *u)),
            _ => None,
        })
        .collect()
}
