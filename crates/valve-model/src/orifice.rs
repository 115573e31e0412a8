//! Flow through an orifice, choked and not choked, both ways.
//!
//! Ideal nozzle (Kulkarni et al. 2014, eq. 8; Saint-Venant and Wantzel 1839): with r = p2/p1,
//! w = r^(1/gamma) and r_c = (2/(gamma + 1))^(gamma/(gamma - 1)),
//!
//! ```text
//! f = C A p1 sqrt(2/(Z R T) gamma/(gamma - 1) w (w - r)),   r >= r_c; at r_c below it
//! ```
//!
//! The product w (w - r) vanishes linearly at r = 1, so that w (w - r) = (1 - r) q(r) with a smooth
//! and positive q: a polynomial for sqrt(q), built once per gas, takes the place of the power, and the
//! root of 1 - r is taken beside it. The law of ISO 6358-1:2013, with a critical ratio b of its own, has
//! the same form with a q of first degree, so that one code serves both.
//!
//! The discharge coefficient of a sharp edge is not constant: it falls as the pressures meet, also where the flow is
//! choked (Perry 1949, "Critical flow through sharp-edged orifices", Trans. ASME 71, as a polynomial in r). The law may
//! have a share of that.
//!
//! The slope of the square root is infinite at equal pressures. Within a relative pressure
//! difference `laminar` it gives way to an odd cubic that agrees with it in value and slope at the edge.

use crate::real::Real;

/// Degree of the polynomial for sqrt(q).
pub const DEGREE: usize = 15;

/// The law of all orifices of a valve for one gas: `shape(r)` times a coefficient times the
/// upstream pressure is the mass flow.
#[derive(Debug, Clone, Copy)]
pub struct OrificeLaw<R> {
    /// Coefficients of sqrt(q) in t = 1 - scale (1 - r), ascending.
    pub root: [R; DEGREE + 1],
    /// Two over the widest gap.
    pub scale: R,
    /// The relative pressure difference 1 - r from which on the flow is choked.
    pub widest: R,
    /// The discharge coefficient over that into a vacuum, in powers of 1 - r, ascending.
    pub discharge: [R; DISCHARGE_DEGREE + 1],
}

/// Degree of the discharge coefficient.
pub const DISCHARGE_DEGREE: usize = 5;

/// Discharge coefficient of a sharp-edged orifice in powers of the pressure ratio r, ascending (Perry 1949).
const SHARP_EDGE: [f64; DISCHARGE_DEGREE + 1] = [0.8414, -0.1002, 0.8415, -3.9, 4.6001, -1.6827];

/// The laminar regularisation of an orifice's law: the relative pressure difference within which it gives way to a cubic with a
/// finite slope, as a laminar flow has.
#[derive(Debug, Clone, Copy)]
pub struct Laminar<R> {
    /// The difference.
    pub width: R,
    /// Its inverse.
    pub inverse: R,
}

impl Laminar<f64> {
    /// One of this width.
    pub fn new(width: f64) -> Self {
        Self { width, inverse: 1.0 / width }
    }
}

impl<R: Real> Laminar<R> {
    /// The same in every lane.
    pub fn splat(from: Laminar<f64>) -> Self {
        Self { width: R::splat(from.width), inverse: R::splat(from.inverse) }
    }

    /// Puts one into a lane.
    pub fn set_lane(&mut self, lane: usize, from: Laminar<f64>) {
        self.width.set_lane(lane, from.width);
        self.inverse.set_lane(lane, from.inverse);
    }
}

/// Where the flow is eased and not regularised, the law is regularised this much all the same, so that it has a slope at equal
/// pressures: over less than a pascal.
pub(crate) const EASED_LAMINAR: f64 = 1e-7;

/// Choked flow of a diatomic gas through an area, in units of its pressure over the root of Z R T: sqrt(gamma) times
/// (2 / (gamma + 1)) to the power (gamma + 1) / (2 gamma - 2), for gamma = 1.4.
pub const CHOKED_FLOW: f64 = 0.685;

/// Slope of the laminar part at equal pressures, in units of that of the chord.
pub const LAMINAR_SLOPE: f64 = 1.25;

