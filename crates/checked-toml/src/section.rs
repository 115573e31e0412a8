//! One table of a TOML file.

use std::ops::Range;

use quantity::{Dimension, QuantityError, suggest};
use toml_edit::{Item, TableLike, Value};

use crate::{Document, Problem, Refusals, TomlFileError};

/// What kind of quantity a key wants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum QuantityKind {
    /// A value with this SI unit (as [`Dimension::si_unit`] spells it); a pressure must be absolute.
    Si(&'static str),
    /// A pressure, gauge or absolute; gauge counts from this ambient pressure, Pa.
    Pressure {
        /// Pa absolute.
        ambient_pressure_pa: f64,
    },
    /// A pressure above the atmosphere, or a difference.
    PressureDifference,
    /// A difference of temperatures: "5 degC" is 5 K.
    TemperatureDifference,
}

impl QuantityKind {
    fn dimension(self) -> Dimension {
        match self {
            Self::Si(unit) => Dimension::of_si_unit(unit).unwrap_or(Dimension::Pure),
            Self::Pressure { .. } | Self::PressureDifference => Dimension::Pressure,
            Self::TemperatureDifference => Dimension::Temperature,
        }
    }

    fn read(self, text: &str) -> Result<f64, QuantityError> {
        match self {
            Self::Si(unit) => quantity::si_value(text, unit),
            Self::Pressure { ambient_pressure_pa } => quantity::pressure_pa(text, ambient_pressure_pa),
            Self::PressureDifference => quantity::pressure_difference_pa(text),
            Self::TemperatureDifference => quantity::temperature_difference_k(text),
        }
    }
}

/// A table of a document, with its dotted name.
#[derive(Clone)]
pub struct Section<'a> {
    document: &'a Document,
    table: &'a dyn TableLike,
    path: String,
    start: usize,
}

impl<'a> Section<'a> {
    pub(crate) fn new(document: &'a Document, table: &'a dyn TableLike, path: String, start: usize) -> Self {
        Self { document, table, path, start }
    }

    /// The line at which the table begins, counted from 1.
    #[must_use]
    pub fn line(&self) -> usize {
        self.document.line_of(self.start)
    }

    /// The line of a key, or that of the table where the key is absent.
    #[must_use]
    pub fn line_of(&self, key: &str) -> usize {
        let span = self.table.get_key_value(key).and_then(|(key, item)| key.span().or_else(|| item.span()));
        self.document.line_of(span.map_or(self.start, |span| span.start))
    }

    /// The bytes of a key's value in the text.
    #[must_use]
    pub fn value_span(&self, key: &str) -> Option<Range<usize>> {
        self.table.get(key)?.as_value()?.span()
    }

    /// The bytes from the table's header to the end of its last value, tables within it included.
    #[must_use]
    pub fn span(&self) -> Range<usize> {
        let mut end = self.start + 1;
        for (key, item) in self.table.iter() {
            if let Some(span) = item.span() {
                end = end.max(span.end);
            }
            if let Some(inner) = item.as_table_like() {
                end = end.max(self.inner(key, inner, item.span()).span().end);
            }
        }
        self.start..end
    }

