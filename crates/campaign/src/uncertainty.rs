//! `[uncertainty]`: how far instruments and conditions may be off, apart from noise.

use checked_toml::{QuantityKind, Section, TomlFileError};

/// One standard deviation of each error that is not noise; `None` where it is not stated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Uncertainty {
    /// Zero of the position sensor, from run to run, m.
    pub position_zero_m: Option<f64>,
    /// Gain of the position sensor, relative, common to all runs.
    pub position_gain: Option<f64>,
    /// How far the position sensor's curve bends away from a straight line, as a share of the stroke, common to all runs.
    pub position_linearity: Option<f64>,
    /// Drift of the position sensor over a run, m.
    pub position_drift_m: Option<f64>,
    /// Supply pressure (gauge), relative, from run to run.
    pub supply_pressure: Option<f64>,
    /// The gauge of the supply pressure, relative, common to all runs.
    pub supply_gauge: Option<f64>,
    /// Temperature, K, from run to run.
    pub temperature_k: Option<f64>,
    /// The recorder's clock against the command, s, common to all runs.
    pub clock_s: Option<f64>,
    /// Delay of a command from edge to edge, s.
    pub command_delay_s: Option<f64>,
    /// Area of a leak opened on purpose, relative, common to the runs with it.
    pub leak_area: Option<f64>,
}

/// The keys of `[uncertainty]` with what they take.
const KEYS: [(&str, QuantityKind); 10] = [
    ("position_zero", QuantityKind::Si("m")),
    ("position_gain", QuantityKind::Si("")),
    ("position_linearity", QuantityKind::Si("")),
    ("position_drift", QuantityKind::Si("m")),
    ("supply_pressure", QuantityKind::Si("")),
    ("supply_gauge", QuantityKind::Si("")),
    ("temperature", QuantityKind::TemperatureDifference),
    ("clock", QuantityKind::Si("s")),
    ("command_delay", QuantityKind::Si("s")),
    ("leak_area", QuantityKind::Si("")),
];

/// Reads `[uncertainty]`.
pub(crate) fn read(root: &Section<'_>) -> Result<Uncertainty, TomlFileError> {
    let Some(section) = root.section("uncertainty")? else { return Ok(Uncertainty::default()) };
    section.allow_only(&KEYS.map(|(key, _)| key))?;
    let mut read = Uncertainty::default();
    let places = [
        &mut read.position_zero_m,
        &mut read.position_gain,
        &mut read.position_linearity,
        &mut read.position_drift_m,
        &mut read.supply_pressure,
        &mut read.supply_gauge,
        &mut read.temperature_k,
        &mut read.clock_s,
        &mut read.command_delay_s,
        &mut read.leak_area,
    ];
    for ((key, kind), place) in KEYS.iter().zip(places) {
        let Some(value) = section.quantity(key, *kind)? else { continue };
        let relative = *kind == QuantityKind::Si("");
        if !(value > 0.0 && value.is_finite()) {
            let expected = "one standard deviation, more than 0 (for what is known exactly, a very small one)";
            return Err(section.wrong(key, value.to_string(), expected));
        }
        if relative && value >= 1.0 {
            let expected = format!("a share below 1, such as {} for {value} percent", value / 100.0);
            return Err(section.wrong(key, value.to_string(), expected));
        }
        *place = Some(value);
    }
    Ok(read)
}
