//! Quantities with units as users write them ("75 psig", "25.4 mm"), to SI and back.
//!
//! This is the only place where units convert. Inside the project every value
//! is SI; the edges (valve file, campaign, command line, report) come here.
//!
//! A [`Unit`] is a product of known units with powers, such as `N s/m` or
//! `J/(kg K)`; spaces, `·`, `*`, `^2` and `²` are all understood. A [`Dimension`]
//! says what kind of quantity a key wants. Pressures know whether they count
//! from vacuum or from the atmosphere ([`Reference`]): 1 psi is 6894.757 Pa, a
//! gauge pressure needs an ambient pressure to become absolute, a bare `kPa`,
//! `MPa` or `Pa` is absolute, and a bare `psi` or `bar`, which could be either,
//! stands for differences alone.

mod atoms;
mod dimension;
mod error;
mod format;
mod parse;
mod reference;
pub mod suggest;
mod unit;

pub use dimension::Dimension;
pub use error::QuantityError;
pub use format::{format_number, format_si, format_si_like};
pub use parse::{
    Quantity, absolute_pressure_pa, pressure_difference_pa, pressure_pa, si_value, temperature_difference_k,
};
pub use reference::Reference;
pub use unit::Unit;
