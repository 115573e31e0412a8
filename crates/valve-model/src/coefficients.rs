//! From a checked valve and the conditions of a run to the numbers of the equations of motion.

use crate::conditions::Conditions;
use crate::custom::CustomEffect;
use crate::effects::{BRISTLE_STIFFNESS_N_PER_M, Effect, EffectKind};
use crate::orifice::{Blend, OrificeLaw};
use crate::params::{Parameters, STANDARD_GRAVITY_M_PER_S2, Valve};
use crate::real::Real;

/// No blend needs to be narrower than this.
pub(crate) const NARROWEST_BLEND: f64 = 1e-5;

/// Damping of friction bristles of the usual stiffness; it grows as its root, so that the piston rings on stiff
/// ones no longer than on soft ones.
const BRISTLE_DAMPING_N_S_PER_M: f64 = 250.0;

/// Bound of the rates that catalogue effects bring in, 1/s: sliding bristles, gas at the walls and
/// cushions settle no faster. What they settle to is not changed, and no stroke shows a difference.
/// Of a step longer than [`FINE_STEP_S`] it is as much lower.
const FASTEST_PER_S: f64 = 1500.0;

/// Steps up to this are held to the bounds above; a longer one is meant to be rough, and widens them.
const FINE_STEP_S: f64 = 1e-3;

/// How many times longer than a fine step a rough one is.
pub(crate) fn roughness(step_s: f64) -> f64 {
    (step_s / FINE_STEP_S).max(1.0)
}

/// Friction below which there is none, N.
pub(crate) const LEAST_FRICTION_N: f64 = 1e-6;

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
    /// Friction that depends on the direction or on the position.
    pub uneven: bool,
    /// Stops with a damping of their own.
    pub stop_damping: bool,
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
    /// The supply pressure is measured, not constant.
    pub driven_supply: bool,
}

/// Groups of terms as bits: for which of them a loop is compiled.
pub mod groups {
    /// Forces on the piston.
    pub const FORCES: u8 = 1;
    /// Friction.
    pub const FRICTION: u8 = 1 << 1;
    /// Gas temperatures.
    pub const HEATING: u8 = 1 << 2;
    /// The supply line.
    pub const LINE: u8 = 1 << 3;
    /// A spool that travels.
    pub const SPOOL: u8 = 1 << 4;
    /// Custom effects.
    pub const CUSTOM: u8 = 1 << 5;
    /// Measured pressures.
    pub const DRIVEN: u8 = 1 << 6;
    /// Any of them: asked at run time.
    pub const ANY: u8 = u8::MAX;
}

impl Terms {
    /// The groups in use; none for the base model.
    pub fn groups(self) -> u8 {
        let bit = |group: u8, used: bool| if used { group } else { 0 };
        bit(groups::FORCES, self.forces)
            | bit(groups::FRICTION, self.friction)
            | bit(groups::HEATING, self.heating)
            | bit(groups::LINE, self.line)
            | bit(groups::SPOOL, self.spool)
            | bit(groups::CUSTOM, self.custom)
            | bit(groups::DRIVEN, self.is_driven())
    }

    /// Whether any pressure is measured.
    pub fn is_driven(self) -> bool {
        self.driven_pipe || self.driven_chamber || self.driven_supply
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
            /// How it is blended at the port.
            pub port_blend: Blend<R>,
            /// How it is blended at the solenoid and at leaks.
            pub blend: Blend<R>,
            /// How it is blended where a supply line of its own pressure feeds them.
            pub line_blend: Blend<R>,
        }

        impl<R: Real> Coefficients<R> {
            /// Puts one valve's numbers into a lane.
            pub fn set_lane(&mut self, lane: usize, from: &Coefficients<f64>) {
                $( self.$field.set_lane(lane, from.$field); )*
                for (power, root) in self.law.root.iter_mut().enumerate() {
                    root.set_lane(lane, from.law.root[power]);
                }
                self.law.scale.set_lane(lane, from.law.scale);
                self.law.widest.set_lane(lane, from.law.widest);
                self.port_blend.set_lane(lane, from.port_blend);
                self.blend.set_lane(lane, from.blend);
                self.line_blend.set_lane(lane, from.line_blend);
            }

            /// The same valve in every lane.
            pub fn splat(from: &Coefficients<f64>) -> Self {
                let law = &from.law;
                Self {
                    $( $field: R::splat(from.$field), )*
                    law: OrificeLaw {
                        root: core::array::from_fn(|power| R::splat(law.root[power])),
                        scale: R::splat(law.scale),
                        widest: R::splat(law.widest),
                    },
                    port_blend: Blend::splat(from.port_blend),
                    blend: Blend::splat(from.blend),
                    line_blend: Blend::splat(from.line_blend),
                }
            }
        }
    };
}

coefficients! {
    /// Moving mass m, kg.
    mass,
    /// 1/m, 1/kg.
    inverse_mass,
    /// Spring stiffness k, N/m.
    stiffness,
    /// L + x0: the spring force is k (free_length - x), m.
    free_length,
    /// Stroke L, m.
    stroke,
    /// 1/L, 1/m.
    inverse_stroke,
    /// Piston area A_p, m².
    piston_area,
    /// Viscous friction r, N s/m.
    viscous,
    /// Weight in the closing direction, N.
    weight,
    /// Stop stiffness, N/m.
    contact,
    /// Stop damping, N s/m.
    stop_damping,
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
    /// 1 over it, 1/K.
    inverse_temperature,
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
    /// Dry friction while opening over that while closing.
    dry_opening,
    /// Seal friction while opening over that while closing.
    seal_opening,
    /// What dry friction is multiplied by at the closed stop.
    dry_closed,
    /// By how much that rises with the position, 1/m.
    dry_slope,
    /// Stiffness of the friction bristles, N/m.
    bristle_stiffness,
    /// Their damping, N s/m.
    bristle_damping,
    /// Time in which the fastest rate that effects bring in settles, s.
    quickest,
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
    pub(crate) volumes: Volumes,
}

