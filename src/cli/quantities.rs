//! Options that are quantities with units.

use quantity::{Dimension, Quantity, QuantityError};

/// A leak area, m2.
pub fn area_m2(text: &str) -> Result<f64, String> {
    let area = si(text, Dimension::Area)?;
    if area >= 0.0 { Ok(area) } else { Err("an area cannot be negative".to_owned()) }
}

/// A duration above zero, s.
pub fn duration_s(text: &str) -> Result<f64, String> {
    let duration = si(text, Dimension::Time)?;
    if duration > 0.0 { Ok(duration) } else { Err("a time above zero is needed".to_owned()) }
}

/// A length above zero, m.
pub fn length_m(text: &str) -> Result<f64, String> {
    let length = si(text, Dimension::Length)?;
    if length > 0.0 { Ok(length) } else { Err("a length above zero is needed".to_owned()) }
}

/// A temperature, K.
pub fn temperature_k(text: &str) -> Result<f64, String> {
    si(text, Dimension::Temperature)
}

/// A pressure, which may be gauge: the valve file says what the atmosphere is.
pub fn pressure(text: &str) -> Result<Quantity, String> {
    Quantity::parse(text, Dimension::Pressure).map_err(|error| error.to_string())
}

fn si(text: &str, dimension: Dimension) -> Result<f64, String> {
    let quantity = Quantity::parse(text, dimension).map_err(|error: QuantityError| error.to_string())?;
    if quantity.si().is_finite() { Ok(quantity.si()) } else { Err(format!("{text:?} is not a finite value")) }
}
