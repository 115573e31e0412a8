//! From a checked valve and the conditions of a run to the numbers of the equations of motion.

use crate::conditions::Conditions;
use crate::custom::CustomEffect;
use crate::effects::EffectKind;
use crate::orifice::{BLEND_SLOPE, OrificeLaw};
use crate::params::{STANDARD_GRAVITY_M_PER_S2, Valve};
use crate::real::Real;

/// Relative pressure difference below which orifice flow turns linear.
pub(crate) const BLEND: f64 = 1e-4;

/// Which groups of terms the equations of a valve have beside the base model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
#[expect(clippy::struct_excessive_bools, reason = "each is an independent group of terms of the equations")]
pub struct Terms {
    /// Forces on the piston: cushions, seat, process, progressive spring.
    pub forces: bool,
    /// A process force with an exponent other than 1.
    pub power: bool,
    /// Dry friction, seal friction or a custom friction.
    pub friction: bool,
    /// Static friction above the Coulomb friction.
    pub stribeck: bool,
    /// Gas temperatures as states.
    pub heating: bool,
    /// Supply line pressure as a state.
    pub line: bool,
    /// A spool that travels.
    pub spool: bool,
    /// Custom effects.
    pub custom: bool,
    /// The pipe pressure is measured, not simulated.
    pub driven_pipe: bool,
    /// The chamber pressure is measured, not simulated.
    pub driven_chamber: bool,
}

impl Terms {
    /// Whether the base model alone does.
    pub fn is_base(self) -> bool {
        self == Self::default()
    }
}