impl OrificeLaw<f64> {
    /// The ideal nozzle for a ratio of specific heats, with the flow coefficient's factor
    /// 2 gamma/(gamma - 1) included in q.
    pub fn ideal_nozzle(gamma: f64) -> Self {
        let critical = libm::pow(2.0 / (gamma + 1.0), gamma / (gamma - 1.0));
        let factor = 2.0 * gamma / (gamma - 1.0);
        let q = |r: f64| {
            let ln_r = libm::log(r);
            let w = libm::exp(ln_r / gamma);
            let gap = r * libm::expm1((1.0 / gamma - 1.0) * ln_r);
            let limit = (gamma - 1.0) / gamma;
            let quotient = if r == 1.0 { limit } else { gap / -libm::expm1(ln_r) };
            factor * w * quotient
        };
        Self::from_function(critical, q)
    }

    /// ISO 6358 with critical ratio b and the choked flow of the ideal nozzle.
    pub fn iso_6358(gamma: f64, critical_ratio: f64) -> Self {
        let nozzle = Self::ideal_nozzle(gamma);
        let sonic = nozzle.shape(0.0, Laminar::new(1e-9));
        let width = 1.0 - critical_ratio;
        Self::from_function(critical_ratio, |r| sonic * sonic * (1.0 + r - 2.0 * critical_ratio) / (width * width))
    }

    /// With a share of the fall that the discharge coefficient of a sharp edge has; the flow into a vacuum is kept.
    #[must_use]
    pub fn with_edge(self, sharpness: f64) -> Self {
        let mut discharge = [0.0; DISCHARGE_DEGREE + 1];
        // Horner's scheme in r = 1 - gap.
        for power in SHARP_EDGE.iter().rev() {
            let before = discharge;
            for (k, value) in discharge.iter_mut().enumerate() {
                *value = before[k] - if k == 0 { 0.0 } else { before[k - 1] };
            }
            discharge[0] += power;
        }
        for value in &mut discharge {
            *value *= sharpness / SHARP_EDGE[0];
        }
        discharge[0] += 1.0 - sharpness;
        Self { discharge, ..self }
    }

    /// Interpolates sqrt(q) at Chebyshev nodes on [critical, 1] (Trefethen, Approximation Theory and
    /// Approximation Practice, 2013, chapter 3), as a polynomial in powers.
    fn from_function(critical: f64, q: impl Fn(f64) -> f64) -> Self {
        const NODES: usize = DEGREE + 1;
        let centre = 0.5 * (1.0 + critical);
        let half = 0.5 * (1.0 - critical);
        let angle = |node: usize| core::f64::consts::PI * (node as f64 + 0.5) / NODES as f64;
        let samples: [f64; NODES] = core::array::from_fn(|node| q(centre + half * libm::cos(angle(node))).sqrt());
        let mut powers = [0.0; NODES];
        // Chebyshev polynomials T_k by their recurrence, as coefficients of powers of t.
        let mut previous = [0.0; NODES];
        let mut current = [0.0; NODES];
        current[0] = 1.0;
        for k in 0..NODES {
            let norm = if k == 0 { 1.0 } else { 2.0 } / NODES as f64;
            let weight: f64 =
                (0..NODES).map(|node| samples[node] * libm::cos(k as f64 * angle(node))).sum::<f64>() * norm;
            for (sum, coefficient) in powers.iter_mut().zip(current) {
                *sum += weight * coefficient;
            }
            let step = if k == 0 { 1.0 } else { 2.0 };
            let next = core::array::from_fn(|power| {
                let shifted = if power == 0 { 0.0 } else { current[power - 1] };
                step * shifted - if k == 0 { 0.0 } else { previous[power] }
            });
            previous = current;
            current = next;
        }
        let mut discharge = [0.0; DISCHARGE_DEGREE + 1];
        discharge[0] = 1.0;
        Self { root: powers, scale: 1.0 / half, widest: 2.0 * half, discharge }
    }
}

impl OrificeLaw<f64> {
    /// q at equal pressures.
    pub fn at_equal_pressures(&self) -> f64 {
        let root = polynomial(&self.root, 1.0) * self.discharge[0];
        root * root
    }
}

impl<R: Real> OrificeLaw<R> {
    /// sqrt((1 - r) q(r)) for a pressure ratio r <= 1, choked below the critical ratio.
    #[inline(always)]
    pub fn shape(&self, ratio: R, laminar: Laminar<R>) -> R {
        let gap = R::splat(1.0) - ratio;
        self.shape_at(gap, laminar).0 * self.discharge_at(gap)
    }

