//! Dry friction as a carpet of bristles: an elasto-plastic element in series with the sliding.
//!
//! The element deflects elastically until its force nears what the surfaces can hold, then yields
//! and slides at that deflection (P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, "Single state
//! elastoplastic friction models", IEEE Trans. Automatic Control 47(5), 2002). Below yield it is a
//! plain spring and does not creep. The deflection at yield is about a micrometre, so that the
//! piston as good as stands still while it sticks.

/// Deflection at which the largest friction of a valve is reached.
const YIELD_DEFLECTION_M: f64 = 1e-6;
/// Fraction of the holding deflection below which the element is purely elastic.
const ELASTIC_SHARE: f64 = 0.9;

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
}

impl Bristle {
    /// Bristles whose deflection at `largest_n` is a micrometre, damped at half the critical value
    /// of `mass_kg` while they stick.
    pub fn new(largest_n: f64, mass_kg: f64, stribeck_m_per_s: f64) -> Self {
        let stiffness = largest_n.max(20.0) / YIELD_DEFLECTION_M;
        Self {
            stiffness_n_per_m: stiffness,
            damping_ns_per_m: (stiffness * mass_kg).sqrt(),
            stribeck_m_per_s,
        }
    }

    /// Deflection at which the surfaces slide steadily with the speed `v`.
    fn sliding_deflection(&self, grip: Grip, v: f64) -> f64 {
        let s = v / self.stribeck_m_per_s;
        let level = grip.sliding_n + (grip.holding_n - grip.sliding_n) * (-s * s).exp();
        (level / self.stiffness_n_per_m).max(1e-15)
    }

    /// How far the element has gone from sticking (0) to sliding (1).
    fn yielding(z: f64, v: f64, sliding: f64) -> f64 {
        if z * v <= 0.0 {
            return 0.0;
        }
        let elastic = ELASTIC_SHARE * sliding;
        let over = (z.abs() - elastic) / (sliding - elastic);
        if over <= 0.0 {
            0.0
        } else if over >= 1.0 {
            1.0
        } else {
            0.5 - 0.5 * (std::f64::consts::PI * over).cos()
        }
    }

    /// The friction force on the piston, opposing its motion.
    pub fn force(&self, grip: Grip, z: f64, v: f64) -> f64 {
        let sliding = self.sliding_deflection(grip, v);
        let stuck = 1.0 - Self::yielding(z, v, sliding);
        let mut damping = self.damping_ns_per_m * v * stuck;
        // Damping is a help for the numbers and must never hold more than the surfaces do.
        let limit = grip.sliding_n;
        damping = damping.clamp(-limit, limit);
        -self.stiffness_n_per_m * z - damping
    }

    /// The deflection after the time `h` at the speed `v`, exact for a constant speed and yield.
    pub fn relax(&self, grip: Grip, z: f64, v: f64, h: f64) -> f64 {
        let sliding = self.sliding_deflection(grip, v);
        let rate = Self::yielding(z, v, sliding) * v.abs() / sliding;
        let next = if rate * h < 1e-9 {
            z + v * h
        } else {
            let fade = (-rate * h).exp();
            z * fade + v * (1.0 - fade) / rate
        };
        let most = (grip.holding_n / self.stiffness_n_per_m).max(1e-15);
        next.clamp(-most, most)
    }
}
