//! From the text's tables to checked values.

use std::path::Path;

use checked_toml::{Document, QuantityKind, Refusals, Section, TomlFileError};
use valve_model::custom::CustomEffect;
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{
    Conditions, Limits, Orientation, Outcome, ParameterError, ParameterId, Parameters, Schedule, Switches, Valve,
};
use valve_model::{cycle, stability};

use crate::file::{Tolerance, ValveFile};
use crate::meaning::meaning;
use crate::{ValveFileError, effects, history};

const ROOT_KEYS: [&str; 12] = [
    "name",
    "actuator",
    "spring",
    "stops",
    "gas",
    "pneumatics",
    "switches",
    "cycle",
    "limits",
    "tolerance",
    "effect",
    "history",
];

impl ValveFile {
    /// Reads and checks a text; `file_name` is what messages call it.
    pub fn parse(text: &str, file_name: &str) -> Result<Self, ValveFileError> {
        check(Document::parse(text, file_name)?)
    }

    /// Reads and checks a file.
    pub fn read(path: &Path) -> Result<Self, ValveFileError> {
        Self::parse(&checked_toml::read_text(path)?, &path.display().to_string())
    }
}

fn check(document: Document) -> Result<ValveFile, ValveFileError> {
    let root = document.root();
    let of_campaigns = ["run", "timings", "sensors"];
    let expected = "a valve file, which is named before the campaign";
    root.not_of_another_kind(&ROOT_KEYS[1..], &of_campaigns, "a campaign file", expected)?;
    let mut refusals = Refusals::default();
    refusals.keep(root.allow_only(&ROOT_KEYS));
    let name = root.text("name", "a text");
    let name = name.and_then(|name| name.ok_or_else(|| root.missing("name", "the name of the valve, a text")));
    let name = refusals.keep(name).map(str::to_owned);
    let parameters = parameters(&root, &mut refusals);
    let switches = refusals.keep(switches(&root));
    let (schedule, limits) = (refusals.keep(schedule(&root)), refusals.keep(limits(&root)));
    let tolerances = parameters.as_ref().and_then(|parameters| refusals.keep(tolerances(&root, parameters)));
    let effects = match effects::read(&document) {
        Err(ValveFileError::Text(error)) => refusals.keep(Err(error)),
        read => Some(read),
    };
    refusals.none()?;
    let read = (name, parameters, switches, schedule, limits, tolerances, effects);
    let (Some(name), Some(parameters), Some(switches), Some(schedule), Some(limits), Some(tolerances), Some(effects)) =
        read
    else {
        unreachable!("what was not read was refused")
    };
    let (catalogue, custom) = effects?;
    let history = history::read(&document)?;
    let valve =
        Valve::new(parameters, switches, catalogue, custom).map_err(|source| impossible(&document, &root, source))?;
    schedule.check().map_err(|source| impossible(&document, &root, source))?;
    limits.check().map_err(|source| impossible(&document, &root, source))?;
    let nominal = Conditions::nominal(valve.parameters());
    stability::check(&valve, &nominal, schedule.end_s, DEFAULT_STEP_S)
        .map_err(|source| impossible(&document, &root, source))?;
    if let Some((effect, time_s)) = no_number(&valve, nominal, &schedule) {
        let section =
            root.sections("effect")?.into_iter().find(|section| effects::identity(section) == Some(effect.into()));
        let (file, line) = (document.file().to_owned(), section.map_or(1, |section| section.line_of("formula")));
        return Err(ValveFileError::NoNumber { file, line, effect: effect.to_owned(), time_s });
    }
    drop(root);
    Ok(ValveFile { document, name, valve, schedule, limits, tolerances, history, pending: Vec::new() })
}

/// The custom effect whose formula is no number within the valve's own cycle, and when that was noticed, s.
fn no_number<'a>(valve: &'a Valve, conditions: Conditions, schedule: &Schedule) -> Option<(&'a str, f64)> {
    let stops = |custom: &[CustomEffect]| {
        let valve = Valve::new(valve.parameters().clone(), valve.switches(), valve.effects().to_vec(), custom.to_vec());
        match cycle::outcome(&valve.ok()?, conditions, schedule, DEFAULT_STEP_S) {
            Outcome::Diverged { time_s, .. } => Some(time_s),
            Outcome::Complete | Outcome::Refused => None,
        }
    };
    // Where only several together stop it, the last one stands for them.
    (1..=valve.custom().len()).find_map(|count| {
        let (before, of) = valve.custom().split_at(count - 1);
        let time_s = stops(&[before, &of[..1]].concat())?;
        Some((of[0].name(), time_s))
    })
}

