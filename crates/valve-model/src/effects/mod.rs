//! The catalogue of physical effects that can be added to the base model.
//!
//! One effect, one file: its law, its source, its parameters and its neutral
//! value. An effect that is absent or neutral changes nothing, bit for bit.
//! Effects add up and do not know of each other.

mod back_pressure;
mod clock_offset;
mod closing_cushion;
mod dry_friction;
mod gas_heating;
mod leaks;
mod opening_cushion;
mod orifice_law;
mod process_force;
mod progressive_spring;
mod scales;
mod seal_friction;
mod seat_adhesion;
mod sensor_lag;
mod solenoid_lag;
mod supply_droop;
mod vent_restriction;

use crate::params::{ParameterError, Parameters};

pub(crate) use dry_friction::BRISTLE_STIFFNESS_N_PER_M;

/// The largest number of parameters that an effect has.
pub const MAX_EFFECT_PARAMETERS: usize = 6;

macro_rules! catalogue {
    ($( $kind:ident => $info:expr; )*) => {
        /// Names an effect of the catalogue.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum EffectKind { $(
            #[doc = concat!("See `valve effects` and [`EffectInfo`]: `", stringify!($kind), "`.")]
            $kind,
        )* }

        impl EffectKind {
            /// Every effect of the catalogue, in its order.
            pub const ALL: &'static [Self] = &[ $( Self::$kind, )* ];

            /// What is known of the effect.
            #[must_use]
            pub fn info(self) -> &'static EffectInfo { match self { $( Self::$kind => &$info, )* } }
        }
    };
}

catalogue! {
    DryFriction => dry_friction::INFO;
    SealFriction => seal_friction::INFO;
    ProgressiveSpring => progressive_spring::INFO;
    ClosingCushion => closing_cushion::INFO;
    OpeningCushion => opening_cushion::INFO;
    SeatAdhesion => seat_adhesion::INFO;
    ProcessForce => process_force::INFO;
    GasHeating => gas_heating::INFO;
    SupplyDroop => supply_droop::INFO;
    VentRestriction => vent_restriction::INFO;
    BackPressure => back_pressure::INFO;
    OrificeLaw => orifice_law::INFO;
    LeakToAtmosphere => leaks::TO_ATMOSPHERE;
    LeakFromSupply => leaks::FROM_SUPPLY;
    SolenoidLag => solenoid_lag::INFO;
    SensorLag => sensor_lag::INFO;
    ClockOffset => clock_offset::INFO;
}

/// What stands in for a parameter that the valve file leaves out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DefaultValue {
    /// It must be given.
    Required,
    /// This value, SI.
    Value(f64),
    /// The value of the parameter with this index of the same effect.
    SameAs(usize),
}

/// The range in which a parameter is sought, and a typical size, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitRange {
    /// Smallest physical value.
    pub lower: f64,
    /// A typical size for the valve at hand, clearly visible but not dominant.
    pub typical: f64,
    /// Largest value that still makes sense.
    pub upper: f64,
}

/// One parameter of an effect.
#[derive(Debug)]
pub struct EffectParameter {
    /// The key in the valve file.
    pub name: &'static str,
    /// SI unit of the value, empty for a pure number.
    pub si_unit: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// What stands in for it where it is left out.
    pub default: DefaultValue,
    /// A refinement stays at its default unless somebody asks for it: a search does not move it, and a valve file
    /// that does not mention it is as if there were no such parameter. Its typical value is its default.
    pub refinement: bool,
    /// Where to look for it on a given valve.
    pub range: fn(&Parameters) -> FitRange,
}

/// What an effect acts on; measurement effects change the record, not the valve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActsOn {
    /// Forces on the piston.
    Mechanics,
    /// Gas flows and pressures.
    Pneumatics,
    /// When and how the solenoid switches.
    Solenoid,
    /// Only what the recorder writes down.
    Measurement,
}