macro_rules! coefficients {
    ($( $(#[$doc:meta])* $field:ident, )*) => {
        /// The numbers of the equations, for one valve or for several in lanes.
        #[derive(Debug, Clone, Copy)]
        pub struct Coefficients<R> {
            $( $(#[$doc])* pub $field: R, )*
            /// The law of all orifices.
            pub law: OrificeLaw<R>,
        }

        impl<R: Real> Coefficients<R> {
            /// Puts one valve's numbers into a lane.
            pub fn set_lane(&mut self, lane: usize, from: &Coefficients<f64>) {
                $( self.$field.set_lane(lane, from.$field); )*
                for (power, q) in self.law.q.iter_mut().enumerate() {
                    q.set_lane(lane, from.law.q[power]);
                }
                self.law.centre.set_lane(lane, from.law.centre);
                self.law.scale.set_lane(lane, from.law.scale);
                self.law.critical.set_lane(lane, from.law.critical);
                self.law.blend.set_lane(lane, from.law.blend);
                self.law.inverse_blend.set_lane(lane, from.law.inverse_blend);
            }

            /// The same valve in every lane.
            pub fn splat(from: &Coefficients<f64>) -> Self {
                let law = &from.law;
                Self {
                    $( $field: R::splat(from.$field), )*
                    law: OrificeLaw {
                        q: core::array::from_fn(|power| R::splat(law.q[power])),
                        centre: R::splat(law.centre),
                        scale: R::splat(law.scale),
                        critical: R::splat(law.critical),
                        blend: R::splat(law.blend),
                        inverse_blend: R::splat(law.inverse_blend),
                    },
                }
            }
        }
    };
}

coefficients! {
    /// 1/m, 1/kg.
    inverse_mass,
    /// Spring stiffness k, N/m.
    stiffness,
    /// L + x0: the spring force is k (free_length - x), m.
    free_length,
    /// Stroke L, m.
    stroke,
    /// Piston area A_p, m².
    piston_area,
    /// Viscous friction r, N s/m.
    viscous,
    /// Weight in the closing direction, N.
    weight,
    /// Stop stiffness, N/m.
    contact,
    /// Ambient pressure, Pa.
    ambient,
    /// Supply pressure, Pa.
    supply,
    /// Exhaust pressure, Pa.
    exhaust,
    /// Chamber volume at x = 0, m³.
    closed_volume,
    /// Z R T, J/kg.
    zrt,
    /// Z R, J/(kg K).
    zr,
    /// Z R T / V_p, Pa/kg.
    pipe_gain,
    /// C A / sqrt(Z R T) of the solenoid's supply port, kg/(s Pa).
    fill,
    /// The same of its vent port.
    vent,
    /// The same of the cylinder port.
    port,
    /// The same of a leak to atmosphere.
    leak_out,
    /// The same of a leak from the supply.
    leak_in,
    /// Run temperature, K.
    temperature,
    /// Ratio of specific heats.
    gamma,
    /// Wall conductance over c_v, kg/s.
    wall,
    /// 1/c_v = (gamma - 1)/R, kg K/J.
    work_gain,
    /// 1/R_d, kg/(s Pa).
    line_conductance,
    /// Z R T / V of the supply line, Pa/kg.
    line_gain,
    /// Hardening over stroke, 1/m.
    hardening,
    /// Damping of the closing cushion, N s/m.
    closing_damping,
    /// 1 over its length, 1/m.
    closing_inverse_length,
    /// Damping of the opening cushion, N s/m.
    opening_damping,
    /// 1 over its length, 1/m.
    opening_inverse_length,
    /// Seat adhesion, N.
    adhesion,
    /// 1 over its reach, 1/m.
    adhesion_inverse_reach,
    /// Process force, N.
    process,
    /// Its exponent.
    process_exponent,
    /// Coulomb force, N.
    coulomb,
    /// Static force minus Coulomb force, N.
    static_excess,
    /// 1 over the Stribeck velocity, s/m.
    inverse_stribeck,
    /// Seal friction per pressure, m².
    seal,
}

/// Everything about one valve under the conditions of one run.
#[derive(Debug, Clone)]
pub struct Equations {
    /// The numbers.
    pub coefficients: Coefficients<f64>,
    /// The groups of terms in use.
    pub terms: Terms,
    /// Custom effects, with their parameter values.
    pub custom: Vec<CustomEffect>,
    /// The fastest rate of the equations, 1/s: sets the number of substeps.
    pub fastest_rate_per_s: f64,
}

impl Equations {
    /// The equations of a valve under the conditions of a run.
    pub fn new(valve: &Valve, conditions: &Conditions) -> Self {
        let p = valve.parameters();
        let zr = p.compressibility * p.specific_gas_constant_j_per_kg_k;
        let zrt = zr * conditions.temperature_k;
        let orifice = |area: f64| p.flow_coefficient * area / libm::sqrt(zrt);
        let scale = |area: f64| if area == 0.0 { 0.0 } else { 1.0 / area };
        let mut terms = Terms::default();
        let mut c = Coefficients {
            inverse_mass: 1.0 / p.moving_mass_kg,
            stiffness: p.spring_stiffness_n_per_m,
            free_length: p.stroke_m + p.preload_compression_m,
            stroke: p.stroke_m,
            piston_area: p.piston_area_m2,
            viscous: p.viscous_friction_n_s_per_m,
            weight: p.moving_mass_kg * STANDARD_GRAVITY_M_PER_S2 * p.orientation.closing_share(),
            contact: p.contact_stiffness_n_per_m,
            ambient: p.ambient_pressure_pa,
            supply: conditions.supply_pressure_pa,
            exhaust: p.ambient_pressure_pa,
            closed_volume: p.dead_volume_m3 + p.piston_area_m2 * p.stroke_m,
            zrt,
            zr,
            pipe_gain: zrt / p.pipe_volume_m3,
            fill: orifice(p.solenoid_orifice_area_m2),
            vent: orifice(p.solenoid_orifice_area_m2),
            port: orifice(p.port_orifice_area_m2),
            leak_out: orifice(conditions.leak_to_atmosphere_m2),
            leak_in: orifice(conditions.leak_from_supply_m2),
            temperature: conditions.temperature_k,
            gamma: p.ratio_of_specific_heats,
            wall: 0.0,
            work_gain: (p.ratio_of_specific_heats - 1.0) / p.specific_gas_constant_j_per_kg_k,
            line_conductance: 0.0,
            line_gain: 0.0,
            hardening: 0.0,
            closing_damping: 0.0,
            closing_inverse_length: 0.0,
            opening_damping: 0.0,
            opening_inverse_length: 0.0,
            adhesion: 0.0,
            adhesion_inverse_reach: 0.0,
            process: 0.0,
            process_exponent: 1.0,
            coulomb: 0.0,
            static_excess: 0.0,
            inverse_stribeck: 0.0,
            seal: 0.0,
            law: OrificeLaw::ideal_nozzle(p.ratio_of_specific_heats, BLEND),
        };
        let mut line_volume = 0.0;
        for effect in valve.effects().iter().filter(|effect| !effect.is_neutral()) {
            let values = effect.values();
            match effect.kind() {
                EffectKind::DryFriction => {
                    terms.friction = true;
                    terms.stribeck |= values[1] > values[0];
                    c.coulomb = values[0];
                    c.static_excess = values[1] - values[0];
                    c.inverse_stribeck = scale(values[2]);
                }
                EffectKind::SealFriction => {
                    terms.friction = true;
                    c.seal = values[0];
                }
                EffectKind::ProgressiveSpring => {
                    terms.forces = true;
                    c.hardening = values[0] / p.stroke_m;
                }
                EffectKind::ClosingCushion => {
                    terms.forces = true;
                    c.closing_damping = values[0];
                    c.closing_inverse_length = scale(values[1]);
                }
                EffectKind::OpeningCushion => {
                    terms.forces = true;
                    c.opening_damping = values[0];
                    c.opening_inverse_length = scale(values[1]);
                }
                EffectKind::SeatAdhesion => {
                    terms.forces = true;
                    c.adhesion = values[0];
                    c.adhesion_inverse_reach = scale(values[1]);
                }
                EffectKind::ProcessForce => {
                    terms.forces = true;
                    terms.power |= values[1] != 1.0;
                    c.process = values[0];
                    c.process_exponent = values[1];
                }
                EffectKind::GasHeating => {
                    terms.heating = true;
                    c.wall = values[0] * c.work_gain;
                }
                EffectKind::SupplyDroop => {
                    terms.line = true;
                    c.line_conductance = 1.0 / values[0];
                    line_volume = values[1];
                    c.line_gain = zrt / line_volume;
                }
                EffectKind::VentRestriction => c.vent *= values[0],
                EffectKind::BackPressure => c.exhaust += values[0],
                EffectKind::OrificeLaw => {
                    c.law = OrificeLaw::iso_6358(p.ratio_of_specific_heats, values[0], BLEND);
                }
                EffectKind::LeakToAtmosphere => c.leak_out += orifice(values[0]),
                EffectKind::LeakFromSupply => c.leak_in += orifice(values[0]),
                EffectKind::SolenoidLag => terms.spool = values[2] > 0.0,
                EffectKind::SensorLag | EffectKind::ClockOffset => {}
            }
        }
        for effect in valve.custom() {
            terms.custom = true;
            terms.friction |= effect.target() == crate::custom::CustomTarget::Friction;
        }
        let fastest_rate_per_s = fastest_rate(&c, terms, p.pipe_volume_m3, p.dead_volume_m3, line_volume);
        Self { coefficients: c, terms, custom: valve.custom().to_vec(), fastest_rate_per_s }
    }
}

impl Equations {
    /// The parameter values of each custom effect.
    pub fn custom_values(&self) -> Vec<Vec<f64>> {
        let values = |effect: &CustomEffect| effect.parameters().iter().map(|parameter| parameter.value).collect();
        self.custom.iter().map(values).collect()
    }
}

/// An upper bound of the rates at which a disturbance of each state decays, 1/s.
fn fastest_rate(c: &Coefficients<f64>, terms: Terms, pipe_volume: f64, dead_volume: f64, line_volume: f64) -> f64 {
    // Slope of an orifice's flow over the pressure difference at equal pressures, kg/(s Pa).
    let slope = |coefficient: f64| coefficient * BLEND_SLOPE * c.law.shape(1.0 - c.law.blend) * c.law.inverse_blend;
    let warming = if terms.heating { c.gamma } else { 1.0 };
    let solenoid = c.fill.max(c.vent) + c.leak_in + c.leak_out;
    let pipe = warming * c.zrt * (slope(c.port + solenoid) / pipe_volume + slope(c.port) / dead_volume);
    let line = if terms.line { c.line_gain * (c.line_conductance + slope(c.fill)) } else { 0.0 };
    let line = if line_volume > 0.0 { line } else { 0.0 };
    let damping = (c.viscous + c.closing_damping.max(c.opening_damping)) * c.inverse_mass;
    let spring = libm::sqrt((c.contact + c.adhesion * c.adhesion_inverse_reach) * c.inverse_mass);
    let wall = if terms.heating {
        let smallest_mass = c.ambient.min(c.exhaust) * pipe_volume.min(dead_volume) / c.zrt;
        c.gamma * c.wall / smallest_mass
    } else {
        0.0
    };
    pipe.max(line).max(damping).max(spring).max(wall)
}
