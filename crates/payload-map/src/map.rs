//! The file that says which field is what.

use checked_toml::{Document, Section, TomlFileError};
use quantity::{Dimension, Reference, Unit};

use crate::field::{Field, In};

/// Pressure of the standard atmosphere, which gauge pressures of a log count from.
const ATMOSPHERE_PA: f64 = 101_325.0;
/// The keys of the file.
const KEYS: [&str; 7] = ["valve", "cycle", "time", "close_time", "open_time", "supply_pressure", "temperature"];
/// What a field is called by.
const FIELD: &str =
    "the name of a field, such as \"count\", or a JSON pointer to one within others, such as \"/strokes/close\"";
/// What a field with a unit is called by.
const FIELD_WITH_UNIT: &str = "a field and its unit, such as { field = \"t_close\", unit = \"ms\" }";

/// Which field of a payload is what.
#[derive(Debug, Clone)]
pub struct PayloadMap {
    /// The valve's name, where the topic does not tell it.
    pub(crate) valve: Option<Field>,
    pub(crate) cycle: Field,
    pub(crate) close: Field,
    pub(crate) open: Field,
    pub(crate) time: Option<Field>,
    /// None: any field with the name of a log's column.
    pub(crate) conditions: Option<[Option<Field>; 2]>,
}

impl PayloadMap {
    /// Fields with the names of a timing log's columns.
    pub fn plain() -> Self {
        let [valve, cycle, close, open] = prognoser::fields::COLUMNS.map(|name| Field::named(name, In::Si));
        let time = Some(Field::named(prognoser::fields::TIME_COLUMN, In::Si));
        Self { valve: Some(valve), cycle, close, open, time, conditions: None }
    }

    /// Reads a map; `file` is its name in messages.
    ///
    /// # Errors
    /// With file and line, if a key is unknown, missing, or has a unit of something else.
    pub fn parse(text: &str, file: &str) -> Result<Self, TomlFileError> {
        let document = Document::parse(text, file)?;
        let root = document.root();
        root.allow_only(&KEYS)?;
        let name = |key| {
            let text = root.text(key, FIELD)?;
            text.map(|text| checked(&root, key, text).map(|text| Field::named(text, In::Si))).transpose()
        };
        let required = |key, meaning| name(key)?.ok_or_else(|| root.missing(key, meaning));
        let stroke = |key| measured(&root, key, Dimension::Time)?.ok_or_else(|| root.missing(key, FIELD_WITH_UNIT));
        Ok(Self {
            valve: name("valve")?,
            cycle: required("cycle", FIELD)?,
            close: stroke("close_time")?,
            open: stroke("open_time")?,
            time: name("time")?,
            conditions: Some([
                measured(&root, "supply_pressure", Dimension::Pressure)?,
                measured(&root, "temperature", Dimension::Temperature)?,
            ]),
        })
    }

    /// Whether payloads are to tell the valve's name if topics do not.
    pub fn names_valves(&self) -> bool {
        self.valve.is_some()
    }
}

/// A field with a unit.
fn measured(root: &Section<'_>, key: &str, dimension: Dimension) -> Result<Option<Field>, TomlFileError> {
    if !root.has(key) {
        return Ok(None);
    }
    let Some(section) = root.section(key)? else { return Ok(None) };
    section.allow_only(&["field", "unit"])?;
    let field = section.text("field", FIELD)?.ok_or_else(|| section.missing("field", FIELD))?;
    let field = checked(&section, "field", field)?;
    let expected = dimension.expectation();
    let text = section.text("unit", &expected)?.ok_or_else(|| section.missing("unit", &expected))?;
    let wrong = || section.wrong("unit", format!("{text:?}"), expected.clone());
    let unit = Unit::parse(text).map_err(|_| wrong())?;
    if !unit.measures(dimension) {
        return Err(wrong());
    }
    let zero_pa = match unit.reference() {
        Reference::Ambiguous => {
            return Err(section.wrong(
                "unit",
                format!("{text:?}"),
                format!("\"{text}g\" (gauge) or \"{text}a\" (absolute)"),
            ));
        }
        Reference::Gauge => ATMOSPHERE_PA,
        Reference::Absolute | Reference::Unstated => 0.0,
    };
    Ok(Some(Field::named(field, In::Unit { unit, zero: zero_pa })))
}

fn checked<'a>(section: &Section<'_>, key: &str, field: &'a str) -> Result<&'a str, TomlFileError> {
    if field.is_empty() { Err(section.wrong(key, "\"\"", FIELD)) } else { Ok(field) }
}