/// A refusal of the model, at the line of the key that it names.
fn impossible(document: &Document, root: &Section<'_>, source: ParameterError) -> ValveFileError {
    let line = match source.key().split_once('.') {
        Some((table, key)) => match root.section(table) {
            Ok(Some(section)) => section.line_of(key),
            _ => root.line_of(table),
        },
        None => 1,
    };
    ValveFileError::Impossible { file: document.file().to_owned(), line, source: Box::new(source) }
}

fn table<'a>(root: &Section<'a>, name: &str, meaning: &str) -> Result<Section<'a>, TomlFileError> {
    root.section(name)?.ok_or_else(|| root.missing(name, &format!("the table [{name}] with {meaning}")))
}

/// The parameters; nothing where any was refused.
fn parameters(root: &Section<'_>, refusals: &mut Refusals) -> Option<Parameters> {
    let mut values = Parameters {
        moving_mass_kg: 0.0,
        stroke_m: 0.0,
        piston_area_m2: 0.0,
        dead_volume_m3: 0.0,
        viscous_friction_n_s_per_m: 0.0,
        spring_stiffness_n_per_m: 0.0,
        preload_compression_m: 0.0,
        contact_stiffness_n_per_m: 0.0,
        stop_damping_n_s_per_m: 0.0,
        ratio_of_specific_heats: 0.0,
        specific_gas_constant_j_per_kg_k: 0.0,
        compressibility: 0.0,
        supply_pressure_pa: 0.0,
        ambient_pressure_pa: 0.0,
        temperature_k: 0.0,
        pipe_volume_m3: 0.0,
        flow_coefficient: 0.0,
        solenoid_orifice_area_m2: 0.0,
        port_orifice_area_m2: 0.0,
        orientation: Orientation::default(),
    };
    // The ambient pressure comes first: a gauge supply pressure counts from it.
    let ambient = ParameterId::AmbientPressure;
    let mut is_whole = true;
    for &id in std::iter::once(&ambient).chain(ParameterId::ALL) {
        let kind = match id {
            ParameterId::SupplyPressure => QuantityKind::Pressure { ambient_pressure_pa: values.ambient_pressure_pa },
            _ => QuantityKind::Si(id.si_unit()),
        };
        match refusals.keep(parameter(root, id, kind)) {
            Some(value) => values.set(id, value),
            None => is_whole = false,
        }
    }
    for name in ["actuator", "spring", "stops", "gas", "pneumatics"] {
        let known = root.section(name).and_then(|section| section.map_or(Ok(()), |section| known_keys(&section, name)));
        is_whole &= refusals.keep(known).is_some();
    }
    match refusals.keep(orientation(root)) {
        Some(orientation) => values.orientation = orientation,
        None => is_whole = false,
    }
    is_whole.then_some(values)
}

fn parameter(root: &Section<'_>, id: ParameterId, kind: QuantityKind) -> Result<f64, TomlFileError> {
    let names = || ParameterId::ALL.iter().filter(|other| other.section() == id.section()).map(|other| other.name());
    let section = match root.section(id.section())? {
        Some(section) => section,
        None => table(root, id.section(), &names().collect::<Vec<_>>().join(", "))?,
    };
    section.quantity(id.name(), kind)?.or(id.default_value()).ok_or_else(|| {
        // A misspelt key is the likelier reason than a forgotten one.
        known_keys(&section, id.section()).err().unwrap_or_else(|| section.missing(id.name(), meaning(id)))
    })
}

fn orientation(root: &Section<'_>) -> Result<Orientation, TomlFileError> {
    let expected = "\"upright\", \"inverted\" or \"horizontal\"";
    let Some(actuator) = root.section("actuator")? else { return Ok(Orientation::default()) };
    match actuator.text("orientation", expected)? {
        None | Some("upright") => Ok(Orientation::Upright),
        Some("inverted") => Ok(Orientation::Inverted),
        Some("horizontal") => Ok(Orientation::Horizontal),
        Some(other) => Err(actuator.wrong("orientation", format!("\"{other}\""), expected)),
    }
}

