//! The parameters of a valve, and the checks that make them fit to simulate.

/// One standard gravity, m/s².
pub const STANDARD_GRAVITY_M_PER_S2: f64 = 9.806_65;

/// How the actuator stands; decides which way the weight of the moving mass acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Orientation {
    /// The weight acts in the closing direction.
    #[default]
    Upright,
    /// The weight acts in the opening direction.
    Inverted,
    /// The weight acts across the stroke.
    Horizontal,
}

impl Orientation {
    /// The share of the weight that acts in the closing direction: 1, -1 or 0.
    #[must_use]
    pub fn closing_share(self) -> f64 {
        match self {
            Self::Upright => 1.0,
            Self::Inverted => -1.0,
            Self::Horizontal => 0.0,
        }
    }
}

/// What values a parameter may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Domain {
    /// Greater than zero.
    Positive,
    /// Zero or greater.
    NonNegative,
    /// Greater than one (a ratio of specific heats).
    AboveOne,
}

impl Domain {
    /// Whether `value` is finite and within the domain.
    #[must_use]
    pub fn contains(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Positive => value > 0.0,
                Self::NonNegative => value >= 0.0,
                Self::AboveOne => value > 1.0,
            }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Positive => "a value greater than 0",
            Self::NonNegative => "a value of 0 or more",
            Self::AboveOne => "a value greater than 1",
        }
    }
}

