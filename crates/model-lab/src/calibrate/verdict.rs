//! Whether tolerances, noise and repeatability explain a campaign, or something is missing.

use super::CalibratedParameter;
use super::repeatability::Repeatability;
use crate::compare::Comparison;
use crate::compare::averages::{LongAverage, long_averages};
use crate::data::{Dataset, RunData};
use crate::fit::Fit;
use crate::scatter::Scatter;

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
    pub(super) fn new(data: &Dataset, fit: &Fit, scatter: &Scatter, clean: &[f64]) -> Self {
        let readings = fit.residual.len();
        let chi2 = scatter.dot(&fit.residual, &fit.residual);
        let free = readings.saturating_sub(fit.u.len()).max(1);
        Self {
            chi2_per_reading: chi2 / free as f64,
            readings,
            averages: long_averages(&data.runs.iter().collect::<Vec<&RunData>>(), clean),
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

/// The verdict and its reasons.
pub(super) fn judge(
    parameters: &[CalibratedParameter],
    lack: &LackOfFit,
    after: &Comparison,
    repeatability: Option<&Repeatability>,
) -> (Verdict, Vec<String>) {
    let mut reasons = Vec::new();
    for parameter in parameters.iter().filter(|parameter| parameter.shift.abs() > FAR_SHIFT) {
        reasons.push(format!("{} would have to be {:.1} tolerances off", parameter.id.key(), parameter.shift));
    }
    let together: f64 = parameters.iter().map(|parameter| parameter.shift.powi(2)).sum();
    let count = parameters.len() as f64;
    if reasons.is_empty() && (together - count) / (2.0 * count).sqrt() > FAR_TOGETHER {
        reasons.push(format!(
            "the parameters together would have to be further off than their tolerances allow \
             (sum of squares {together:.0} for {count} of them)"
        ));
    }
    if let Some(excess) = lack.excess() {
        let over = if excess.average_s > 0.0 {
            format!("averages of the error over {:.0} ms are", excess.average_s * 1e3)
        } else {
            "the error is".to_owned()
        };
        let than = if repeatability.is_some() { "noise and scatter between strokes allow" } else { "noise allows" };
        reasons.push(format!("{over} {:.2} times larger than {than}", excess.mean_square.sqrt()));
        reasons.extend(after.words().into_iter().map(|words| format!("still wrong, {words}")));
    }
    if !reasons.is_empty() {
        return (Verdict::BeyondTolerance, reasons);
    }
    let reason = match repeatability {
        Some(_) => "calibration and repeatability explain everything",
        None => {
            "calibration within the tolerances explains everything; without repeated strokes, \
                 scatter from stroke to stroke is unknown"
        }
    };
    (Verdict::Explained, vec![reason.to_owned()])
}