fn known_keys(section: &Section<'_>, name: &str) -> Result<(), TomlFileError> {
    let mut known: Vec<&str> = ParameterId::ALL.iter().filter(|id| id.section() == name).map(|id| id.name()).collect();
    if name == "actuator" {
        known.push("orientation");
    }
    section.allow_only(&known)
}

fn switches(root: &Section<'_>) -> Result<Switches, TomlFileError> {
    let mut switches = Switches::default();
    if let Some(section) = root.section("switches")? {
        section.allow_only(&["closed_at", "open_at"])?;
        let expected = "a fraction of the stroke between 0 (closed) and 1 (open)";
        switches.closed_at = section.number("closed_at", expected)?.unwrap_or(switches.closed_at);
        switches.open_at = section.number("open_at", expected)?.unwrap_or(switches.open_at);
    }
    Ok(switches)
}

fn time(section: &Section<'_>, key: &str, meaning: &str) -> Result<f64, TomlFileError> {
    section.quantity(key, QuantityKind::Si("s"))?.ok_or_else(|| section.missing(key, meaning))
}

fn schedule(root: &Section<'_>) -> Result<Schedule, TomlFileError> {
    let section = table(root, "cycle", "close_at, open_at and end")?;
    section.allow_only(&["close_at", "open_at", "end"])?;
    Ok(Schedule {
        close_at_s: time(&section, "close_at", "when the valve is told to close, such as \"0 s\"")?,
        open_at_s: time(&section, "open_at", "when the valve is told to open, such as \"4 s\"")?,
        end_s: time(&section, "end", "when the cycle ends, such as \"12 s\"")?,
    })
}

fn limits(root: &Section<'_>) -> Result<Limits, TomlFileError> {
    let section = table(root, "limits", "close_within and open_within")?;
    section.allow_only(&["close_within", "open_within"])?;
    Ok(Limits {
        close_within_s: time(&section, "close_within", "the longest acceptable closing time, such as \"3 s\"")?,
        open_within_s: time(&section, "open_within", "the longest acceptable opening time, such as \"6 s\"")?,
    })
}

fn tolerances(root: &Section<'_>, parameters: &Parameters) -> Result<Vec<Tolerance>, TomlFileError> {
    let Some(section) = root.section("tolerance")? else { return Ok(Vec::new()) };
    let mut found = Vec::new();
    for key in section.keys() {
        // `actuator.stroke = 0.1` without quotation marks is a table to TOML; both spellings are meant alike.
        match section.section(key) {
            Ok(Some(inner)) => {
                for name in inner.keys() {
                    found.push(tolerance(&inner, name, &format!("{key}.{name}"), parameters)?);
                }
            }
            _ => found.push(tolerance(&section, key, key, parameters)?),
        }
    }
    for (index, tolerance) in found.iter().enumerate() {
        if found[..index].iter().any(|other: &Tolerance| other.parameter == tolerance.parameter) {
            return Err(section.wrong(tolerance.parameter.key(), "given twice", "one tolerance for each parameter"));
        }
    }
    Ok(found)
}

fn tolerance(
    section: &Section<'_>,
    key: &str,
    dotted: &str,
    parameters: &Parameters,
) -> Result<Tolerance, TomlFileError> {
    let Some(&parameter) = ParameterId::ALL.iter().find(|id| id.key() == dotted) else {
        let known: Vec<&str> = ParameterId::ALL.iter().map(|id| id.key()).collect();
        return Err(section.unknown(key, &known));
    };
    let expected = "a fraction of the value (one standard deviation), more than 0 and at most 1, such as 0.05 for 5 %";
    let relative_sigma = section.number(key, expected)?.unwrap_or(f64::NAN);
    if !(relative_sigma > 0.0 && relative_sigma <= 1.0) {
        return Err(section.wrong(key, relative_sigma.to_string(), expected));
    }
    if parameters.get(parameter) == 0.0 {
        return Err(section.wrong(key, "a fraction of a value that is 0", "no tolerance, or a value other than 0"));
    }
    Ok(Tolerance { parameter, relative_sigma })
}
