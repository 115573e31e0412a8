//! What a table is built from: the model and how accurate the table shall be.

use valve_model::{Limits, Schedule, Valve};

use crate::error::BuildError;

/// Changes when the builder writes other tables for the same model.
const BUILDER_VERSION: u32 = 1;

/// A valve and its cycle, as a valve file gives them.
#[derive(Debug, Clone, Copy)]
pub struct TableModel<'a> {
    /// The valve's name, for the manifest.
    pub name: &'a str,
    /// Everything that decides a stroke time, in one text; its hash goes into the manifest.
    pub canonical_text: &'a str,
    /// The valve; it is simulated at its own supply pressure and temperature.
    pub valve: &'a Valve,
    /// The cycle that is repeated.
    pub schedule: Schedule,
    /// The longest acceptable stroke times.
    pub limits: Limits,
}

/// The hash in the manifest: of the canonical text of the model and of its limits, in hexadecimal.
///
/// Compare it with [`TableBundle::read_for_model`](leak_table::TableBundle::read_for_model) to tell
/// whether tables belong to a valve file. How accurately they were built does not enter.
#[must_use]
pub fn model_hash(canonical_text: &str, limits: &Limits) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(format!("leak tables {BUILDER_VERSION}\n").as_bytes());
    hasher.update(format!("limits {:e} {:e}\n", limits.close_within_s, limits.open_within_s).as_bytes());
    hasher.update(canonical_text.as_bytes());
    hasher.finalize().to_hex().to_string()
}

/// How accurate the tables shall be. The tolerances are those of valves whose quicker stroke takes up to two seconds while they
/// are sound; for slower ones they grow in proportion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// The integrator's step, s.
    pub step_s: f64,
    /// Largest interpolation error up to the limit, s. Points are placed to half of it where it is
    /// measured, so that it holds between the measurements as well.
    pub tolerance_up_to_limit_s: f64,
    /// The same beyond the limit, s.
    pub tolerance_beyond_s: f64,
    /// Largest error of a table over conditions up to the limit, s, wherever it is measured.
    pub tolerance_over_conditions_s: f64,
    /// The same beyond the limit, s.
    pub tolerance_over_conditions_beyond_s: f64,
    /// Cycles after which a valve must have become periodic.
    pub most_cycles: usize,
    /// Points of a table.
    pub most_points: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            step_s: valve_model::simulate::DEFAULT_STEP_S,
            tolerance_up_to_limit_s: 0.2e-3,
            tolerance_beyond_s: 2e-3,
            tolerance_over_conditions_s: 0.5e-3,
            tolerance_over_conditions_beyond_s: 5e-3,
            most_cycles: 40,
            most_points: 2000,
        }
    }
}

impl Options {
    pub(crate) fn check(&self) -> Result<(), BuildError> {
        let positive = |name, value: f64| {
            if value > 0.0 && value.is_finite() {
                return Ok(());
            }
            Err(BuildError::Option { name, found: value, expected: "a time in s above 0" })
        };
        positive("step", self.step_s)?;
        positive("tolerance up to the limit", self.tolerance_up_to_limit_s)?;
        positive("tolerance beyond the limit", self.tolerance_beyond_s)?;
        positive("tolerance over conditions", self.tolerance_over_conditions_s)?;
        positive("tolerance over conditions beyond the limit", self.tolerance_over_conditions_beyond_s)?;
        let at_least = |name, value: usize, least: usize, expected| {
            if value >= least {
                return Ok(());
            }
            Err(BuildError::Option { name, found: value as f64, expected })
        };
        at_least("most cycles", self.most_cycles, 2, "at least 2")?;
        at_least("most points", self.most_points, 4, "at least 4")
    }
}