/// The volumes that hold gas, m³; the chamber with the valve open.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Volumes {
    pub pipe: f64,
    pub dead: f64,
}

impl Equations {
    /// The equations of a valve under the conditions of a run, for steps of at most `step_s`.
    pub fn new(valve: &Valve, conditions: &Conditions, step_s: f64) -> Self {
        let p = valve.parameters();
        let zr = p.compressibility * p.specific_gas_constant_j_per_kg_k;
        let zrt = zr * conditions.temperature_k;
        let orifice = |area: f64| p.flow_coefficient * area / libm::sqrt(zrt);
        let mut terms = Terms::default();
        let mut c = Coefficients {
            mass: p.moving_mass_kg,
            inverse_mass: 1.0 / p.moving_mass_kg,
            stiffness: p.spring_stiffness_n_per_m,
            free_length: p.stroke_m + p.preload_compression_m,
            stroke: p.stroke_m,
            inverse_stroke: 1.0 / p.stroke_m,
            piston_area: p.piston_area_m2,
            viscous: p.viscous_friction_n_s_per_m,
            weight: p.moving_mass_kg * STANDARD_GRAVITY_M_PER_S2 * p.orientation.closing_share(),
            contact: p.contact_stiffness_n_per_m,
            // Beyond critical damping a stop is dead as well, and only harder to follow.
            stop_damping: p
                .stop_damping_n_s_per_m
                .min(2.0 * libm::sqrt(p.contact_stiffness_n_per_m * p.moving_mass_kg)),
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
            inverse_temperature: 1.0 / conditions.temperature_k,
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
            dry_opening: 1.0,
            seal_opening: 1.0,
            dry_closed: 1.0,
            dry_slope: 0.0,
            bristle_stiffness: f64::INFINITY,
            bristle_damping: 0.0,
            quickest: roughness(step_s) / FASTEST_PER_S,
            law: OrificeLaw::ideal_nozzle(p.ratio_of_specific_heats),
            port_blend: Blend::new(NARROWEST_BLEND),
            blend: Blend::new(NARROWEST_BLEND),
            line_blend: Blend::new(NARROWEST_BLEND),
        };
        terms.stop_damping = p.stop_damping_n_s_per_m > 0.0;
        terms.forces |= terms.stop_damping;
        for effect in valve.effects().iter().filter(|effect| !effect.is_neutral()) {
            add_effect(&mut c, &mut terms, effect, p, orifice);
        }
        if c.bristle_stiffness.is_infinite() {
            c.bristle_stiffness = BRISTLE_STIFFNESS_N_PER_M;
        }
        c.bristle_damping = BRISTLE_DAMPING_N_S_PER_M * libm::sqrt(c.bristle_stiffness / BRISTLE_STIFFNESS_N_PER_M);
        for effect in valve.custom() {
            terms.custom = true;
            terms.friction |= effect.target() == crate::custom::CustomTarget::Friction;
        }
        let custom = valve.custom().to_vec();
        let volumes = Volumes { pipe: p.pipe_volume_m3, dead: p.dead_volume_m3 };
        Self { coefficients: c, terms, custom, volumes }
    }
}

impl Equations {
    /// What the formula of each custom effect is evaluated with.
    pub fn custom_operands(&self) -> Vec<Vec<f64>> {
        self.custom.iter().map(CustomEffect::operands).collect()
    }
}

/// Adds one effect of the catalogue to the numbers of the base model. `orifice` turns an area into a
/// flow coefficient.
fn add_effect(
    c: &mut Coefficients<f64>,
    terms: &mut Terms,
    effect: &Effect,
    p: &Parameters,
    orifice: impl Fn(f64) -> f64,
) {
    let scale = |length: f64| if length == 0.0 { 0.0 } else { 1.0 / length };
    let values = effect.values();
    match effect.kind() {
        EffectKind::DryFriction => {
            terms.friction = true;
            terms.stribeck |= values[1] > values[0];
            c.coulomb = values[0];
            c.static_excess = values[1] - values[0];
            c.inverse_stribeck = scale(values[2]);
            // Frictions side by side share their bristles.
            c.bristle_stiffness = c.bristle_stiffness.min(values[3]);
            terms.uneven |= values[4] != 1.0 || values[5] != 0.0;
            c.dry_opening = values[4];
            c.dry_closed = 1.0 - 0.5 * values[5];
            c.dry_slope = values[5] / p.stroke_m;
        }
        EffectKind::SealFriction => {
            terms.friction = true;
            c.seal = values[0];
            c.bristle_stiffness = c.bristle_stiffness.min(values[1]);
            terms.uneven |= values[2] != 1.0;
            c.seal_opening = values[2];
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
            // A line that settles faster than anything else only shows its resistance.
            c.line_gain = (c.zrt / values[1]).min(values[0] / c.quickest);
        }
        EffectKind::VentRestriction => c.vent *= values[0],
        EffectKind::BackPressure => c.exhaust += values[0],
        EffectKind::OrificeLaw => {
            c.law = OrificeLaw::iso_6358(p.ratio_of_specific_heats, values[0]);
        }
        EffectKind::LeakToAtmosphere => c.leak_out += orifice(values[0]),
        EffectKind::LeakFromSupply => c.leak_in += orifice(values[0]),
        EffectKind::SolenoidLag => terms.spool = values[2] > 0.0,
        EffectKind::SensorLag | EffectKind::ClockOffset => {}
    }
}
