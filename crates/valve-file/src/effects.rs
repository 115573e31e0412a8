//! The `[[effect]]` tables.

use checked_toml::{Document, QuantityKind, Section};
use quantity::{Reference, Unit};
use valve_model::custom::{CustomEffect, CustomError, CustomParameter, CustomTarget};
use valve_model::effects::EffectParameter;
use valve_model::{Effect, EffectKind, ParameterError};

use crate::ValveFileError;

/// How the value of an effect's parameter is written.
pub(crate) fn quantity_kind(parameter: &EffectParameter) -> QuantityKind {
    // The catalogue's only pressure counts from the atmosphere.
    if parameter.si_unit == "Pa" { QuantityKind::PressureDifference } else { QuantityKind::Si(parameter.si_unit) }
}

/// The effects of the file, those of the catalogue and the user's own.
pub(crate) fn read(document: &Document) -> Result<(Vec<Effect>, Vec<CustomEffect>), ValveFileError> {
    let root = document.root();
    if root.value_span("effect").is_some() {
        return Err(root.wrong("effect", "a value", "tables, each headed [[effect]]").into());
    }
    let (mut catalogue, mut custom): (Vec<Effect>, Vec<CustomEffect>) = (Vec::new(), Vec::new());
    for section in root.sections("effect")? {
        let expected = "the id of an effect, such as \"dry-friction\", or \"custom\"";
        let id = section.text("kind", expected)?.ok_or_else(|| section.missing("kind", expected))?;
        if id == "custom" {
            let effect = read_custom(document, &section)?;
            if EffectKind::from_id(effect.name()).is_some() || effect.name() == "custom" {
                let expected = "a name that is no id of the catalogue";
                return Err(section.wrong("name", format!("\"{}\"", effect.name()), expected).into());
            }
            if custom.iter().any(|other| other.name() == effect.name()) {
                let found = format!("\"{}\" for a second time", effect.name());
                return Err(section.wrong("name", found, "a name of its own for each custom effect").into());
            }
            custom.push(effect);
        } else {
            let effect = read_catalogue(document, &section, id)?;
            if catalogue.iter().any(|other| other.kind() == effect.kind()) {
                let expected = "each effect of the catalogue at most once; put its parameters into one table";
                return Err(section.wrong("kind", format!("\"{id}\" for a second time"), expected).into());
            }
            catalogue.push(effect);
        }
    }
    Ok((catalogue, custom))
}

/// The effect's id, or the name of a custom one.
pub(crate) fn identity(section: &Section<'_>) -> Option<String> {
    let kind = section.text("kind", "").ok()??;
    let key = if kind == "custom" { "name" } else { "kind" };
    section.text(key, "").ok()?.map(str::to_owned)
}

fn read_catalogue(document: &Document, section: &Section<'_>, id: &str) -> Result<Effect, ValveFileError> {
    let Some(kind) = EffectKind::from_id(id) else {
        let ids = || EffectKind::ALL.iter().map(|kind| kind.id()).chain(["custom"]);
        let expected = ids().collect::<Vec<_>>().join(", ");
        let found = format!("\"{id}\"{}", quantity::suggest::did_you_mean(id, ids()));
        return Err(section.wrong("kind", found, format!("one of {expected}")).into());
    };
    let mut known = vec!["kind"];
    known.extend(kind.parameters().iter().map(|parameter| parameter.name));
    section.allow_only(&known)?;
    let mut given = Vec::new();
    for parameter in kind.parameters() {
        given.push(section.quantity(parameter.name, quantity_kind(parameter))?);
    }
    Effect::new(kind, &given).map_err(|source| refused(document, section, source))
}

/// A refusal of the model, at the line of the parameter that it names.
fn refused(document: &Document, section: &Section<'_>, source: ParameterError) -> ValveFileError {
    let key = source.key().rsplit('.').next().unwrap_or_default();
    let line = section.line_of(key);
    ValveFileError::Impossible { file: document.file().to_owned(), line, source: Box::new(source) }
}

fn read_custom(document: &Document, section: &Section<'_>) -> Result<CustomEffect, ValveFileError> {
    section.allow_only(&["kind", "name", "acts_on", "formula", "parameters"])?;
    let text = |key: &str, meaning: &str| {
        section.text(key, meaning).and_then(|found| found.ok_or_else(|| section.missing(key, meaning)))
    };
    let name = text("name", "the name of the custom effect, a text")?;
    let targets = "\"force\", \"friction\", \"pipe-flow\" or \"chamber-flow\"";
    let target = text("acts_on", targets)?;
    let target =
        CustomTarget::from_id(target).ok_or_else(|| section.wrong("acts_on", format!("\"{target}\""), targets))?;
    let formula = text("formula", "a formula in x, v, p_t, p_p, p_s, p_atm, t_since_command, L and the parameters")?;
    let mut parameters = Vec::new();
    if let Some(table) = section.section("parameters")? {
        for name in table.keys() {
            parameters.push(read_custom_parameter(&table, name)?);
        }
    }
    CustomEffect::new(name, target, formula, parameters).map_err(|error| match error {
        CustomError::Parameter(source) => {
            let key = source.key().rsplit('.').next().unwrap_or_default();
            let line = section.section("parameters").ok().flatten().map_or(section.line(), |table| table.line_of(key));
            ValveFileError::Impossible { file: document.file().to_owned(), line, source: Box::new(source) }
        }
        CustomError::Formula(source) => {
            let (file, line) = (document.file().to_owned(), section.line_of("formula"));
            ValveFileError::Formula { file, line, source: Box::new(source) }
        }
    })
}

fn read_custom_parameter(table: &Section<'_>, name: &str) -> Result<CustomParameter, ValveFileError> {
    let meaning = "{ start = 1.0, lower = 0.0, upper = 2.0, unit = \"N\" }";
    let Some(section) = table.section(name)? else { return Err(table.missing(name, meaning).into()) };
    section.allow_only(&["start", "lower", "upper", "unit"])?;
    let unit_text = section.text("unit", "a unit, such as \"N s/m\"")?.unwrap_or_default();
    let unit = Unit::parse(unit_text).map_err(|error| section.wrong("unit", error.to_string(), "a known unit"))?;
    if unit.reference() == Reference::Gauge {
        let expected = "an absolute unit such as kPa: formulas compute with absolute pressures";
        return Err(section.wrong("unit", format!("the gauge unit \"{unit_text}\""), expected).into());
    }
    let number = |key: &str| {
        let found = section.number(key, "a number in the parameter's unit")?;
        found.map(|number| unit.to_si(number)).ok_or_else(|| section.missing(key, meaning))
    };
    Ok(CustomParameter {
        name: name.to_owned(),
        value: number("start")?,
        lower: number("lower")?,
        upper: number("upper")?,
        unit: unit_text.to_owned(),
    })
}
