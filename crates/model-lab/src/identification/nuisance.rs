//! What instruments and conditions may be off by: nuisances with priors, in every fit and reported.

use campaign::Uncertainty;
use identify::{Coordinate, Scope};

use super::setup::{Kind, Setup};
use super::start::{Beginning, balance_sigma_pa};
use crate::data::Channel;
use valve_model::{Conditions, Parameters};

/// Default standard deviations, where a campaign's `[uncertainty]` does not state its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NuisanceSizes {
    /// Zero of the position sensor, by run, as a share of the stroke.
    pub zero: f64,
    /// Its drift over a run, as a share of the stroke.
    pub drift: f64,
    /// Its gain.
    pub gain: f64,
    /// Each bend of its curve, as a share of the stroke.
    pub linearity: f64,
    /// Supply pressure by run, relative (gauge pressure).
    pub supply: f64,
    /// Supply gauge throughout, relative (gauge pressure).
    pub gauge: f64,
    /// Clock of the recorder against that of the commands, s.
    pub clock_s: f64,
    /// Delay of a command, by run and direction, s.
    pub delay_s: f64,
    /// Load on the piston by run, as a share of the force at rest.
    pub load: f64,
    /// Area of a leak that was opened on purpose.
    pub leak_area: f64,
    /// Piston area, relative, where it has no tolerance.
    pub bore: f64,
    /// Zero of a pressure sensor, as a share of the supply's gauge pressure.
    pub pressure_zero: f64,
    /// Damping of the stops, as a share of the critical one.
    pub stop_damping: f64,
}

impl Default for NuisanceSizes {
    fn default() -> Self {
        Self {
            zero: 0.012,
            drift: 0.004,
            gain: 0.01,
            linearity: 0.0025,
            supply: 0.015,
            gauge: 0.02,
            clock_s: 0.004,
            delay_s: 0.004,
            load: 0.01,
            leak_area: 0.05,
            bore: 0.01,
            pressure_zero: 0.01,
            stop_damping: 0.4,
        }
    }
}

/// One nuisance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Nuisance {
    /// Zero of the position sensor in a record.
    Zero(usize),
    /// Its drift over a record.
    Drift(usize),
    /// Supply pressure of a record.
    Supply(usize),
    /// Load of a record.
    Load(usize),
    /// Temperature of a record.
    Temperature(usize),
    /// Delay of a record's commands to close.
    CloseDelay(usize),
    /// Delay of a record's commands to open.
    OpenDelay(usize),
    /// How long before a record its first command was given.
    UnseenEdge(usize),
    /// Chamber pressure at the start of a record that begins in motion, against that which balances.
    StartPressure(usize),
    /// Position at the start of a record that begins in motion.
    StartPosition(usize),
    /// Speed at the start of a record that begins in motion.
    StartSpeed(usize),
    /// Gain of the position sensor.
    Gain,
    /// A bend of the position sensor's curve: so many half waves over the stroke.
    Linearity(usize),
    /// Clock of the recorder.
    Clock,
    /// Supply gauge.
    Gauge,
    /// Area of the leak to the atmosphere that records were made with.
    LeakToAtmosphere,
    /// Area of the leak from the supply that records were made with.
    LeakFromSupply,
    /// Piston area.
    Bore,
    /// Damping of the stops.
    StopDamping,
    /// Zero of a pressure sensor.
    PressureZero(Channel),
    /// Gain of a pressure sensor.
    PressureGain(Channel),
    /// Zero of the pressure sensor that drives the model.
    DrivingZero,
    /// Gain of it.
    DrivingGain,
}

impl Nuisance {
    /// Which records it moves.
    pub fn scope(self) -> Scope {
        match self {
            Self::Zero(record)
            | Self::Drift(record)
            | Self::Supply(record)
            | Self::Load(record)
            | Self::Temperature(record)
            | Self::CloseDelay(record)
            | Self::OpenDelay(record)
            | Self::UnseenEdge(record)
            | Self::StartPressure(record)
            | Self::StartPosition(record)
            | Self::StartSpeed(record) => Scope::Record(record),
            _ => Scope::Shared,
        }
    }

    /// The same of another record.
    #[must_use]
    pub fn of_record(self, record: usize) -> Self {
        match self {
            Self::Zero(_) => Self::Zero(record),
            Self::Drift(_) => Self::Drift(record),
            Self::Supply(_) => Self::Supply(record),
            Self::Load(_) => Self::Load(record),
            Self::Temperature(_) => Self::Temperature(record),
            Self::CloseDelay(_) => Self::CloseDelay(record),
            Self::OpenDelay(_) => Self::OpenDelay(record),
            Self::UnseenEdge(_) => Self::UnseenEdge(record),
            Self::StartPressure(_) => Self::StartPressure(record),
            Self::StartPosition(_) => Self::StartPosition(record),
            Self::StartSpeed(_) => Self::StartSpeed(record),
            shared => shared,
        }
    }

