//! How the remaining life is estimated, from the keywords of a call.

use std::path::PathBuf;

use prognoser::bayes::{BayesConfig, GrowthLaw, Noise, StartPrior};
use prognoser::{Learned, Method};
use pyo3::prelude::*;

use crate::error::refused;

/// The keywords.
pub struct Settings {
    /// "bayes" or "ols".
    pub method: String,
    /// Standard deviation of a time, s.
    pub noise_s: Option<f64>,
    /// "healthy" or "unknown".
    pub start: String,
    /// "linear", "exponential" or "auto".
    pub growth: Option<String>,
    /// Median cycles of a life.
    pub life_cycles: Option<f64>,
    /// Accepted probability that a valve fails before it is replaced.
    pub risk: f64,
    /// A file that `valve learn` wrote.
    pub prior: Option<PathBuf>,
}

impl Settings {
    /// The method with all its settings.
    pub fn method(&self) -> PyResult<Method> {
        let wrong = |name: &str, found: &str, expected: &str| {
            Err(refused(format!("{name}: found {found}, expected {expected}")))
        };
        if self.method == "ols" {
            let given =
                [self.noise_s.is_some(), self.growth.is_some(), self.life_cycles.is_some(), self.prior.is_some()];
            if given.contains(&true) || self.start != "healthy" {
                return wrong("method", "\"ols\" with noise or priors", "\"ols\" alone, or \"bayes\"");
            }
            return Ok(Method::Ols);
        }
        if self.method != "bayes" {
            return wrong("method", &format!("{:?}", self.method), "\"bayes\" or \"ols\"");
        }
        let mut config = match &self.prior {
            Some(path) => read_prior(path)?.config(),
            None => BayesConfig::default(),
        };
        if !(self.risk > 0.0 && self.risk < 1.0) {
            return wrong("risk", &self.risk.to_string(), "a probability between 0 and 1");
        }
        config.risk = self.risk;
        config.start = match self.start.as_str() {
            "healthy" => StartPrior::Healthy,
            "unknown" => StartPrior::Unknown,
            other => return wrong("start", &format!("{other:?}"), "\"healthy\" or \"unknown\""),
        };
        match self.noise_s {
            Some(sd_s) if sd_s > 0.0 && sd_s.is_finite() => config.noise = Noise::Known { sd_s },
            Some(other) => return wrong("noise_s", &other.to_string(), "a standard deviation above 0 s"),
            None => {}
        }
        match self.growth.as_deref() {
            None => {}
            Some("linear") => config.growth = GrowthLaw::Linear,
            Some("exponential") => config.growth = GrowthLaw::Exponential,
            Some("auto") => config.growth = GrowthLaw::Auto,
            Some(other) => return wrong("growth", &format!("{other:?}"), "\"linear\", \"exponential\" or \"auto\""),
        }
        match self.life_cycles {
            Some(cycles) if cycles > 0.0 && cycles.is_finite() => config.life_median_cycles = cycles,
            Some(other) => return wrong("life_cycles", &other.to_string(), "a number of cycles above 0"),
            None => {}
        }
        Ok(Method::Bayes(config))
    }
}

/// Reads what `valve learn` wrote.
fn read_prior(path: &PathBuf) -> PyResult<Learned> {
    let shown = path.display();
    let text = std::fs::read_to_string(path)?;
    let learned: Learned = toml_edit::de::from_str(&text)
        .map_err(|error| refused(format!("{shown}: is no prior as `valve learn` writes it: {error}")))?;
    learned.checked().map_err(|error| refused(format!("{shown}: {error}")))
}
