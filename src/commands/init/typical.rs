//! Values that a valve of this size usually has, for who does not know better.
//!
//! They come from the proportions of one known valve (63 mm bore, 25.4 mm stroke, closing in a second at 5 bar) and of
//! common pneumatic cylinders, and carry wide tolerances: a calibration replaces them.

use std::f64::consts::PI;

/// What is known when a typical value is asked for, SI.
#[derive(Debug, Clone, Copy)]
pub struct Size {
    /// Travel, m.
    pub stroke_m: f64,
    /// Effective area of the piston, m2.
    pub area_m2: f64,
    /// Supply pressure above the atmosphere, Pa.
    pub supply_gauge_pa: f64,
}

/// Share of the supply's force that the spring has with the valve open.
const PRELOAD_SHARE: f64 = 0.35;
/// The same with the valve closed.
const CLOSED_SHARE: f64 = 0.6;
/// Clearance of the chamber behind the piston, m.
const CLEARANCE_M: f64 = 0.01;
/// Density of steel and aluminium, kg/m3.
const STEEL: f64 = 7850.0;
const ALUMINIUM: f64 = 2700.0;
/// Viscous friction of a bore of one metre, N s/m: that of the known valve over its bore.
const FRICTION_OF_BORE: f64 = 600.0 / 0.063;
/// Piston over solenoid, and port over solenoid, areas of the known valve.
const PISTON_OVER_SOLENOID: f64 = 6200.0;
const PORT_OVER_SOLENOID: f64 = 7.0;

/// How far the supply's whole force presses a stop in, m: that of the known valve.
const PRESSED_IN_M: f64 = 1.6e-3;
/// No stop is softer, N/m.
const SOFTEST_STOP_N_PER_M: f64 = 1e6;

impl Size {
    fn bore_m(self) -> f64 {
        (4.0 * self.area_m2 / PI).sqrt()
    }

    fn supply_force_n(self) -> f64 {
        self.supply_gauge_pa * self.area_m2
    }

    /// Stiffness of the spring, N/m.
    pub fn stiffness_n_per_m(self) -> f64 {
        (CLOSED_SHARE - PRELOAD_SHARE) * self.supply_force_n() / self.stroke_m
    }

    /// Stiffness of the stops, N/m.
    pub fn contact_n_per_m(self) -> f64 {
        SOFTEST_STOP_N_PER_M.max(self.supply_force_n() / PRESSED_IN_M)
    }

    /// Compression with the valve open, m.
    pub fn preload_m(self) -> f64 {
        PRELOAD_SHARE * self.supply_force_n() / self.stiffness_n_per_m()
    }

    /// Piston of aluminium, rod of steel, and as much again for stem and plug, kg.
    pub fn mass_kg(self) -> f64 {
        let bore_m = self.bore_m();
        let rod = STEEL * 0.25 * PI * (0.25 * bore_m).powi(2) * (self.stroke_m + 2.0 * bore_m);
        2.0 * (rod + ALUMINIUM * self.area_m2 * 0.3 * bore_m)
    }

    /// Volume of the chamber with the valve open, m3.
    pub fn dead_volume_m3(self) -> f64 {
        self.area_m2 * CLEARANCE_M
    }

    /// Viscous friction, N s/m.
    pub fn friction_n_s_per_m(self) -> f64 {
        FRICTION_OF_BORE * self.bore_m()
    }

    /// Orifice of the solenoid, m2.
    pub fn solenoid_m2(self) -> f64 {
        self.area_m2 / PISTON_OVER_SOLENOID
    }

    /// Orifice of the port, m2.
    pub fn port_m2(self) -> f64 {
        PORT_OVER_SOLENOID * self.solenoid_m2()
    }

    /// A hose of 1.4 m with 6 mm inside, more for larger ports, m3.
    pub fn pipe_m3(self) -> f64 {
        (4e-5_f64).max(0.5 * self.area_m2 * self.stroke_m)
    }
}
