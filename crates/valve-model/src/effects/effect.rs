//! An effect with its parameter values, checked.

use super::info::{DefaultValue, EffectKind, MAX_EFFECT_PARAMETERS, Search};
use crate::params::ParameterError;

/// An effect with its parameter values, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effect {
    kind: EffectKind,
    values: [f64; MAX_EFFECT_PARAMETERS],
}

impl Effect {
    /// An effect from the values given; `None` takes the parameter's default.
    /// Fails when a required value is missing or a value is impossible.
    pub fn new(kind: EffectKind, given: &[Option<f64>]) -> Result<Self, ParameterError> {
        let mut values = [0.0; MAX_EFFECT_PARAMETERS];
        for (index, parameter) in kind.parameters().iter().enumerate() {
            values[index] = match (given.get(index).copied().flatten(), parameter.default) {
                (Some(value), _) | (None, DefaultValue::Value(value)) => value,
                (None, DefaultValue::SameAs(other)) => values[other],
                (None, DefaultValue::Required) => {
                    return Err(ParameterError::Inconsistent {
                        key: format!("effect.{}.{}", kind.id(), parameter.name),
                        found: "nothing".into(),
                        expected: format!("a quantity in {} ({})", parameter.si_unit, parameter.meaning),
                    });
                }
            };
        }
        let effect = Self { kind, values };
        effect.check()?;
        Ok(effect)
    }

    /// Which effect it is.
    #[must_use]
    pub fn kind(&self) -> EffectKind {
        self.kind
    }

    /// The values of its parameters, SI, in the order of [`EffectKind::parameters`].
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values[..self.kind.parameters().len()]
    }

    /// The value of each refinement that is not at its default is part of what the effect is; the others need not
    /// be mentioned. Whether the parameter with this index must be.
    #[must_use]
    pub fn is_told(&self, index: usize) -> bool {
        let parameter = &self.kind.parameters()[index];
        !parameter.is_refinement() || parameter.default != DefaultValue::Value(self.values[index])
    }

    /// Whether it changes nothing: every size that it has is neutral.
    #[must_use]
    pub fn is_neutral(&self) -> bool {
        let neutral = self.kind.info().neutral;
        self.kind.parameters().iter().zip(self.values()).all(|(one, value)| !one.is_size() || *value == neutral)
    }

    /// Checks that every value is possible.
    pub fn check(&self) -> Result<(), ParameterError> {
        let (parameters, values) = (self.kind.parameters(), self.values());
        let error = |index: usize, expected: String| {
            let key = format!("effect.{}.{}", self.kind.id(), parameters[index].name);
            Err(ParameterError::OutOfDomain { key, value: values[index], unit: parameters[index].si_unit, expected })
        };
        let infinite_is_neutral = self.kind.info().neutral.is_infinite();
        for (index, value) in values.iter().enumerate() {
            let allowed_infinite = infinite_is_neutral && index == 0 && *value == f64::INFINITY;
            if !value.is_finite() && !allowed_infinite {
                return error(index, "a finite value".into());
            }
        }
        for (index, (parameter, value)) in parameters.iter().zip(values).enumerate() {
            if let Search::ExcessOver { other, least, .. } = parameter.search
                && *value < values[other]
            {
                return error(index, format!("at least {least}; leave it out for the same"));
            }
        }
        for (index, (parameter, value)) in parameters.iter().zip(values).enumerate() {
            if !(parameter.allowed.contains)(*value) {
                return error(index, parameter.allowed.words.into());
            }
        }
        Ok(())
    }
}
