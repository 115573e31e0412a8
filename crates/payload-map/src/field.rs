//! A field of a payload, and what may stand in it.

use prognoser::fields;
use quantity::Unit;
use serde_json::{Map, Value};

use crate::error::PayloadError;

/// What a stroke time may be.
const TIME: &str =
    "a time from 0 to 86400 s, null if it was not measured, or \"stalled\" if the valve did not get there";
/// What a condition may be.
pub(crate) const CONDITION: &str = "a number, or null if it is not known";
/// What a cycle may be.
const CYCLE: &str = "a cycle number";

/// A payload.
pub(crate) type Object = Map<String, Value>;

/// A field of a payload.
#[derive(Debug, Clone)]
pub(crate) struct Field {
    /// The name of a field, or a JSON pointer (RFC 6901) that begins with a slash.
    name: String,
    unit: In,
}

/// What a field is measured in.
#[derive(Debug, Clone)]
pub(crate) enum In {
    /// SI, or nothing at all.
    Si,
    /// A unit, and what its zero counts from.
    Unit { unit: Unit, zero: f64 },
}

impl In {
    fn si(&self, number: f64) -> f64 {
        match self {
            Self::Si => number,
            Self::Unit { unit, zero } => unit.to_si(number) + zero,
        }
    }
}

impl Field {
    pub(crate) fn named(name: &str, unit: In) -> Self {
        Self { name: name.to_owned(), unit }
    }

    fn find<'a>(&self, object: &'a Object) -> Option<&'a Value> {
        let Some(pointer) = self.name.strip_prefix('/') else { return object.get(&self.name) };
        // The first step is taken here, as the object is no longer a value.
        let (first, rest) = pointer.find('/').map_or((pointer, ""), |slash| pointer.split_at(slash));
        object.get(&first.replace("~1", "/").replace("~0", "~"))?.pointer(rest)
    }

    fn found<'a>(&self, object: &'a Object, expected: &'static str) -> Result<&'a Value, PayloadError> {
        self.find(object).ok_or_else(|| PayloadError::Missing { field: self.name.clone(), expected })
    }

    pub(crate) fn wrong(&self, value: &Value, expected: &'static str) -> PayloadError {
        let found = match value {
            Value::String(text) => format!("{:?}", shortened(text)),
            Value::Number(number) => shortened(&number.to_string()),
            other => kind(other).to_owned(),
        };
        PayloadError::Kind { field: self.name.clone(), found, expected }
    }

    pub(crate) fn label(&self, object: &Object, expected: &'static str) -> Result<String, PayloadError> {
        match self.found(object, expected)? {
            Value::String(text) => Ok(text.clone()),
            Value::Number(number) if number.is_u64() => Ok(number.to_string()),
            other => Err(self.wrong(other, expected)),
        }
    }

    pub(crate) fn cycle(&self, object: &Object) -> Result<u64, PayloadError> {
        Ok(match self.found(object, CYCLE)? {
            // As text, so that no digit is rounded away.
            Value::Number(number) if !number.is_f64() => fields::cycle_of_text(&number.to_string())?,
            Value::Number(number) => fields::cycle_of_number(number.as_f64().unwrap_or(f64::NAN))?,
            Value::String(text) => fields::cycle_of_text(text.trim())?,
            other => return Err(self.wrong(other, CYCLE)),
        })
    }

    pub(crate) fn stroke(
        &self,
        object: &Object,
        column: &'static str,
        empty_is_stalled: bool,
    ) -> Result<fields::StrokeField, PayloadError> {
        let value = self.found(object, TIME)?;
        let number = match value {
            Value::Null => f64::NAN,
            Value::Number(number) => self.unit.si(number.as_f64().unwrap_or(f64::NAN)),
            Value::String(text) => match fields::stroke_of_text(column, text.trim(), empty_is_stalled)? {
                fields::StrokeField { time_s: Some(number), .. } => self.unit.si(number),
                told => return Ok(told),
            },
            other => return Err(self.wrong(other, TIME)),
        };
        // What is infinite in SI was a number too large, and no word for a stroke that did not arrive.
        let stroke = if number == f64::INFINITY {
            None
        } else {
            fields::stroke_of_number(column, number, empty_is_stalled).ok()
        };
        stroke.ok_or_else(|| self.wrong(value, TIME))
    }

    pub(crate) fn condition(&self, object: &Object) -> Result<Option<f64>, PayloadError> {
        let number = match self.find(object) {
            None | Some(Value::Null) => return Ok(None),
            Some(value) => number_of(value).ok_or_else(|| self.wrong(value, CONDITION))?,
        };
        let si = self.unit.si(number);
        if si.is_finite() && si > 0.0 {
            Ok(Some(si))
        } else {
            let found = shortened(&number.to_string());
            let expected = "a value above vacuum or absolute zero in the unit of the map";
            Err(PayloadError::Kind { field: self.name.clone(), found, expected })
        }
    }

    pub(crate) fn time(&self, object: &Object) -> Result<Option<String>, PayloadError> {
        match self.find(object) {
            None | Some(Value::Null) => Ok(None),
            Some(Value::String(text)) if !text.contains(char::is_control) => Ok(Some(text.clone())),
            Some(other) => Err(self.wrong(other, "a time of RFC 3339, such as \"2026-01-31T06:00:00Z\"")),
        }
    }
}

pub(crate) fn number_of(value: &Value) -> Option<f64> {
    match value {
        Value::Number(number) => number.as_f64(),
        // A number that ends in a point was cut off.
        Value::String(text) if !text.ends_with('.') => {
            text.trim().parse().ok().filter(|number: &f64| number.is_finite())
        }
        _ => None,
    }
}

pub(crate) fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "a number",
        Value::String(_) => "a text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}

/// A text for a message: not too long.
fn shortened(text: &str) -> String {
    const SHOWN: usize = 40;
    if text.chars().count() <= SHOWN {
        text.to_owned()
    } else {
        text.chars().take(SHOWN).chain("...".chars()).collect()
    }
}