    /// The discharge coefficient over that into a vacuum.
    #[inline(always)]
    fn discharge_at(&self, gap: R) -> R {
        self.discharge.iter().rev().copied().reduce(|sum, power| sum.mul_add(gap, power)).unwrap_or(gap)
    }

    /// The same over the gap 1 - r, which is exact where the pressures are nearly equal, at a constant discharge
    /// coefficient; and the root of the gap, of the laminar width at least.
    #[inline(always)]
    fn shape_at(&self, gap: R, laminar: Laminar<R>) -> (R, R) {
        let one = R::splat(1.0);
        let gap = gap.min(self.widest);
        let smooth = polynomial(&self.root, one - gap * self.scale);
        let s = (gap * laminar.inverse).min(one);
        let odd = s * (s * s).mul_add(R::splat(-0.25), R::splat(LAMINAR_SLOPE));
        let root = gap.max(laminar.width).sqrt();
        (root * smooth * odd, root)
    }

    /// Mass flow from `p1` to `p2`, kg/s, for a coefficient C A / sqrt(Z R T); negative where it runs back.
    #[inline(always)]
    pub fn flow(&self, p1: R, p2: R, coefficient: R, laminar: Laminar<R>) -> R {
        self.flow_between(Pressure::of(p1), Pressure::of(p2), coefficient, laminar)
    }

    /// The same between pressures whose inverses are known: quotients are what a step spends its time on.
    #[inline(always)]
    pub fn flow_between(&self, from: Pressure<R>, to: Pressure<R>, coefficient: R, laminar: Laminar<R>) -> R {
        self.flow_with_root(from, to, coefficient, laminar, true).0
    }

    /// The same, and the root of the relative pressure difference, of the laminar width at least. The discharge coefficient
    /// is looked at where it may vary.
    #[inline(always)]
    pub fn flow_with_root(
        &self,
        from: Pressure<R>,
        to: Pressure<R>,
        coefficient: R,
        laminar: Laminar<R>,
        discharge_varies: bool,
    ) -> (R, R) {
        let (p1, p2) = (from.pa, to.pa);
        let gap = (p1 - p2).abs() * p1.select_lt(p2, to.inverse, from.inverse);
        let (mut shape, root) = self.shape_at(gap, laminar);
        if discharge_varies {
            shape = shape * self.discharge_at(gap);
        }
        let magnitude = coefficient * p1.max(p2) * shape;
        (p1.select_lt(p2, -magnitude, magnitude), root)
    }
}

/// A pressure and its inverse.
#[derive(Debug, Clone, Copy)]
pub struct Pressure<R> {
    /// The pressure, Pa.
    pub pa: R,
    /// Its inverse, 1/Pa.
    pub inverse: R,
}

impl<R: Real> Pressure<R> {
    /// A pressure with its inverse.
    #[inline(always)]
    pub fn of(pa: R) -> Self {
        Self { pa, inverse: R::splat(1.0) / pa }
    }

    /// Puts a pressure into a lane.
    pub fn set_lane(&mut self, lane: usize, from: Pressure<f64>) {
        self.pa.set_lane(lane, from.pa);
        self.inverse.set_lane(lane, from.inverse);
    }
}

/// A polynomial by pairs (Estrin), which shortens the chain of dependent operations.
#[inline(always)]
fn polynomial<R: Real>(c: &[R; DEGREE + 1], t: R) -> R {
    let t2 = t * t;
    let t4 = t2 * t2;
    let low = quad(c, 4, t, t2).mul_add(t4, quad(c, 0, t, t2));
    let high = quad(c, 12, t, t2).mul_add(t4, quad(c, 8, t, t2));
    high.mul_add(t4 * t4, low)
}