    /// What it is in words, and the SI unit of its value (empty for a share).
    pub fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Zero(_) => ("zero of the position sensor", "m"),
            Self::Drift(_) => ("drift of the position sensor over the run", "m"),
            Self::Supply(_) => ("supply pressure of the run", ""),
            Self::Load(_) => ("load on the piston in the run", ""),
            Self::Temperature(_) => ("temperature of the run", "K"),
            Self::CloseDelay(_) => ("delay of the command to close", "s"),
            Self::OpenDelay(_) => ("delay of the command to open", "s"),
            Self::UnseenEdge(_) => ("command given before the record, by", "s"),
            Self::StartPressure(_) => ("chamber pressure at the start, beyond what balances or was recorded", "Pa"),
            Self::StartPosition(_) => ("position at the start, beyond what the first rows show", "m"),
            Self::StartSpeed(_) => ("speed at the start, beyond what the first rows show", "m/s"),
            Self::Gain => ("gain of the position sensor", ""),
            Self::Linearity(1) => ("curve of the position sensor bent, half a wave over the stroke", "m"),
            Self::Linearity(2) => ("curve of the position sensor bent, a whole wave over the stroke", "m"),
            Self::Linearity(_) => ("curve of the position sensor bent, a wave and a half over the stroke", "m"),
            Self::Clock => ("clock of the recorder", "s"),
            Self::Gauge => ("supply gauge throughout", ""),
            Self::LeakToAtmosphere => ("area of the leak to the atmosphere opened on purpose", ""),
            Self::LeakFromSupply => ("area of the leak from the supply opened on purpose", ""),
            Self::Bore => ("piston area", ""),
            Self::StopDamping => ("damping of the stops", "N s/m"),
            Self::PressureZero(Channel::ChamberPressure) => ("zero of the chamber pressure sensor", "Pa"),
            Self::PressureZero(_) => ("zero of the pipe pressure sensor", "Pa"),
            Self::PressureGain(Channel::ChamberPressure) => ("gain of the chamber pressure sensor", ""),
            Self::PressureGain(_) => ("gain of the pipe pressure sensor", ""),
            Self::DrivingZero => ("zero of the pressure that drives the model", "Pa"),
            Self::DrivingGain => ("gain of the pressure that drives the model", ""),
        }
    }

    /// Whether the model has always to be simulated anew when it moves.
    fn is_simulated(self) -> bool {
        matches!(
            self,
            Self::Supply(_)
                | Self::Load(_)
                | Self::Temperature(_)
                | Self::LeakToAtmosphere
                | Self::LeakFromSupply
                | Self::UnseenEdge(_)
                | Self::StartPressure(_)
                | Self::StartPosition(_)
                | Self::StartSpeed(_)
                | Self::Gauge
                | Self::Bore
                | Self::StopDamping
                | Self::DrivingZero
                | Self::DrivingGain
        )
    }
}

/// A nuisance, its standard deviation and its coordinate.
#[derive(Debug, Clone)]
pub struct Entry {
    /// Which.
    pub nuisance: Nuisance,
    /// One standard deviation: m, s, Pa or a share, as the nuisance is counted.
    pub size: f64,
    /// Its coordinate, in standard deviations.
    pub coordinate: Coordinate,
    /// Whether the model has to be simulated anew when it moves.
    pub is_simulated: bool,
}

impl Entry {
    /// A nuisance of a size.
    pub fn new(nuisance: Nuisance, size: f64) -> Self {
        let mut coordinate = Coordinate::standard(format!("{nuisance:?}"), nuisance.scope(), BOUND);
        coordinate.step = 0.1;
        coordinate.of_measuring = true;
        Self { nuisance, size, coordinate, is_simulated: nuisance.is_simulated() }
    }
}

/// Standard deviation of what lies anywhere in a stretch, as a share of it.
const UNIFORM: f64 = 0.288_675;

/// Half waves of the highest bend that the curve of a position sensor may have.
const BENDS: usize = 3;

/// Nuisances end at this many standard deviations.
const BOUND: f64 = 3.0;

