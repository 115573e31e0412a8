//! A checked valve: parameters, switches and effects.

use crate::command::Solenoid;
use crate::custom::CustomEffect;
use crate::effects::{ActsOn, Effect};
use crate::measurement::Measurement;
use crate::params::{ParameterError, Parameters, Switches, check_parameters, check_switches};

/// A checked valve: only this can be simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Valve {
    parameters: Parameters,
    switches: Switches,
    effects: Vec<Effect>,
    custom: Vec<CustomEffect>,
}

impl Valve {
    /// Checks a parameter set and the effects added to it.
    pub fn new(
        parameters: Parameters,
        switches: Switches,
        effects: Vec<Effect>,
        custom: Vec<CustomEffect>,
    ) -> Result<Self, ParameterError> {
        check_parameters(&parameters)?;
        check_switches(switches)?;
        for (index, effect) in effects.iter().enumerate() {
            effect.check()?;
            if effects[..index].iter().any(|other| other.kind() == effect.kind()) {
                return Err(ParameterError::Inconsistent {
                    key: format!("effect.{}", effect.kind().id()),
                    found: "given twice".into(),
                    expected: "each effect of the catalogue at most once".into(),
                });
            }
        }
        for (index, effect) in custom.iter().enumerate() {
            if custom[..index].iter().any(|other| other.name() == effect.name()) {
                return Err(ParameterError::Inconsistent {
                    key: format!("effect.{}", effect.name()),
                    found: "two custom effects of this name".into(),
                    expected: "a name of its own for each custom effect".into(),
                });
            }
        }
        Ok(Self { parameters, switches, effects, custom })
    }

    /// The base parameters.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The limit switches.
    #[must_use]
    pub fn switches(&self) -> Switches {
        self.switches
    }

    /// The effects of the catalogue that are added.
    #[must_use]
    pub fn effects(&self) -> &[Effect] {
        &self.effects
    }

    /// The user's own effects.
    #[must_use]
    pub fn custom(&self) -> &[CustomEffect] {
        &self.custom
    }

    /// How its solenoid follows a command.
    #[must_use]
    pub fn solenoid(&self) -> Solenoid {
        let mut solenoid = Solenoid::default();
        for effect in &self.effects {
            if let ActsOn::Solenoid(change) = effect.kind().info().acts_on {
                change(effect.values(), &mut solenoid);
            }
        }
        solenoid
    }

    /// What its effects say of the instruments that record it.
    #[must_use]
    pub fn measurement(&self) -> Measurement {
        let mut instruments = Measurement::default();
        for effect in &self.effects {
            if let ActsOn::Measurement(change) = effect.kind().info().acts_on {
                change(effect.values(), &mut instruments);
            }
        }
        instruments
    }
}