    /// Its keys, in the order of the file.
    #[must_use]
    pub fn keys(&self) -> Vec<&'a str> {
        self.table.iter().map(|(key, _)| key).collect()
    }

    /// Whether the key is there.
    #[must_use]
    pub fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// The key with its table, as in messages.
    #[must_use]
    pub fn dotted(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    /// Refuses keys other than these, all of them.
    pub fn allow_only(&self, known: &[&str]) -> Result<(), TomlFileError> {
        let mut refusals = Refusals::default();
        for (key, _) in self.table.iter().filter(|(key, _)| !known.contains(key)) {
            refusals.add(self.unknown(key, known));
        }
        refusals.none()
    }

    /// Refuses a table that has one of another kind's keys and none of its own.
    pub fn not_of_another_kind(
        &self,
        own: &[&str],
        theirs: &[&str],
        found: &str,
        expected: &str,
    ) -> Result<(), TomlFileError> {
        let Some(key) = theirs.iter().find(|key| self.has(key)).filter(|_| !own.iter().any(|key| self.has(key))) else {
            return Ok(());
        };
        let problem =
            Problem::AnotherKind { key: self.dotted(key), found: found.to_owned(), expected: expected.to_owned() };
        Err(self.document.error_at(self.line_of(key), problem))
    }

    /// The refusal of a key that is none of these.
    #[must_use]
    pub fn unknown(&self, key: &str, known: &[&str]) -> TomlFileError {
        let problem = Problem::UnknownKey {
            key: self.dotted(&key.chars().take(60).collect::<String>()),
            suggestion: suggest::did_you_mean(key, known.iter().copied()),
            known: known.join(", "),
        };
        self.document.error_at(self.line_of(key), problem)
    }

    /// The refusal of a table that lacks a key.
    #[must_use]
    pub fn missing(&self, key: &str, meaning: &str) -> TomlFileError {
        let problem = Problem::MissingKey { key: self.dotted(key), meaning: meaning.to_owned() };
        self.document.error_at(self.line(), problem)
    }

    /// The refusal of a key's value.
    #[must_use]
    pub fn wrong(&self, key: &str, found: impl Into<String>, expected: impl Into<String>) -> TomlFileError {
        let problem = Problem::WrongValue { key: self.dotted(key), found: found.into(), expected: expected.into() };
        self.document.error_at(self.line_of(key), problem)
    }

    fn inner(&self, key: &str, table: &'a dyn TableLike, span: Option<Range<usize>>) -> Section<'a> {
        Section::new(self.document, table, self.dotted(key), span.map_or(self.start, |span| span.start))
    }

    /// A table within this one.
    pub fn section(&self, key: &str) -> Result<Option<Section<'a>>, TomlFileError> {
        match self.table.get(key) {
            None => Ok(None),
            Some(item) => match item.as_table_like() {
                Some(table) => {
                    // A table that only stands for its inner ones has no place of its own.
                    let first = table.iter().next().and_then(|(name, _)| table.key(name)?.span());
                    Ok(Some(self.inner(key, table, item.span().or(first))))
                }
                None => Err(self.wrong(key, described(item), format!("a table, [{}]", self.dotted(key)))),
            },
        }
    }

    /// Every table of an array of tables; none where the key is absent.
    pub fn sections(&self, key: &str) -> Result<Vec<Section<'a>>, TomlFileError> {
        let wrong = |item| Err(self.wrong(key, described(item), format!("tables, [[{}]]", self.dotted(key))));
        match self.table.get(key) {
            None => Ok(Vec::new()),
            Some(Item::ArrayOfTables(tables)) => {
                Ok(tables.iter().map(|table| self.inner(key, table, table.span())).collect())
            }
            Some(item) => {
                let Some(array) = item.as_array() else { return wrong(item) };
                let tables =
                    array.iter().map(|value| value.as_inline_table().map(|table| self.inner(key, table, value.span())));
                tables.collect::<Option<Vec<_>>>().map_or_else(|| wrong(item), Ok)
            }
        }
    }

    fn value(&self, key: &str, expected: &str) -> Result<Option<&'a Value>, TomlFileError> {
        match self.table.get(key) {
            None => Ok(None),
            Some(Item::Value(value)) => Ok(Some(value)),
            Some(item) => Err(self.wrong(key, described(item), expected)),
        }
    }

    /// A text.
    pub fn text(&self, key: &str, expected: &str) -> Result<Option<&'a str>, TomlFileError> {
        let Some(value) = self.value(key, expected)? else { return Ok(None) };
        let text = value.as_str().ok_or_else(|| self.wrong(key, described_value(value), expected))?;
        // Names go to terminals and into pages, where such characters are commands.
        if text.chars().any(|letter| letter.is_control() && !"\n\t".contains(letter)) {
            return Err(self.wrong(key, format!("{text:?}"), "a text without control characters"));
        }
        Ok(Some(text))
    }

    /// True or false.
    pub fn boolean(&self, key: &str, expected: &str) -> Result<Option<bool>, TomlFileError> {
        let Some(value) = self.value(key, expected)? else { return Ok(None) };
        value.as_bool().map(Some).ok_or_else(|| self.wrong(key, described_value(value), expected))
    }

    /// A number without unit: TOML's own, or a text that holds one.
    pub fn number(&self, key: &str, expected: &str) -> Result<Option<f64>, TomlFileError> {
        let Some(value) = self.value(key, expected)? else { return Ok(None) };
        let number = match value {
            Value::Float(number) => Some(*number.value()),
            Value::Integer(number) => Some(*number.value() as f64),
            Value::String(text) => quantity::si_value(text.value(), "").ok(),
            _ => None,
        };
        number.map(Some).ok_or_else(|| self.wrong(key, described_value(value), expected))
    }

    /// A quantity, SI.
    pub fn quantity(&self, key: &str, kind: QuantityKind) -> Result<Option<f64>, TomlFileError> {
        let dimension = kind.dimension();
        if dimension == Dimension::Pure {
            return self.number(key, "a pure number");
        }
        let expected = format!("{}, a text such as \"1 {}\"", dimension.expectation(), dimension.units()[0]);
        let Some(text) = self.text(key, &expected)? else { return Ok(None) };
        kind.read(text).map(Some).map_err(|source| {
            self.document.error_at(self.line_of(key), Problem::Quantity { key: self.dotted(key), source })
        })
    }
}