/// The nuisances of a campaign.
pub fn nuisances(
    setup: &Setup,
    parameters: &Parameters,
    sizes: &NuisanceSizes,
    stated: &Uncertainty,
    is_bore_tolerated: bool,
) -> Vec<Entry> {
    let stroke = setup.stroke_m;
    let mut all: Vec<(Nuisance, f64)> = Vec::new();
    let mut pressures: Vec<Channel> = Vec::new();
    let mut has_traces = false;
    for (record, recording) in setup.recordings.iter().enumerate() {
        if let Kind::Trace(trace) = &recording.kind {
            has_traces = true;
            all.push((Nuisance::Zero(record), stated.position_zero_m.unwrap_or(sizes.zero * stroke)));
            all.push((Nuisance::Drift(record), stated.position_drift_m.unwrap_or(sizes.drift * stroke)));
            for channel in trace.channels.iter().map(|rows| rows.channel).filter(|c| *c != Channel::Position) {
                if !pressures.contains(&channel) {
                    pressures.push(channel);
                }
            }
        }
        // Of stroke times alone every row is a cycle of its own: what differs from one to the next is their noise.
        if matches!(recording.kind, Kind::Times(_)) {
            continue;
        }
        all.push((Nuisance::Load(record), sizes.load));
        // Unless it is stated, the supply pressure of the run stands for it: both change how fast gas flows, and little else.
        if let Some(size) = stated.temperature_k {
            all.push((Nuisance::Temperature(record), size));
        }
        if let Beginning::Venting { pressure_sigma_pa, .. } = recording.beginning {
            all.push((Nuisance::StartPressure(record), pressure_sigma_pa));
        }
        if let Beginning::Moving {
            position_m,
            position_sigma_m,
            velocity_sigma_m_per_s,
            acceleration_sigma_m_per_s2,
            ..
        } = recording.beginning
        {
            let pressure_sigma_pa = balance_sigma_pa(parameters, position_m, acceleration_sigma_m_per_s2);
            all.push((Nuisance::StartPressure(record), pressure_sigma_pa));
            all.push((Nuisance::StartPosition(record), position_sigma_m));
            all.push((Nuisance::StartSpeed(record), velocity_sigma_m_per_s));
        }
        if !setup.is_prescribed {
            let delay = stated.command_delay_s.unwrap_or(sizes.delay_s);
            all.push((Nuisance::Supply(record), stated.supply_pressure.unwrap_or(sizes.supply)));
            for (which, unseen_s) in
                [Nuisance::CloseDelay(record), Nuisance::OpenDelay(record)].into_iter().zip(recording.unseen_s)
            {
                all.push((which, delay.hypot(unseen_s * UNIFORM)));
            }
        }
    }
    if has_traces {
        all.push((Nuisance::Gain, stated.position_gain.unwrap_or(sizes.gain)));
    }
    if has_traces {
        let size = stated.position_linearity.unwrap_or(sizes.linearity) * stroke;
        all.extend((1..=BENDS).map(|waves| (Nuisance::Linearity(waves), size)));
    }
    if setup.is_prescribed {
        all.push((Nuisance::DrivingZero, sizes.pressure_zero * span_pa(setup)));
        all.push((Nuisance::DrivingGain, sizes.gain));
    } else {
        all.push((Nuisance::Gauge, stated.supply_gauge.unwrap_or(sizes.gauge)));
    }
    let leak = stated.leak_area.unwrap_or(sizes.leak_area);
    let with_leak =
        |area: fn(&Conditions) -> f64| setup.recordings.iter().any(|recording| area(&recording.run.conditions) > 0.0);
    if with_leak(|conditions| conditions.leak_to_atmosphere_m2) {
        all.push((Nuisance::LeakToAtmosphere, leak));
    }
    if with_leak(|conditions| conditions.leak_from_supply_m2) {
        all.push((Nuisance::LeakFromSupply, leak));
    }
    all.push((Nuisance::Clock, stated.clock_s.unwrap_or(sizes.clock_s)));
    if !is_bore_tolerated {
        all.push((Nuisance::Bore, sizes.bore));
    }
    let critical = 2.0 * (parameters.contact_stiffness_n_per_m * parameters.moving_mass_kg).sqrt();
    all.push((Nuisance::StopDamping, sizes.stop_damping * critical));
    for channel in pressures {
        all.push((Nuisance::PressureZero(channel), sizes.pressure_zero * span_pa(setup)));
        all.push((Nuisance::PressureGain(channel), sizes.gain));
    }
    let entry = |(nuisance, size): (Nuisance, f64)| {
        let mut entry = Entry::new(nuisance, size);
        let unseen_s = match nuisance {
            Nuisance::CloseDelay(record) => setup.recordings[record].unseen_s[0],
            Nuisance::OpenDelay(record) => setup.recordings[record].unseen_s[1],
            _ => 0.0,
        };
        if nuisance == Nuisance::StopDamping {
            // No stop drives.
            entry.coordinate.lower = entry.coordinate.lower.max(-parameters.stop_damping_n_s_per_m / size);
        }
        entry.coordinate.shift(-0.5 * unseen_s / size);
        entry
    };
    all.into_iter().filter(|(_, size)| *size > 0.0).map(entry).collect()
}

/// The largest gauge pressure of the supply, Pa.
fn span_pa(setup: &Setup) -> f64 {
    setup
        .recordings
        .iter()
        .map(|recording| (recording.run.conditions.supply_pressure_pa - setup.ambient_pa).abs())
        .fold(0.0, f64::max)
}
