//! The worlds by name.

use super::world::Wear;

/// How the wear grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Growth {
    None,
    Linear,
    Square,
    Exponential,
    /// The same from a wear that is there when the log begins: by the same factor every cycle.
    Compound,
    /// Linear from such a wear.
    Begun,
    Gamma,
    Onset,
    StepRest,
    Repair,
}

/// What the conditions do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Weather {
    Steady,
    RandomSupply,
    SwingingSupply,
    Season,
}

/// A world: what really happens to a valve and to its log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scenario {
    /// Its name.
    pub name: &'static str,
    pub(crate) growth: Growth,
    /// Kinds of wear, one of which a life draws; with `together` or `later` all of them.
    pub(crate) wear: &'static [Wear],
    pub(crate) together: bool,
    /// Whether one of them begins later than the other.
    pub(crate) later: bool,
    pub(crate) weather: Weather,
    /// One-sigma share by which this valve's healthy times are off.
    pub(crate) unit_spread: f64,
    /// Share of the times that are not written down.
    pub(crate) blanks: f64,
    /// Correlation of the noise from one cycle to the next.
    pub(crate) correlation: f64,
    /// Cycles that a healthy valve is watched.
    pub(crate) healthy_cycles: u64,
}

const LEAKS: &[Wear] = &[Wear::Atmosphere, Wear::Supply];

const PLAIN: Scenario = Scenario {
    name: "linear",
    growth: Growth::Linear,
    wear: LEAKS,
    together: false,
    later: false,
    weather: Weather::Steady,
    unit_spread: 0.0,
    blanks: 0.0,
    correlation: 0.0,
    healthy_cycles: 0,
};

const HEALTHY: Scenario = Scenario { name: "healthy", growth: Growth::None, healthy_cycles: 600, ..PLAIN };

impl Scenario {
    /// Every world, in the order of the table.
    pub const ALL: [Self; 31] = [
        PLAIN,
        Self { name: "square", growth: Growth::Square, ..PLAIN },
        Self { name: "exponential", growth: Growth::Exponential, ..PLAIN },
        Self { name: "exponential, begun before", growth: Growth::Compound, ..PLAIN },
        Self { name: "linear, begun before", growth: Growth::Begun, ..PLAIN },
        Self { name: "gamma process", growth: Growth::Gamma, ..PLAIN },
        Self { name: "onset at 5", growth: Growth::Onset, ..PLAIN },
        Self { name: "step, rest, growth", growth: Growth::StepRest, ..PLAIN },
        Self { name: "repair to 40 %", growth: Growth::Repair, ..PLAIN },
        Self { name: "both leaks", together: true, ..PLAIN },
        Self { name: "second leak later", later: true, ..PLAIN },
        Self { name: "supply random 3 %", weather: Weather::RandomSupply, ..PLAIN },
        Self { name: "supply swings 3 psi", weather: Weather::SwingingSupply, ..PLAIN },
        Self { name: "season of 15 K", weather: Weather::Season, ..PLAIN },
        Self { name: "unit 3 % off", unit_spread: 0.03, ..PLAIN },
        Self { name: "unit 10 % off", unit_spread: 0.1, ..PLAIN },
        Self { name: "friction", wear: &[Wear::Friction], ..PLAIN },
        Self { name: "spring", wear: &[Wear::Spring], ..PLAIN },
        Self { name: "exhaust", wear: &[Wear::Exhaust], ..PLAIN },
        Self { name: "supply line", wear: &[Wear::SupplyLine], ..PLAIN },
        Self { name: "solenoid", wear: &[Wear::Solenoid], ..PLAIN },
        Self { name: "5 % blank", blanks: 0.05, ..PLAIN },
        Self { name: "20 % blank", blanks: 0.20, ..PLAIN },
        Self { name: "correlated noise", correlation: 0.8, ..PLAIN },
        HEALTHY,
        Self { name: "healthy, 3 % off", unit_spread: 0.03, ..HEALTHY },
        Self { name: "healthy, 10 % off", unit_spread: 0.1, ..HEALTHY },
        Self { name: "healthy, correlated", correlation: 0.8, ..HEALTHY },
        Self { name: "healthy, random", weather: Weather::RandomSupply, ..HEALTHY },
        Self { name: "healthy, swing", weather: Weather::SwingingSupply, ..HEALTHY },
        Self { name: "healthy, season", weather: Weather::Season, ..HEALTHY },
    ];

    /// Whether the supply pressure is another in each cycle.
    pub fn varies_supply(&self) -> bool {
        matches!(self.weather, Weather::RandomSupply | Weather::SwingingSupply)
    }

    /// Whether the temperature is another in each cycle.
    pub fn varies_temperature(&self) -> bool {
        self.weather == Weather::Season
    }

    /// Whether a valve leaks both ways at once.
    pub fn has_both_leaks(&self) -> bool {
        self.together || self.later
    }

    /// The world of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|scenario| scenario.name == name)
    }
}
