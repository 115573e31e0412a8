//! A rate of the equations that bounds the step, and the parameter that it comes of.

use crate::params::ParameterId;

/// A parameter of which a rate comes, and how that rate changes with it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cause {
    /// Its dotted key in the valve file.
    pub key: &'static str,
    /// Its value, SI.
    pub value: f64,
    /// The unit of that.
    pub unit: &'static str,
    /// The rate goes as this power of the parameter.
    pub power: f64,
    /// What could be changed instead.
    pub instead: &'static str,
}

impl Cause {
    /// A parameter of the base model.
    pub(crate) fn base(id: ParameterId, value: f64, power: f64, instead: &'static str) -> Self {
        Self { key: id.key(), value, unit: id.si_unit(), power, instead }
    }

    /// A parameter of an effect, which can be left out instead.
    pub(crate) fn effect(key: &'static str, value: f64, unit: &'static str, power: f64) -> Self {
        Self { key, value, unit, power, instead: "none of it" }
    }
}

/// A rate of the equations that bounds the step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Demand {
    /// The rate, 1/s.
    pub rate: f64,
    /// The largest product of rate and step.
    pub limit: f64,
    /// Where it comes from.
    pub cause: Cause,
}

/// The largest product of rate and step for a state that has to be followed, not just to stay stable.
pub(crate) const FOLLOWED_RATE: f64 = 1.8;
