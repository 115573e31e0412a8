//! From the codes of a converter to what they measure, where a file has the codes.

use super::segment::{Properties, Property};

/// The input of a scale that takes the codes themselves.
const CODES: f64 = 4_294_967_295.0;

/// Polynomials, one after the other, each with its lowest coefficient first.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Scale(Vec<Vec<f64>>);

impl Scale {
    /// The scaled value.
    pub fn of(&self, code: f64) -> f64 {
        self.0.iter().fold(code, |input, coefficients| {
            coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * input + coefficient)
        })
    }
}

/// The scale in a channel's properties, else in those of its group or the file; none leaves values as they are.
///
/// # Errors
/// What stands there, if it is neither linear nor a polynomial.
pub(super) fn of(own: &Properties, above: &[&Properties]) -> Result<Scale, String> {
    for properties in [own].iter().chain(above) {
        let number = |name: String| properties.get(&name).and_then(Property::number);
        let count = number("NI_Number_Of_Scales".to_owned()).unwrap_or(0.0);
        let scaled = properties.get("NI_Scaling_Status").and_then(Property::text) == Some("scaled");
        if count < 1.0 || scaled {
            continue;
        }
        // From the last scale back to the codes.
        let (mut chain, mut scale) = (Vec::new(), count - 1.0);
        while scale != CODES {
            let name = |what: &str| format!("NI_Scale[{scale}]_{what}");
            let lacking = |what: &str| format!("a scale without {}", name(what));
            let kind = properties.get(&name("Scale_Type")).and_then(Property::text);
            let kind = kind.ok_or_else(|| lacking("Scale_Type"))?;
            let coefficients = match kind {
                "Linear" => ["Linear_Y_Intercept", "Linear_Slope"]
                    .map(|what| number(name(what)).ok_or_else(|| lacking(what)))
                    .into_iter()
                    .collect::<Result<Vec<_>, _>>()?,
                "Polynomial" => {
                    let size = number(name("Polynomial_Coefficients_Size")).unwrap_or(4.0);
                    let coefficient = |index: usize| number(name(&format!("Polynomial_Coefficients[{index}]")));
                    let found = (0..).map_while(coefficient).collect::<Vec<_>>();
                    if found.len() as f64 != size {
                        return Err(lacking("Polynomial_Coefficients"));
                    }
                    found
                }
                "AdvancedAPI" => vec![0.0, 1.0],
                other => return Err(format!("values to be scaled by the kind \"{other}\"")),
            };
            chain.push(coefficients);
            let input = number(name(&format!("{kind}_Input_Source"))).unwrap_or(CODES);
            if input != CODES && !(input >= 0.0 && input < scale) {
                return Err(format!("a scale that takes its input from scale {input}"));
            }
            scale = input;
        }
        chain.reverse();
        return Ok(Scale(chain));
    }
    Ok(Scale::default())
}