/// Four of its terms. Not a closure, which the compiler may leave out of line and so without the wider registers.
#[inline(always)]
fn quad<R: Real>(c: &[R; DEGREE + 1], at: usize, t: R, t2: R) -> R {
    c[at + 3].mul_add(t, c[at + 2]).mul_add(t2, c[at + 1].mul_add(t, c[at]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exact(gamma: f64, r: f64) -> f64 {
        let critical = libm::pow(2.0 / (gamma + 1.0), gamma / (gamma - 1.0));
        let r = r.max(critical);
        let w = libm::pow(r, 1.0 / gamma);
        libm::sqrt(2.0 * gamma / (gamma - 1.0) * w * (w - r))
    }

    #[test]
    fn the_polynomial_is_the_nozzle_law() {
        for gamma in [1.1, 1.289, 1.4, 1.667] {
            let law = OrificeLaw::ideal_nozzle(gamma);
            let worst = (0..=999)
                .map(|i| f64::from(i) / 1000.0)
                .map(|r| (law.shape(r, Laminar::new(1e-9)) / exact(gamma, r) - 1.0).abs())
                .fold(0.0, f64::max);
            assert!(worst < 1e-12, "gamma {gamma}: {worst:e}");
        }
    }

    #[test]
    fn choked_flow_is_the_textbook_value() {
        let gamma: f64 = 1.4;
        let law = OrificeLaw::ideal_nozzle(gamma);
        let sonic = (gamma * libm::pow(2.0 / (gamma + 1.0), (gamma + 1.0) / (gamma - 1.0))).sqrt();
        assert!((law.flow(6e5, 1e5, 1e-9, Laminar::new(1e-3)) - 1e-9 * 6e5 * sonic).abs() < 1e-18);
        assert_eq!(law.flow(6e5, 1e5, 1e-9, Laminar::new(1e-3)), law.flow(6e5, 2e5, 1e-9, Laminar::new(1e-3)));
    }

    #[test]
    fn flow_is_odd_and_smooth_at_equal_pressures() {
        let law = OrificeLaw::ideal_nozzle(1.4);
        assert_eq!(law.flow(3e5, 3e5, 1e-9, Laminar::new(1e-3)), 0.0);
        assert_eq!(law.flow(3e5, 2e5, 1e-9, Laminar::new(1e-3)), -law.flow(2e5, 3e5, 1e-9, Laminar::new(1e-3)));
        for gap in [0.999e-3, 1.001e-3] {
            let slope = |at: f64| {
                (law.shape(1.0 - at - 1e-9, Laminar::new(1e-3)) - law.shape(1.0 - at + 1e-9, Laminar::new(1e-3))) / 2e-9
            };
            let reference = exact(1.4, 1.0 - gap - 1e-9) - exact(1.4, 1.0 - gap + 1e-9);
            assert!((slope(gap) / (reference / 2e-9) - 1.0).abs() < 5e-3);
        }
    }

    #[test]
    fn a_sharp_edge_lets_less_through_as_the_pressures_meet() {
        let nozzle = OrificeLaw::ideal_nozzle(1.4);
        let laminar = Laminar::new(1e-9);
        for sharpness in [0.0, 0.4, 1.0] {
            let law = nozzle.with_edge(sharpness);
            let against_nozzle = |ratio: f64| law.shape(ratio, laminar) / nozzle.shape(ratio, laminar);
            assert!((against_nozzle(0.0) - 1.0).abs() < 1e-12);
            // 0.6001 for 0.8414.
            let end = 1.0 + sharpness * (0.6001 / 0.8414 - 1.0);
            assert!((against_nozzle(1.0 - 1e-6) - end).abs() < 1e-5, "{sharpness}");
            // Also where it chokes: 0.7491 at half the pressure.
            let half = 1.0 + sharpness * (0.749_097 / 0.8414 - 1.0);
            assert!((against_nozzle(0.5) - half).abs() < 1e-5, "{}", against_nozzle(0.5));
        }
    }

    #[test]
    fn iso_6358_keeps_the_sonic_flow_and_falls_as_an_ellipse() {
        let nozzle = OrificeLaw::ideal_nozzle(1.4);
        let law = OrificeLaw::iso_6358(1.4, 0.3);
        assert!((law.shape(0.2, Laminar::new(1e-3)) / nozzle.shape(0.2, Laminar::new(1e-3)) - 1.0).abs() < 1e-13);
        let ellipse = (1.0_f64 - (0.4_f64 / 0.7).powi(2)).sqrt();
        assert!((law.shape(0.7, Laminar::new(1e-3)) / nozzle.shape(0.2, Laminar::new(1e-3)) - ellipse).abs() < 1e-13);
    }
}
