//! What a drawn valve hides from its user: the catalogue's effects and things outside of it.

/// Catalogue effects as one set of numbers; the default hides nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Hidden {
    /// How all dry friction of this valve gives before it slides.
    pub bristles: Bristles,
    /// Dry friction, if any.
    pub dry_friction: Option<DryFriction>,
    /// Seal friction per pressure of the chamber, m2.
    pub seal_friction_m2: f64,
    /// How many times as much seals hold at rest.
    pub seal_holds: f64,
    /// Speed over which that turns into sliding, m/s.
    pub seal_stribeck_m_per_s: f64,
    /// Relative growth of the spring force over the stroke.
    pub hardening: f64,
    /// Damping and length of the cushion at the closed stop.
    pub closing_cushion: (f64, f64),
    /// Damping and length of the cushion at the open stop.
    pub opening_cushion: (f64, f64),
    /// Force and reach of the adhesion at the seat.
    pub seat_adhesion: (f64, f64),
    /// Force and exponent of the process pressure on the plug.
    pub process_force: (f64, f64),
    /// Heat passed between gas and wall in W/K; none: the gas keeps the wall's temperature.
    pub wall_conductance_w_per_k: Option<f64>,
    /// Resistance in Pa s/kg and volume in m3 of the supply line.
    pub supply_droop: Option<(f64, f64)>,
    /// Area of the vent port over that of the supply port.
    pub vent_factor: f64,
    /// Gauge pressure behind the vent port.
    pub back_pressure_pa: f64,
    /// Critical ratio of ISO 6358, where that law holds.
    pub critical_ratio: Option<f64>,
    /// Standing leak from the pipe to the atmosphere, geometric.
    pub leak_to_atmosphere_m2: f64,
    /// Standing leak from the supply into the pipe, geometric.
    pub leak_from_supply_m2: f64,
    /// Moving spool of the solenoid.
    pub solenoid: Spool,
    /// Time constant of the position sensor.
    pub sensor_lag_s: f64,
    /// Recorded time of the position minus true time.
    pub clock_offset_s: f64,
    /// Things no catalogue holds.
    pub outside: Vec<Outside>,
    /// How this valve's laws differ from those everybody writes down.
    pub laws: Laws,
    /// A constant force on the moving part, + opens.
    pub load_n: f64,
}

/// Laws that are nearly those everybody writes down; the default is exactly those.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Laws {
    /// Dry friction is 1 + this times as large while closing, 1 - this while opening.
    pub friction_asymmetry: f64,
    /// Dry friction is 1 + this (x/L - 1/2) times as large at the place x.
    pub friction_slope: f64,
    /// Damping of the stops per their force, s/m (K. H. Hunt, F. R. E. Crossley, "Coefficient of restitution
    /// interpreted as damping in vibroimpact", J. Appl. Mech. 42, 1975).
    pub stop_damping_s_per_m: f64,
    /// Share of Perry's dependence of the discharge coefficient on the pressure ratio.
    pub perry_share: f64,
    /// Heat capacity of the walls of chamber and of pipe over their exchange with the gas, s; none: they keep their temperature.
    pub wall_time_s: Option<f64>,
    /// Exhaust through a silencer: geometric area of its pores in m2 and volume in m3.
    pub silencer: Option<(f64, f64)>,
}

/// How dry friction gives before it slides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bristles {
    /// As elastomer seals do: 0.2 MN/m, some tenths of a millimetre.
    Compliant,
    /// As metal does: about a micrometre.
    Stiff,
    /// Of a stiffness in N/m.
    Of(f64),
}

/// Dry friction that does not depend on the place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DryFriction {
    /// Friction when sliding fast, N.
    pub coulomb_n: f64,
    /// Friction that holds at rest, N.
    pub static_n: f64,
    /// Speed over which the one turns into the other.
    pub stribeck_m_per_s: f64,
}

