//! Edits that keep the user's units, comments and order.

use checked_toml::{Document, Section};
use quantity::{Dimension, Quantity, Unit, format_number, format_si, format_si_like};
use valve_model::custom::CustomEffect;
use valve_model::effects::{DefaultValue, EffectParameter};
use valve_model::{Effect, EffectKind, ParameterId};

use crate::change::{Change, block_of, find_effect, quoted, replaced};
use crate::effects::identity;
use crate::{ValveFile, ValveFileError};

/// The unit in which a new value is written, by its SI unit.
fn handy_unit(si_unit: &str) -> &str {
    match si_unit {
        "m" => "mm",
        "m2" => "mm2",
        "m3" => "cm3",
        "s" => "ms",
        "Pa" => "kPa",
        "Pa s/kg" => "MPa s/kg",
        other => other,
    }
}

/// A value of an effect's parameter as TOML, in the unit that stands there already or in a handy one.
fn effect_value(si: f64, parameter: &EffectParameter, earlier: Option<&str>) -> String {
    let unit = earlier
        .and_then(|text| Quantity::parse(text, Dimension::of_si_unit(parameter.si_unit)?).ok())
        .map(|quantity| quantity.unit().clone())
        .or_else(|| Unit::parse(handy_unit(parameter.si_unit)).ok());
    match unit {
        Some(unit) if !parameter.si_unit.is_empty() => quoted(&format_si(si, &unit)),
        _ => format_number(si),
    }
}

/// The text with a line at the end of a table.
fn with_line(document: &Document, section: &Section<'_>, line: &str) -> String {
    let end = document.whole_lines(&section.span()).end;
    let gap = if document.text()[..end].ends_with('\n') { "" } else { "\n" };
    replaced(document.text(), end..end, &format!("{gap}{line}"))
}

/// The text with another value of one parameter, and the change.
fn with_value(
    document: &Document,
    id: ParameterId,
    si_value: f64,
    ambient_pressure_pa: f64,
) -> Result<(String, Change), ValveFileError> {
    let root = document.root();
    let missing = || root.missing(id.key(), "a value to change");
    let section = root.section(id.section())?.ok_or_else(missing)?;
    let Some(span) = section.value_span(id.name()) else {
        if id.default_value().is_none() {
            return Err(missing().into());
        }
        let value = format!("{} {}", format_number(si_value), id.si_unit());
        let text = with_line(document, &section, &format_line(id.name(), &quoted(value.trim_end())));
        return Ok((text, Change::Parameter { key: id.key().to_owned(), was: None }));
    };
    let dimension = Dimension::of_si_unit(id.si_unit()).unwrap_or(Dimension::Pure);
    let earlier = section.text(id.name(), "").ok().flatten();
    let value = match earlier.and_then(|text| Quantity::parse(text, dimension).ok()) {
        Some(earlier) => quoted(&format_si_like(si_value, &earlier, ambient_pressure_pa)),
        None => format_number(si_value),
    };
    let was = document.text()[span.clone()].to_owned();
    Ok((replaced(document.text(), span, &value), Change::Parameter { key: id.key().to_owned(), was: Some(was) }))
}

impl ValveFile {
    /// A new text with its pending edits, checked.
    fn edited(&self, text: &str, changes: Vec<Change>) -> Result<Self, ValveFileError> {
        let mut edited = Self::parse(text, self.file_name())?;
        edited.pending.clone_from(&self.pending);
        edited.pending.extend(changes);
        Ok(edited)
    }

    /// Sets one parameter, SI (pressures absolute), in the unit that the file uses for it and to
    /// seven digits. A gauge supply pressure stays the same gauge pressure when the ambient pressure changes.
    pub fn with_parameter(&self, id: ParameterId, si_value: f64) -> Result<Self, ValveFileError> {
        self.with_parameters(&[(id, si_value)])
    }

    /// Sets several parameters, SI (pressures absolute). Where the ambient pressure is among them,
    /// a supply pressure that the file writes as gauge is written over the new one.
    pub fn with_parameters(&self, values: &[(ParameterId, f64)]) -> Result<Self, ValveFileError> {
        let now = self.valve.parameters();
        let ambient = values.iter().find(|(id, _)| *id == ParameterId::AmbientPressure);
        let ambient_pressure_pa = ambient.map_or(now.ambient_pressure_pa, |(_, value)| *value);
        let mut document = self.document.clone();
        let mut changes = Vec::new();
        for &(id, value) in values {
            let ambient_moves = ambient_pressure_pa != now.ambient_pressure_pa;
            if now.get(id) == value && !(ambient_moves && id == ParameterId::SupplyPressure) {
                continue;
            }
            let (text, change) = with_value(&document, id, value, ambient_pressure_pa)?;
            changes.push(change);
            document = Document::parse(&text, self.file_name())?;
        }
        self.edited(document.text(), changes)
    }