macro_rules! parameters {
    ($( $(#[$doc:meta])* $field:ident, $id:ident, $section:literal, $name:literal, $unit:literal, $domain:ident; )*) => {
        /// The physical parameters of the base model, SI, as given (not yet checked).
        #[derive(Debug, Clone, PartialEq)]
        pub struct Parameters {
            $( $(#[$doc])* pub $field: f64, )*
            /// How the actuator stands.
            pub orientation: Orientation,
        }

        /// Names one numeric parameter of the base model.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum ParameterId { $( $(#[$doc])* $id, )* }

        impl ParameterId {
            /// Every numeric parameter, in the order of the valve file.
            pub const ALL: &'static [Self] = &[ $( Self::$id, )* ];

            /// The table of the valve file that holds the parameter.
            #[must_use]
            pub fn section(self) -> &'static str { match self { $( Self::$id => $section, )* } }

            /// The key within its table of the valve file.
            #[must_use]
            pub fn name(self) -> &'static str { match self { $( Self::$id => $name, )* } }

            /// The dotted key, as in `[tolerance]`: "actuator.moving_mass".
            #[must_use]
            pub fn key(self) -> &'static str { match self { $( Self::$id => concat!($section, ".", $name), )* } }

            /// The SI unit of the value held in [`Parameters`], empty for a pure number.
            #[must_use]
            pub fn si_unit(self) -> &'static str { match self { $( Self::$id => $unit, )* } }

            /// The values the parameter may take.
            #[must_use]
            pub fn domain(self) -> Domain { match self { $( Self::$id => Domain::$domain, )* } }
        }

        impl Parameters {
            /// The value of one parameter, SI.
            #[must_use]
            pub fn get(&self, id: ParameterId) -> f64 { match id { $( ParameterId::$id => self.$field, )* } }

            /// Sets one parameter, SI.
            pub fn set(&mut self, id: ParameterId, value: f64) { match id { $( ParameterId::$id => self.$field = value, )* } }
        }
    };
}

parameters! {
    /// Mass of piston, rod and plug, kg.
    moving_mass_kg, MovingMass, "actuator", "moving_mass", "kg", Positive;
    /// Travel between the stops L, m.
    stroke_m, Stroke, "actuator", "stroke", "m", Positive;
    /// Piston area A_p, m².
    piston_area_m2, PistonArea, "actuator", "piston_area", "m2", Positive;
    /// Chamber volume with the valve fully open V_t0, m³.
    dead_volume_m3, DeadVolume, "actuator", "dead_volume", "m3", Positive;
    /// Viscous friction r, N s/m.
    viscous_friction_n_s_per_m, ViscousFriction, "actuator", "viscous_friction", "N s/m", NonNegative;
    /// Spring stiffness k, N/m; 0 without a spring.
    spring_stiffness_n_per_m, SpringStiffness, "spring", "stiffness", "N/m", NonNegative;
    /// Spring compression with the valve fully open x0, m.
    preload_compression_m, PreloadCompression, "spring", "preload_compression", "m", NonNegative;
    /// Stiffness of the stops k_c, N/m.
    contact_stiffness_n_per_m, ContactStiffness, "stops", "contact_stiffness", "N/m", Positive;
    /// Damping of the stops, N s/m: acts on a piston inside a stop, which never holds it back. More than that of a
    /// piston that comes to rest without a rebound, 2 sqrt(k_c m), acts as that.
    stop_damping_n_s_per_m, StopDamping, "stops", "damping", "N s/m", NonNegative;
    /// Ratio of specific heats gamma.
    ratio_of_specific_heats, RatioOfSpecificHeats, "gas", "ratio_of_specific_heats", "", AboveOne;
    /// Specific gas constant R, J/(kg K).
    specific_gas_constant_j_per_kg_k, SpecificGasConstant, "gas", "specific_gas_constant", "J/(kg K)", Positive;
    /// Compressibility factor Z.
    compressibility, Compressibility, "gas", "compressibility", "", Positive;
    /// Supply pressure p_s, Pa absolute.
    supply_pressure_pa, SupplyPressure, "pneumatics", "supply_pressure", "Pa", Positive;
    /// Atmospheric pressure p_atm, Pa absolute.
    ambient_pressure_pa, AmbientPressure, "pneumatics", "ambient_pressure", "Pa", Positive;
    /// Gas, supply and wall temperature T, K.
    temperature_k, Temperature, "pneumatics", "temperature", "K", Positive;
    /// Volume between solenoid and port V_p, m³.
    pipe_volume_m3, PipeVolume, "pneumatics", "pipe_volume", "m3", Positive;
    /// Flow coefficient C, multiplies every geometric area.
    flow_coefficient, FlowCoefficient, "pneumatics", "flow_coefficient", "", Positive;
    /// Geometric orifice area of the solenoid A_sol, m².
    solenoid_orifice_area_m2, SolenoidOrificeArea, "pneumatics", "solenoid_orifice_area", "m2", Positive;
    /// Geometric orifice area of the cylinder port A_port, m².
    port_orifice_area_m2, PortOrificeArea, "pneumatics", "port_orifice_area", "m2", Positive;
}

impl ParameterId {
    /// What stands in for a parameter that a valve file may leave out, SI; nothing where it must be given. A file
    /// that leaves it out is as if there were no such parameter.
    #[must_use]
    pub fn default_value(self) -> Option<f64> {
        (self == Self::StopDamping).then_some(0.0)
    }
}

/// When the commands of one cycle are given, s from its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Schedule {
    /// The solenoid is energised, s.
    pub close_at_s: f64,
    /// The solenoid is de-energised, s.
    pub open_at_s: f64,
    /// The cycle ends and the next may begin, s.
    pub end_s: f64,
}

/// The longest stroke times that are still acceptable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Longest closing time, s.
    pub close_within_s: f64,
    /// Longest opening time, s.
    pub open_within_s: f64,
}

/// Where the limit switches sit, as fractions of the stroke (0 closed, 1 open).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Switches {
    /// The valve counts as closed at or below this fraction.
    pub closed_at: f64,
    /// The valve counts as open at or above this fraction.
    pub open_at: f64,
}

impl Default for Switches {
    fn default() -> Self {
        Self { closed_at: 0.0, open_at: 1.0 }
    }
}

/// A parameter set that cannot be simulated, and what would be right.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParameterError {
    /// A value outside its domain.
    #[error("{key} is {value} {unit}, expected {expected}")]
    OutOfDomain {
        /// Dotted key of the parameter.
        key: String,
        /// The value found, SI.
        value: f64,
        /// Its SI unit.
        unit: &'static str,
        /// What would be right.
        expected: String,
    },
    /// Two values that contradict each other.
    #[error("{key} is {found}, expected {expected}")]
    Inconsistent {
        /// Dotted key of the parameter to look at first.
        key: String,
        /// What was found.
        found: String,
        /// What would be right.
        expected: String,
    },
}