impl std::fmt::Debug for Section<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "[{}] at {}:{}", self.path, self.document.file(), self.line())
    }
}

fn described(item: &Item) -> String {
    match item {
        Item::Value(value) => described_value(value),
        Item::ArrayOfTables(_) => "an array of tables".into(),
        _ => "a table".into(),
    }
}

fn described_value(value: &Value) -> String {
    match value {
        Value::String(text) => {
            let short: String = text.value().chars().take(60).collect();
            format!("the text \"{short}\"")
        }
        Value::Integer(number) => format!("the bare number {}", number.value()),
        Value::Float(number) => format!("the bare number {}", number.value()),
        Value::Boolean(truth) => truth.value().to_string(),
        Value::Datetime(_) => "a date".into(),
        Value::Array(_) => "a list".into(),
        Value::InlineTable(_) => "a table".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str =
        "name = \"a\"\n[gas]\ngamma = 1.4 # dry\nvolume = \"30 cm3\"\n\n[[run]]\nfile = 3\n[run.more]\nx = 1\n";

    fn document() -> Document {
        Document::parse(TEXT, "some.toml").unwrap()
    }

    #[test]
    fn values_come_in_si_and_with_their_lines() {
        let document = document();
        let gas = document.root().section("gas").unwrap().unwrap();
        assert_eq!(gas.number("gamma", "a ratio").unwrap(), Some(1.4));
        assert_eq!(gas.quantity("volume", QuantityKind::Si("m3")).unwrap(), Some(30e-6));
        assert_eq!((gas.line(), gas.line_of("volume")), (2, 4));
        let run = &document.root().sections("run").unwrap()[0];
        assert_eq!(&TEXT[document.whole_lines(&run.span())], "[[run]]\nfile = 3\n[run.more]\nx = 1\n");
    }

    #[test]
    fn refusals_name_file_line_and_what_is_right() {
        let document = document();
        let root = document.root();
        let gas = root.section("gas").unwrap().unwrap();
        let message = |error: TomlFileError| error.to_string();
        assert_eq!(
            message(gas.allow_only(&["gama", "volume"]).unwrap_err()),
            "some.toml:3: unknown key \"gas.gamma\" (did you mean \"gama\"?); expected one of gama, volume"
        );
        assert_eq!(
            message(gas.quantity("volume", QuantityKind::Si("s")).unwrap_err()),
            "some.toml:4: gas.volume: \"cm3\" is a unit of a volume; expected a time in s, ms, us or min"
        );
        assert_eq!(
            message(gas.quantity("gamma", QuantityKind::Si("kg")).unwrap_err()),
            "some.toml:3: gas.gamma is the bare number 1.4; expected a mass in kg, g or lb, a text such as \"1 kg\""
        );
        let run = &root.sections("run").unwrap()[0];
        assert_eq!(
            message(run.text("file", "a path").unwrap_err()),
            "some.toml:7: run.file is the bare number 3; expected a path"
        );
        assert_eq!(message(gas.missing("kappa", "a ratio")), "some.toml:2: \"gas.kappa\" is missing; expected a ratio");
        assert!(root.section("name").is_err() && root.sections("gas").is_err());
    }

    #[test]
    fn broken_text_is_refused_with_its_line() {
        let line = |text: &str| Document::parse(text, "f").unwrap_err();
        assert_eq!(line("a = 1\nb = = 2\n").line, 2);
        assert_eq!(line("a = 1\na = 2\n").line, 2);
        assert_eq!(*line(" \n").problem, Problem::Empty);
        let long = format!("a = 1\nb = \"{}\"", "x".repeat(10_000_000));
        let error = line(&long);
        assert!(error.line == 2 && matches!(*error.problem, Problem::LongLine { .. }));
    }
}