    /// Adds an effect of the catalogue, or gives the one that is there other values. New values
    /// come in handy units; parameters at their default are left out.
    pub fn with_effect(&self, effect: &Effect) -> Result<Self, ValveFileError> {
        if self.valve.effects().iter().any(|other| other.kind() == effect.kind()) {
            return self.with_effect_values(effect);
        }
        let mut block = format!("[[effect]]\nkind = {}\n", quoted(effect.kind().id()));
        for (index, parameter) in effect.kind().parameters().iter().enumerate() {
            let value = effect.values()[index];
            let default = match parameter.default {
                DefaultValue::Required => None,
                DefaultValue::Value(default) => Some(default),
                DefaultValue::SameAs(other) => Some(effect.values()[other]),
            };
            if default != Some(value) {
                block.push_str(&format_line(parameter.name, &effect_value(value, parameter, None)));
            }
        }
        self.with_block(&block, effect.kind().id())
    }

    fn with_effect_values(&self, effect: &Effect) -> Result<Self, ValveFileError> {
        let kind = effect.kind();
        let present = self.valve.effects().iter().find(|other| other.kind() == kind);
        let mut document = self.document.clone();
        let mut changes = Vec::new();
        for (index, parameter) in kind.parameters().iter().enumerate() {
            let value = effect.values()[index];
            let Some(section) = find_effect(&document, kind.id()) else { break };
            let span = section.value_span(parameter.name);
            let follows = matches!(parameter.default, DefaultValue::SameAs(other) if effect.values()[other] == value);
            let unchanged = present.is_some_and(|present| present.values()[index] == value);
            // A value left out that follows another one stays left out as long as it does.
            if if span.is_none() && matches!(parameter.default, DefaultValue::SameAs(_)) { follows } else { unchanged }
            {
                continue;
            }
            let (text, was) = if let Some(span) = span {
                let earlier = section.text(parameter.name, "").ok().flatten();
                let was = document.text()[span.clone()].to_owned();
                (replaced(document.text(), span, &effect_value(value, parameter, earlier)), Some(was))
            } else {
                let line = format_line(parameter.name, &effect_value(value, parameter, None));
                (with_line(&document, &section, &line), None)
            };
            changes.push(Change::EffectParameter { effect: kind.id().to_owned(), key: parameter.name.to_owned(), was });
            // Half of the values new and half old need not be a possible effect, but it is always TOML.
            document = Document::parse(&text, self.file_name())?;
        }
        self.edited(document.text(), changes)
    }

    /// Adds a custom effect, or puts it in the place of the one of the same name.
    pub fn with_custom(&self, effect: &CustomEffect) -> Result<Self, ValveFileError> {
        let present = self.valve.custom().iter().find(|other| other.name() == effect.name());
        if present == Some(effect) {
            return Ok(self.clone());
        }
        let file = if present.is_some() { self.without_custom(effect.name())? } else { self.clone() };
        let mut block = format!(
            "[[effect]]\nkind = \"custom\"\nname = {}\nacts_on = {}\nformula = {}\n",
            quoted(effect.name()),
            quoted(effect.target().id()),
            quoted(effect.formula().source()),
        );
        if !effect.parameters().is_empty() {
            block.push_str("[effect.parameters]\n");
        }
        for parameter in effect.parameters() {
            let number = |si: f64| match Unit::parse(&parameter.unit) {
                Ok(unit) => format_number(unit.from_si(si)),
                Err(_) => format_number(si),
            };
            let value = format!(
                "{{ start = {}, lower = {}, upper = {}, unit = {} }}",
                number(parameter.value),
                number(parameter.lower),
                number(parameter.upper),
                quoted(&parameter.unit),
            );
            block.push_str(&format_line(&parameter.name, &value));
        }
        file.with_block(&block, effect.name())
    }

    /// Takes an effect of the catalogue out.
    pub fn without_effect(&self, kind: EffectKind) -> Result<Self, ValveFileError> {
        self.without(kind.id())
    }

    /// Takes a custom effect out.
    pub fn without_custom(&self, name: &str) -> Result<Self, ValveFileError> {
        self.without(name)
    }

    /// Adds an `[[effect]]` table, before the history where there is one.
    fn with_block(&self, block: &str, effect: &str) -> Result<Self, ValveFileError> {
        let history = self.document.root().sections("history")?;
        let at = history.first().map_or(self.text().len(), |first| block_of(&self.document, first).start);
        let gap = if self.text()[..at].ends_with('\n') { "\n" } else { "\n\n" };
        let text = replaced(self.text(), at..at, &format!("{gap}{block}"));
        self.edited(&text, vec![Change::Added { effect: effect.to_owned() }])
    }

    fn without(&self, effect: &str) -> Result<Self, ValveFileError> {
        let Some(section) = find_effect(&self.document, effect) else {
            let sections = self.document.root().sections("effect")?;
            let names: Vec<String> = sections.iter().filter_map(identity).collect();
            return Err(ValveFileError::NoSuchEffect {
                file: self.file_name().to_owned(),
                effect: effect.to_owned(),
                present: if names.is_empty() { "none".into() } else { names.join(", ") },
            });
        };
        let block = block_of(&self.document, &section);
        let removed = self.text()[block.clone()].to_owned();
        let change = Change::Removed { text: removed, line: self.document.line_of(block.start) };
        self.edited(&replaced(self.text(), block, ""), vec![change])
    }
}

fn format_line(key: &str, value: &str) -> String {
    format!("{key} = {value}\n")
}