/// What is known of an effect.
#[derive(Debug)]
pub struct EffectInfo {
    /// Id in valve files and on the command line.
    pub id: &'static str,
    /// One line: what it is.
    pub summary: &'static str,
    /// The law, in plain text.
    pub equation: &'static str,
    /// What it does to a stroke.
    pub symptom: &'static str,
    /// Sizes met in practice, in words.
    pub typical_sizes: &'static str,
    /// Ids of the effects that look most alike in stroke data.
    pub confused_with: &'static [&'static str],
    /// Author, year.
    pub source: &'static str,
    /// What it acts on.
    pub acts_on: ActsOn,
    /// Its parameters; the first one is its size.
    pub parameters: &'static [EffectParameter],
    /// The value of the first parameter at which the effect is absent.
    pub neutral: f64,
}

impl EffectKind {
    /// Id in valve files and on the command line, such as "dry-friction".
    #[must_use]
    pub fn id(self) -> &'static str {
        self.info().id
    }

    /// The effect with this id, if the catalogue has it.
    #[must_use]
    pub fn from_id(id: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.id() == id)
    }

    /// The effect's parameters.
    #[must_use]
    pub fn parameters(self) -> &'static [EffectParameter] {
        self.info().parameters
    }
}

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
        !parameter.refinement || parameter.default != DefaultValue::Value(self.values[index])
    }

    /// Whether it changes nothing.
    #[must_use]
    pub fn is_neutral(&self) -> bool {
        match self.kind {
            EffectKind::SolenoidLag => self.values == [0.0; MAX_EFFECT_PARAMETERS],
            _ => self.values[0] == self.kind.info().neutral,
        }
    }

    /// Checks that every value is possible.
    pub fn check(&self) -> Result<(), ParameterError> {
        let error = |index: usize, expected: &str| {
            let parameter = &self.kind.parameters()[index];
            Err(ParameterError::OutOfDomain {
                key: format!("effect.{}.{}", self.kind.id(), parameter.name),
                value: self.values[index],
                unit: parameter.si_unit,
                expected: expected.into(),
            })
        };
        let values = self.values();
        let infinite_is_neutral = self.kind.info().neutral.is_infinite();
        for (index, value) in values.iter().enumerate() {
            let allowed_infinite = infinite_is_neutral && index == 0 && *value == f64::INFINITY;
            if !value.is_finite() && !allowed_infinite {
                return error(index, "a finite value");
            }
        }
        match self.kind {
            EffectKind::ProcessForce => (values[1] > 0.0).then_some(()).map_or_else(|| error(1, "more than 0"), Ok),
            EffectKind::ProgressiveSpring => {
                (values[0] > -1.0).then_some(()).map_or_else(|| error(0, "more than -1"), Ok)
            }
            EffectKind::ClockOffset => Ok(()),
            EffectKind::OrificeLaw => {
                (values[0] > 0.0 && values[0] < 1.0).then_some(()).map_or_else(|| error(0, "between 0 and 1"), Ok)
            }
            EffectKind::VentRestriction if values[0] == 0.0 => error(0, "more than 0"),
            EffectKind::DryFriction if values[1] < values[0] => {
                error(1, "at least the Coulomb force; leave it out for the same")
            }
            EffectKind::DryFriction if values[2] <= 0.0 => error(2, "more than 0"),
            EffectKind::DryFriction if values[3] <= 0.0 => error(3, "more than 0"),
            EffectKind::DryFriction if values[5].abs() > 2.0 => error(5, "between -2 and 2"),
            EffectKind::DryFriction => (values[0] >= 0.0 && values[4] >= 0.0)
                .then_some(())
                .map_or_else(|| error(if values[0] < 0.0 { 0 } else { 4 }, "0 or more"), Ok),
            EffectKind::ClosingCushion | EffectKind::OpeningCushion | EffectKind::SeatAdhesion if values[1] <= 0.0 => {
                error(1, "more than 0")
            }
            EffectKind::SupplyDroop | EffectKind::SealFriction if values[1] <= 0.0 => error(1, "more than 0"),
            _ => match values.iter().position(|value| *value < 0.0) {
                Some(index) => error(index, "0 or more"),
                None => Ok(()),
            },
        }
    }
}

const fn fixed(lower: f64, typical: f64, upper: f64) -> FitRange {
    FitRange { lower, typical, upper }
}