impl ParameterError {
    /// The dotted key of the parameter that the error is about.
    #[must_use]
    pub fn key(&self) -> &str {
        match self {
            Self::OutOfDomain { key, .. } | Self::Inconsistent { key, .. } => key,
        }
    }
}

/// Checks the parameters, each alone and together.
pub(crate) fn check_parameters(parameters: &Parameters) -> Result<(), ParameterError> {
    for &id in ParameterId::ALL {
        let value = parameters.get(id);
        if !id.domain().contains(value) {
            return Err(ParameterError::OutOfDomain {
                key: id.key().into(),
                value,
                unit: id.si_unit(),
                expected: id.domain().words().into(),
            });
        }
    }
    if parameters.supply_pressure_pa <= parameters.ambient_pressure_pa {
        return Err(ParameterError::Inconsistent {
            key: ParameterId::SupplyPressure.key().into(),
            found: format!("{} Pa absolute", parameters.supply_pressure_pa),
            expected: format!(
                "more than the ambient pressure of {} Pa (is it meant as a gauge pressure, such as \"75 psig\"?)",
                parameters.ambient_pressure_pa
            ),
        });
    }
    // Vented, the spring and the weight press the piston into the open stop, out of the dead volume.
    let weight = STANDARD_GRAVITY_M_PER_S2 * parameters.moving_mass_kg * parameters.orientation.closing_share();
    let force = parameters.spring_stiffness_n_per_m * parameters.preload_compression_m - weight;
    let beyond_m = force / (parameters.spring_stiffness_n_per_m + parameters.contact_stiffness_n_per_m);
    if parameters.dead_volume_m3 <= 2.0 * parameters.piston_area_m2 * beyond_m {
        return Err(ParameterError::Inconsistent {
            key: ParameterId::DeadVolume.key().into(),
            found: format!("{} m3", parameters.dead_volume_m3),
            expected: format!(
                "more than {:.3e} m3: the spring presses the open stop in by {beyond_m:.3e} m (or a stiffer stop, see {})",
                2.0 * parameters.piston_area_m2 * beyond_m,
                ParameterId::ContactStiffness.key()
            ),
        });
    }
    Ok(())
}

/// Checks that the switches follow each other.
pub(crate) fn check_switches(switches: Switches) -> Result<(), ParameterError> {
    let ordered = switches.closed_at >= 0.0 && switches.closed_at < switches.open_at && switches.open_at <= 1.0;
    if ordered {
        Ok(())
    } else {
        Err(ParameterError::Inconsistent {
            key: "switches.closed_at".into(),
            found: format!("{} with open_at {}", switches.closed_at, switches.open_at),
            expected: "fractions of the stroke with 0 <= closed_at < open_at <= 1".into(),
        })
    }
}

impl Schedule {
    /// Checks that close, open and end follow each other.
    pub fn check(&self) -> Result<(), ParameterError> {
        let finite = self.close_at_s.is_finite() && self.open_at_s.is_finite() && self.end_s.is_finite();
        if finite && self.close_at_s >= 0.0 && self.open_at_s > self.close_at_s && self.end_s > self.open_at_s {
            Ok(())
        } else {
            Err(ParameterError::Inconsistent {
                key: "cycle.open_at".into(),
                found: format!("close at {} s, open at {} s, end at {} s", self.close_at_s, self.open_at_s, self.end_s),
                expected: "0 s <= close_at < open_at < end".into(),
            })
        }
    }
}

impl Limits {
    /// Checks that both limits are times that can be kept.
    pub fn check(&self) -> Result<(), ParameterError> {
        for (key, value) in [("limits.close_within", self.close_within_s), ("limits.open_within", self.open_within_s)] {
            if !Domain::Positive.contains(value) {
                return Err(ParameterError::OutOfDomain {
                    key: key.into(),
                    value,
                    unit: "s",
                    expected: Domain::Positive.words().into(),
                });
            }
        }
        Ok(())
    }
}
