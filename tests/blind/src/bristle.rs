//! Dry friction as a carpet of bristles, in two kinds.
//!
//! Compliant bristles follow the equations of Lund and Grenoble (C. Canudas de Wit, H. Olsson, K. J. Astrom,
//! P. Lischinsky, "A new model for control of systems with friction", IEEE Trans. Automatic
//! Control 40(3), 1995): elastomer seals give by a tenth of a millimetre or two before they slide,
//! and a friction that changes along the bore follows over that distance.
//!
//! Stiff bristles yield at about a micrometre and do not creep below it (P. Dupont, V. Hayward,
//! B. Armstrong, F. Altpeter, "Single state elastoplastic friction models", IEEE Trans. Automatic
//! Control 47(5), 2002): as good as Coulomb's law with a true standstill.

use crate::hidden::Bristles;

/// Stiffness of compliant bristles.
const COMPLIANT_N_PER_M: f64 = 2e5;
/// Damping of compliant bristles.
const COMPLIANT_NS_PER_M: f64 = 250.0;
/// Damping of bristles of a given stiffness, over the square root of stiffness times mass.
const DAMPING_SHARE: f64 = 0.45;
/// Deflection at which stiff bristles reach the largest friction of a valve.
const STIFF_DEFLECTION_M: f64 = 1e-6;
/// Fraction of the sliding deflection below which stiff bristles are purely elastic.
const ELASTIC_SHARE: f64 = 0.9;
/// Friction below which there is none: keeps the deflection of sliding off zero.
const LEAST_N: f64 = 0.1;

/// What the surfaces can hold at this moment.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Grip {
    /// Friction when sliding fast.
    pub sliding_n: f64,
    /// Friction that holds at rest.
    pub holding_n: f64,
}

/// The constants of the bristles of one valve.
#[derive(Debug, Clone)]
pub(crate) struct Bristle {
    stiffness_n_per_m: f64,
    damping_ns_per_m: f64,
    stribeck_m_per_s: f64,
    stiff: bool,
}

impl Bristle {
    /// Bristles of a valve whose largest friction is `largest_n`; stiff ones are damped at half
    /// the critical value of `mass_kg` while they stick.
    pub fn new(kind: Bristles, largest_n: f64, mass_kg: f64, stribeck_m_per_s: f64) -> Self {
        let (stiffness, damping) = match kind {
            Bristles::Compliant => (COMPLIANT_N_PER_M, COMPLIANT_NS_PER_M),
            // Damped as the compliant ones are, against the critical value.
            Bristles::Of(stiffness) => (stiffness, DAMPING_SHARE * (stiffness * mass_kg).sqrt()),
            Bristles::Stiff => {
                let stiffness = largest_n.max(20.0) / STIFF_DEFLECTION_M;
                (stiffness, (stiffness * mass_kg).sqrt())
            }
        };
        Self {
            stiffness_n_per_m: stiffness,
            damping_ns_per_m: damping,
            stribeck_m_per_s,
            stiff: kind == Bristles::Stiff,
        }
    }

    /// Deflection at which the surfaces slide steadily with the speed `v`.
    fn sliding_deflection(&self, grip: Grip, v: f64) -> f64 {
        let s = v / self.stribeck_m_per_s;
        let level = grip.sliding_n + (grip.holding_n - grip.sliding_n) * (-s * s).exp();
        level.max(LEAST_N) / self.stiffness_n_per_m
    }

    /// How far the bristles have gone from sticking (0) to sliding (1).
    fn yielding(&self, z: f64, v: f64, sliding: f64) -> f64 {
        if !self.stiff {
            return 1.0;
        }
        if z * v <= 0.0 {
            return 0.0;
        }
        let elastic = ELASTIC_SHARE * sliding;
        let over = ((z.abs() - elastic) / (sliding - elastic)).clamp(0.0, 1.0);
        0.5 - 0.5 * (std::f64::consts::PI * over).cos()
    }

    /// Rate of change of the deflection `z`.
    pub fn rate(&self, grip: Grip, z: f64, v: f64) -> f64 {
        let sliding = self.sliding_deflection(grip, v);
        v - self.yielding(z, v, sliding) * v.abs() * z / sliding
    }

    /// The friction force on the piston, opposing its motion.
    pub fn force(&self, grip: Grip, z: f64, v: f64) -> f64 {
        let sliding = self.sliding_deflection(grip, v);
        let yielding = self.yielding(z, v, sliding);
        let mut damping = self.damping_ns_per_m * (v - yielding * v.abs() * z / sliding);
        if self.stiff {
            // Here damping only calms the ringing and must never hold more than the surfaces do.
            damping = damping.clamp(-grip.sliding_n, grip.sliding_n);
        }
        -self.stiffness_n_per_m * z - damping
    }

    /// The deflection after the time `h` at the speed `v`, exact for a constant speed and yield.
    pub fn relax(&self, grip: Grip, z: f64, v: f64, h: f64) -> f64 {
        let sliding = self.sliding_deflection(grip, v);
        let rate = self.yielding(z, v, sliding) * v.abs() / sliding;
        let next = if rate * h < 1e-9 {
            z + v * h
        } else {
            let fade = (-rate * h).exp();
            z * fade + v * (1.0 - fade) / rate
        };
        if !self.stiff {
            return next;
        }
        let most = grip.holding_n.max(LEAST_N) / self.stiffness_n_per_m;
        next.clamp(-most, most)
    }
}
