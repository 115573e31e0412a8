//! The user's own effect: a formula with named parameters.

mod formula;

pub use formula::{Formula, FormulaError, VARIABLE_NAMES, Variables};

use crate::params::ParameterError;

/// What a custom effect adds to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CustomTarget {
    /// A force on the piston, N, positive opens.
    Force,
    /// A friction force, N, opposes motion and holds at rest.
    Friction,
    /// A flow into the pipe, kg/s, positive fills.
    PipeFlow,
    /// A flow into the chamber, kg/s, positive fills.
    ChamberFlow,
}

impl CustomTarget {
    /// Every target.
    pub const ALL: [Self; 4] = [Self::Force, Self::Friction, Self::PipeFlow, Self::ChamberFlow];

    /// The word in the valve file: "force", "friction", "pipe-flow" or "chamber-flow".
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::Friction => "friction",
            Self::PipeFlow => "pipe-flow",
            Self::ChamberFlow => "chamber-flow",
        }
    }

    /// The target with this word.
    #[must_use]
    pub fn from_id(id: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|target| target.id() == id)
    }
}

/// A named parameter of a custom effect.
#[derive(Debug, Clone, PartialEq)]
pub struct CustomParameter {
    /// Name in the formula.
    pub name: String,
    /// Current value (the `start` of the valve file).
    pub value: f64,
    /// Smallest value that a fit may take.
    pub lower: f64,
    /// Largest value that a fit may take.
    pub upper: f64,
    /// Unit, as the user wrote it; the formula computes in SI.
    pub unit: String,
}

/// The user's own effect, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct CustomEffect {
    name: String,
    target: CustomTarget,
    formula: Formula,
    parameters: Vec<CustomParameter>,
}

impl CustomEffect {
    /// Checks the parameters and the names in the formula.
    pub fn new(
        name: impl Into<String>,
        target: CustomTarget,
        formula: &str,
        parameters: Vec<CustomParameter>,
    ) -> Result<Self, CustomError> {
        let name = name.into();
        for parameter in &parameters {
            let inside = parameter.lower <= parameter.value && parameter.value <= parameter.upper;
            if !inside || !parameter.value.is_finite() {
                return Err(CustomError::Parameter(ParameterError::Inconsistent {
                    key: format!("effect.{name}.{}", parameter.name),
                    found: format!("start {} in [{}, {}]", parameter.value, parameter.lower, parameter.upper),
                    expected: "lower <= start <= upper, all finite".into(),
                }));
            }
        }
        let names: Vec<&str> = parameters.iter().map(|parameter| parameter.name.as_str()).collect();
        let formula = Formula::parse(formula, &names).map_err(CustomError::Formula)?;
        Ok(Self { name, target, formula, parameters })
    }

    /// The user's name for it.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What it adds to.
    #[must_use]
    pub fn target(&self) -> CustomTarget {
        self.target
    }

    /// The formula.
    #[must_use]
    pub fn formula(&self) -> &Formula {
        &self.formula
    }

    /// Its parameters.
    #[must_use]
    pub fn parameters(&self) -> &[CustomParameter] {
        &self.parameters
    }

    /// What its formula is evaluated with.
    #[must_use]
    pub fn operands(&self) -> Vec<f64> {
        self.formula.operands(self.parameters.iter().map(|parameter| parameter.value))
    }

    /// The same effect with other parameter values, in order.
    #[must_use]
    pub fn with_values(&self, values: &[f64]) -> Self {
        let mut changed = self.clone();
        for (parameter, value) in changed.parameters.iter_mut().zip(values) {
            parameter.value = *value;
        }
        changed
    }
}

/// A custom effect that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CustomError {
    /// A parameter is wrong.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The formula is wrong.
    #[error(transparent)]
    Formula(FormulaError),
}
