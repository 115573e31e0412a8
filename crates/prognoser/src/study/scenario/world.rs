//! Where the true stroke times come from.

/// What can wear on a valve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wear {
    /// A leak from the pipe to the atmosphere.
    Atmosphere,
    /// A leak from the supply into the pipe.
    Supply,
    /// Dry friction.
    Friction,
    /// A spring that weakens.
    Spring,
    /// An exhaust that clogs.
    Exhaust,
    /// A supply line that clogs.
    SupplyLine,
    /// A solenoid that clogs, for filling and for venting.
    Solenoid,
}

impl Wear {
    /// All kinds, in the order of [`ValveState::severity`].
    pub const ALL: [Self; 7] =
        [Self::Atmosphere, Self::Supply, Self::Friction, Self::Spring, Self::Exhaust, Self::SupplyLine, Self::Solenoid];

    /// The name that a prognosis gives it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Atmosphere => "atmosphere",
            Self::Supply => "supply",
            Self::Friction => "friction",
            Self::Spring => "spring",
            Self::Exhaust => "exhaust",
            Self::SupplyLine => "supply-line",
            Self::Solenoid => "solenoid",
        }
    }
}

/// The true state of a valve in a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValveState {
    /// Severity of each kind of wear, 1 where it alone brings a stroke to its
    /// limit under the reference conditions.
    pub severity: [f64; Wear::ALL.len()],
    /// Absolute supply pressure over that of the reference.
    pub supply_ratio: f64,
    /// Temperature above that of the reference, in K.
    pub warmer_k: f64,
}

impl ValveState {
    /// A healthy valve under the reference conditions.
    pub const HEALTHY: Self = Self { severity: [0.0; Wear::ALL.len()], supply_ratio: 1.0, warmer_k: 0.0 };
}

/// True stroke times.
pub trait World: Sync {
    /// Closing and opening time in s; none where the valve does not get there
    /// within its cycle.
    fn times_s(&self, state: &ValveState) -> [Option<f64>; 2];

    /// The limits of closing and opening time, in s.
    fn limits_s(&self) -> [f64; 2];

    /// Absolute supply pressure of the reference, in Pa.
    fn reference_supply_pa(&self) -> f64;

    /// Temperature of the reference, in K.
    fn reference_temperature_k(&self) -> f64;
}
