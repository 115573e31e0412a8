//! How a degradation changes the model.

use leak_table::Degradation;
use valve_model::{Conditions, Effect, EffectKind, ParameterError, Parameters, Valve};

/// A degradation and what it does to a valve.
#[derive(Debug, Clone)]
pub struct Wear {
    /// What wears.
    pub degradation: Degradation,
    /// Severities (SI) up to which the end of the table is sought, one after the other.
    pub reach: fn(&Valve) -> Vec<f64>,
    /// Makes a sound valve one of this severity (SI). At 0 it must change nothing.
    pub apply: fn(&mut Worn, f64) -> Result<(), ParameterError>,
}

/// A valve and its conditions while something wears.
#[derive(Debug, Clone)]
pub struct Worn {
    /// The parameters of the valve.
    pub parameters: Parameters,
    /// The effects of the catalogue that it has.
    pub effects: Vec<Effect>,
    /// Its conditions, leaks among them.
    pub conditions: Conditions,
}

impl Worn {
    /// A value of an effect that the valve has: its first parameter.
    pub fn size_of(&self, kind: EffectKind) -> Option<f64> {
        self.effects.iter().find(|effect| effect.kind() == kind).map(|effect| effect.values()[0])
    }

    /// Replaces or adds an effect.
    pub fn set(&mut self, kind: EffectKind, values: &[Option<f64>]) -> Result<(), ParameterError> {
        let effect = Effect::new(kind, values)?;
        match self.effects.iter_mut().find(|other| other.kind() == kind) {
            Some(other) => *other = effect,
            None => self.effects.push(effect),
        }
        Ok(())
    }
}

impl Wear {
    /// The valve and its conditions at a severity.
    pub(crate) fn worn(
        &self,
        valve: &Valve,
        conditions: Conditions,
        severity: f64,
    ) -> Result<(Valve, Conditions), ParameterError> {
        let (parameters, effects) = (valve.parameters().clone(), valve.effects().to_vec());
        let mut worn = Worn { parameters, effects, conditions };
        (self.apply)(&mut worn, severity)?;
        let Worn { parameters, effects, conditions } = worn;
        Ok((Valve::new(parameters, valve.switches(), effects, valve.custom().to_vec())?, conditions))
    }
}