/// Delays of the solenoid.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spool {
    /// From energising to the first movement.
    pub energise_s: f64,
    /// From de-energising to the first movement.
    pub release_s: f64,
    /// Time of the full travel.
    pub travel_s: f64,
}

/// An effect that no catalogue holds, in SI units; x is 0 closed.
#[derive(Debug, Clone, PartialEq)]
pub enum Outside {
    /// Friction raised by `height_n` exp(-((x - centre)/width)^2).
    FrictionBump {
        /// Added friction at the middle.
        height_n: f64,
        /// Place of the middle.
        centre_m: f64,
        /// Half width at 1/e.
        width_m: f64,
    },
    /// Gas escapes past the piston seal, chamber to atmosphere, area as a bell over x.
    WornLiner {
        /// Geometric area at the middle.
        area_m2: f64,
        /// Place of the middle.
        centre_m: f64,
        /// Half width at 1/e.
        width_m: f64,
    },
    /// A leak from chamber to atmosphere that opens in the upper half of the stroke.
    UpperLeak {
        /// Geometric area when open.
        area_m2: f64,
        /// Place above which it opens, over the last tenth of the stroke's length.
        from_m: f64,
        /// Length over which it opens.
        over_m: f64,
    },
    /// The supply pressure swings.
    SupplyRipple {
        /// Amplitude.
        amplitude_pa: f64,
        /// Frequency in Hz.
        frequency_hz: f64,
        /// Phase at the command.
        phase_rad: f64,
    },
    /// Friction that grows with the logarithm of the time at rest and wears off over a distance.
    DwellFriction {
        /// Friction per e-fold of the time at rest.
        force_n: f64,
        /// Time from which it grows.
        onset_s: f64,
        /// Distance over which it wears off.
        distance_m: f64,
    },
    /// Friction while the valve closes, over the lower part of the stroke only.
    ClosingDrag {
        /// Friction.
        force_n: f64,
        /// Place below which it drags.
        below_m: f64,
    },
    /// Damping with the square of the speed, N s2/m2.
    QuadraticDamping {
        /// Coefficient.
        coefficient: f64,
    },
    /// A second spring, or a bumper, that the piston meets on its way to the closed side; it pushes back.
    SecondSpring {
        /// Its rate, N/m.
        rate_n_per_m: f64,
        /// Place where the piston meets it.
        from_m: f64,
    },
    /// A force amplitude sin(2 pi waves x/L + phase), + opens.
    WavyForce {
        /// Amplitude.
        amplitude_n: f64,
        /// Waves over the stroke.
        waves: f64,
        /// Phase.
        phase_rad: f64,
    },
    /// A spring-loaded ball over a groove: force -F u exp(1/2 - u^2/2), u = (x - centre)/width.
    Detent {
        /// Largest force.
        force_n: f64,
        /// Place of the groove.
        centre_m: f64,
        /// Distance of the largest force from it.
        width_m: f64,
    },
}

impl Default for Hidden {
    fn default() -> Self {
        Self {
            bristles: Bristles::Compliant,
            dry_friction: None,
            seal_friction_m2: 0.0,
            seal_holds: 1.0,
            seal_stribeck_m_per_s: 0.01,
            hardening: 0.0,
            closing_cushion: (0.0, 4e-3),
            opening_cushion: (0.0, 4e-3),
            seat_adhesion: (0.0, 0.3e-3),
            process_force: (0.0, 1.0),
            wall_conductance_w_per_k: None,
            supply_droop: None,
            vent_factor: 1.0,
            back_pressure_pa: 0.0,
            critical_ratio: None,
            leak_to_atmosphere_m2: 0.0,
            leak_from_supply_m2: 0.0,
            solenoid: Spool::default(),
            sensor_lag_s: 0.0,
            clock_offset_s: 0.0,
            outside: Vec::new(),
            laws: Laws::default(),
            load_n: 0.0,
        }
    }
}
