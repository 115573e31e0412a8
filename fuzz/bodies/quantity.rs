//! Quantities.

use quantity::{Dimension, Quantity, format_si};

/// Looks at an input.
pub fn look(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    for dimension in Dimension::ALL {
        if let Ok(quantity) = Quantity::parse(&text, dimension) {
            let written = format_si(quantity.si(), quantity.unit());
            assert!(Quantity::parse(&written, dimension).is_ok(), "{written}");
        }
    }
}
