//! The catalogue of physical effects that can be added to the base model.
//!
//! One effect, one file: its law in words, its source, its parameters with their ranges and how a search moves
//! them, its numbers, its term in the equations, and its test. The list below is all that has to know of it. A new
//! one starts as a copy of `template.rs`, and `docs/add-an-effect.md` goes through it.
//!
//! An effect that is absent or neutral changes nothing, bit for bit. Effects add up and do not know of each other.

mod assembly;
mod catalogue;
mod effect;
mod info;
mod scales;
mod shared;
mod term;
#[cfg(test)]
mod testing;

pub use assembly::Assembly;
pub use effect::Effect;
pub use info::{
    ActsOn, Allowed, DefaultValue, EffectInfo, EffectKind, EffectParameter, FitRange, MAX_EFFECT_PARAMETERS, Search,
};

pub(crate) use term::Moment;
use term::NoTerm;

catalogue::catalogue! {
    DRY_FRICTION => dry_friction,
    SEAL_FRICTION => seal_friction,
    PROGRESSIVE_SPRING => progressive_spring,
    CLOSING_CUSHION => closing_cushion,
    OPENING_CUSHION => opening_cushion,
    SEAT_ADHESION => seat_adhesion,
    PROCESS_FORCE => process_force,
    GAS_HEATING => gas_heating,
    SUPPLY_DROOP => supply_droop,
    VENT_RESTRICTION => vent_restriction,
    BACK_PRESSURE => back_pressure,
    ORIFICE_LAW => orifice_law,
    LEAK_TO_ATMOSPHERE => leak_to_atmosphere,
    LEAK_FROM_SUPPLY => leak_from_supply,
    SOLENOID_LAG => solenoid_lag,
    SENSOR_LAG => sensor_lag,
    CLOCK_OFFSET => clock_offset,
    #[cfg(test)]
    TEMPLATE => template,
}
