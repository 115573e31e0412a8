//! The bristles that a dry friction acts through (Canudas de Wit, Olsson, Åström and Lischinsky, IEEE Trans.
//! Automatic Control 40(3), 1995).

use crate::real::Real;

/// Stiffness of friction bristles unless said otherwise, N/m: elastomer seals give by a tenth of a millimetre
/// before they slide (some 100 N over 0.5 mm), which shows in a recorded stroke.
pub(crate) const STIFFNESS_N_PER_M: f64 = 2e5;

/// Damping of bristles of that stiffness.
const DAMPING_N_S_PER_M: f64 = 250.0;

/// Friction below which there is none, N.
const LEAST_FRICTION_N: f64 = 1e-6;

/// The damping of bristles, N s/m: it grows as the root of their stiffness, so that the piston rings on stiff ones
/// no longer than on soft ones.
pub(crate) fn damping_n_s_per_m(stiffness_n_per_m: f64) -> f64 {
    DAMPING_N_S_PER_M * libm::sqrt(stiffness_n_per_m / STIFFNESS_N_PER_M)
}

/// The friction, N, and the rate of the bristles' deflection z, m/s: z' = v - s0 |v| z/g, F = s0 z + s1 z', with g
/// the friction of steady sliding. At rest the bristles hold up to g at no speed. The rate at which a sliding bristle
/// settles is bounded by 1 over `quickest`, far above anything that a stroke shows.
#[inline(always)]
pub(crate) fn friction<R: Real>(stiffness: R, damping: R, quickest: R, v: R, deflection: R, sliding: R) -> (R, R) {
    let grip = stiffness * v.abs();
    let settling = grip * quickest;
    let rate = v.mul_add(sliding, -(grip * deflection)) / sliding.max(settling).max(R::splat(LEAST_FRICTION_N));
    (stiffness.mul_add(deflection, damping * rate), rate)
}
