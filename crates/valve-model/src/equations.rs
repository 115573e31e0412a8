//! From a checked valve and the conditions of a run to its equations of motion.

use crate::bristles;
use crate::coefficients::Coefficients;
use crate::conditions::Conditions;
use crate::custom::{CustomEffect, CustomTarget};
use crate::demand::{Cause, Demand, FOLLOWED_RATE};
use crate::effects::{ActsOn, Assembly, Laws};
use crate::fidelity::Fidelity;
use crate::orifice::{EASED_LAMINAR, Laminar, OrificeLaw};
use crate::params::STANDARD_GRAVITY_M_PER_S2;
use crate::terms::Terms;
use crate::valve::Valve;

/// No laminar width needs to be narrower than this.
pub(crate) const NARROWEST_LAMINAR: f64 = 1e-5;

/// Bound of the rates that catalogue effects bring in, 1/s: sliding bristles, gas at the walls and
/// cushions settle no faster. What they settle to is not changed, and no stroke shows a difference.
/// Where [`Fidelity::roughness`] allows it, it is as much lower.
const FASTEST_PER_S: f64 = 1500.0;

/// Everything about one valve under the conditions of one run.
#[derive(Debug, Clone)]
pub struct Equations {
    /// The numbers of the base equations.
    pub coefficients: Coefficients<f64>,
    /// Those of the effects of the catalogue.
    pub(crate) laws: Laws<f64>,
    /// The groups of terms in use.
    pub terms: Terms,
    /// Custom effects, with their parameter values.
    pub custom: Vec<CustomEffect>,
    pub(crate) volumes: Volumes,
    /// What effects ask of the step.
    pub(crate) demands: Vec<Demand>,
    /// Whose stiffness the friction bristles have, where a friction of the catalogue says it.
    pub(crate) bristles: Option<Cause>,
    /// Whose the supply line is.
    pub(crate) line: Option<Cause>,
}

/// The volumes that hold gas, m³; the chamber with the valve open.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Volumes {
    pub pipe: f64,
    pub dead: f64,
}

impl Equations {
    /// The equations of a valve under the conditions of a run, to be followed as closely as `fidelity` says.
    pub fn new(valve: &Valve, conditions: &Conditions, fidelity: impl Into<Fidelity>) -> Self {
        let fidelity = fidelity.into();
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
            pipe_volume: p.pipe_volume_m3,
            fill: orifice(p.solenoid_orifice_area_m2),
            vent: orifice(p.solenoid_orifice_area_m2),
            port: orifice(p.port_orifice_area_m2),
            leak_out: orifice(conditions.leak_to_atmosphere_m2),
            leak_in: orifice(conditions.leak_from_supply_m2),
            port_ease: f64::INFINITY,
            pipe_ease: f64::INFINITY,
            temperature: conditions.temperature_k,
            inverse_temperature: 1.0 / conditions.temperature_k,
            gamma: p.ratio_of_specific_heats,
            work_gain: (p.ratio_of_specific_heats - 1.0) / p.specific_gas_constant_j_per_kg_k,
            line_gain: 0.0,
            bristle_stiffness: f64::INFINITY,
            bristle_damping: 0.0,
            quickest: fidelity.roughness / FASTEST_PER_S,
            law: OrificeLaw::ideal_nozzle(p.ratio_of_specific_heats),
            port_laminar: Laminar::new(EASED_LAMINAR),
            laminar: Laminar::new(NARROWEST_LAMINAR),
            line_laminar: Laminar::new(NARROWEST_LAMINAR),
        };
        let cushion = c.supply * c.piston_area * c.piston_area / p.dead_volume_m3;
        c.make_inert(c.contact.max(cushion), fidelity);
        terms.stop_damping = p.stop_damping_n_s_per_m > 0.0;
        terms.forces |= terms.stop_damping;
        terms.spool = valve.solenoid().travel_time_s > 0.0;
        let (mut laws, mut demands) = (Laws::absent(), Vec::new());
        let (mut bristles, mut line) = (None, None);
        for effect in valve.effects().iter().filter(|effect| !effect.is_neutral()) {
            let mut assembly = Assembly {
                parameters: p,
                coefficients: &mut c,
                laws: &mut laws,
                terms: &mut terms,
                demands: &mut demands,
                bristles: &mut bristles,
                line: &mut line,
            };
            if let ActsOn::Mechanics(add) | ActsOn::Pneumatics(add) = effect.kind().info().acts_on {
                add(effect.values(), &mut assembly);
            }
        }
        if c.bristle_stiffness.is_infinite() {
            c.bristle_stiffness = bristles::STIFFNESS_N_PER_M;
        }
        c.bristle_damping = bristles::damping_n_s_per_m(c.bristle_stiffness);
        if terms.friction {
            c.make_inert(c.contact + c.bristle_stiffness, fidelity);
        }
        for effect in valve.custom() {
            terms.custom = true;
            terms.friction |= effect.target() == CustomTarget::Friction;
        }
        let custom = valve.custom().to_vec();
        let volumes = Volumes { pipe: p.pipe_volume_m3, dead: p.dead_volume_m3 };
        Self { coefficients: c, laws, terms, custom, volumes, demands, bristles, line }
    }
}

impl Coefficients<f64> {
    /// Makes the piston so inert that its swing on a stiffness, N/m, does not ask for shorter steps than wanted, as far
    /// as that is allowed.
    fn make_inert(&mut self, stiffness: f64, fidelity: Fidelity) {
        let wanted = stiffness * (fidelity.step_s / FOLLOWED_RATE).powi(2);
        let inert = wanted.min(fidelity.most_inert_kg);
        if inert > self.mass {
            self.mass = inert;
            self.inverse_mass = 1.0 / inert;
        }
    }
}

impl Equations {
    /// What the formula of each custom effect is evaluated with.
    pub fn custom_operands(&self) -> Vec<Vec<f64>> {
        self.custom.iter().map(CustomEffect::operands).collect()
    }
}
