//! The user's own formulas.

use valve_model::custom::{Formula, Variables};

/// Names that a formula may use beside those of the valve.
const PARAMETERS: [&str; 2] = ["c", "k2"];

/// Looks at an input.
pub fn look(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let formula = match Formula::parse(&text, &PARAMETERS) {
        Ok(formula) => formula,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return;
        }
    };
    assert_eq!(formula.source(), text);
    let operands = formula.operands([0.5, -3.0]);
    let again = Formula::parse(&text, &PARAMETERS).expect("it was one before");
    for values in [[0.01, 0.2, 3e5, 4e5, 6e5, 1e5, 0.3, 0.02], [0.0; 8], [-1.0; 8], [f64::MAX; 8], [f64::NAN; 8]] {
        let variables = Variables { values: std::array::from_fn(|place| &values[place]) };
        let value: f64 = formula.evaluate(&variables, &operands);
        // The same formula has the same value, be it a number or none.
        assert_eq!(value.to_bits(), again.evaluate(&variables, &operands).to_bits());
    }
}
