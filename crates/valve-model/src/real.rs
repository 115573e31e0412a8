//! The numbers the model computes with: one `f64`, or several side by side.
//!
//! Every law is written once, generic over [`Real`], and says itself where a product and a sum may
//! be one operation ([`Real::mul_add`]). Whether that is fused, and so rounded once, is part of the
//! type: fused lanes give the same bits on every machine that has such an instruction, the others
//! the bits of a plain `f64` on every machine. All else is exactly rounded and nothing is contracted.

use core::ops::{Add, Div, Mul, Neg, Sub};

/// How many runs advance together.
pub const LANES: usize = 8;

/// A number, or a pack of numbers that advance together.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// How many numbers it holds.
    const LANES: usize;

    /// The same number in every lane.
    fn splat(value: f64) -> Self;
    /// The number in one lane.
    fn lane(&self, index: usize) -> f64;
    /// Replaces the number in one lane.
    fn set_lane(&mut self, index: usize, value: f64);
    /// Writes the numbers to the front of `to`.
    fn store(self, to: &mut [f64]);
    /// `self * factor + term`, rounded once where the type is fused.
    #[must_use]
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// Square root.
    #[must_use]
    fn sqrt(self) -> Self;
    /// The larger of two (the second where they compare equal).
    #[must_use]
    fn max(self, other: Self) -> Self;
    /// The smaller of two (the second where they compare equal).
    #[must_use]
    fn min(self, other: Self) -> Self;
    /// `then` where `self < bound`, otherwise `otherwise`.
    #[must_use]
    fn select_lt(self, bound: Self, then: Self, otherwise: Self) -> Self;
    /// Whether it is below a bound in any lane.
    fn any_lt(self, bound: Self) -> bool;
    /// Applies a scalar function lane by lane; for laws that are rarely used.
    #[must_use]
    fn map(self, function: impl Fn(f64) -> f64) -> Self;
    /// Applies a scalar function of two arguments lane by lane.
    #[must_use]
    fn zip(self, other: Self, function: impl Fn(f64, f64) -> f64) -> Self;

    /// Absolute value.
    #[inline(always)]
    #[must_use]
    fn abs(self) -> Self {
        self.max(-self)
    }

    /// Natural logarithm of a positive normal number; relative error below 1e-14.
    #[must_use]
    fn ln(self) -> Self;

    /// `self` to a power, for 0 < self < 1.2; 0 where the result is below exp(-40).
    #[inline(always)]
    #[must_use]
    fn power(self, exponent: Self) -> Self {
        (-(exponent * self.ln())).exp_of_negative()
    }

    /// A number between 1/2 and 2 times 2^n, where `shifted` is n + [`SHIFT`].
    #[must_use]
    fn times_power_of_two(self, shifted: Self) -> Self;

    /// exp(x), relative error below 1e-14; 0 where it is below 1e-307.
    #[inline(always)]
    #[must_use]
    fn exp(self) -> Self {
        const LEAST: f64 = -707.0;
        const MOST: f64 = 709.0;
        // Least and most come first, so that what is not a number stays so.
        let inside = Self::splat(LEAST).max(Self::splat(MOST).min(self)).moderate_exp();
        let above = Self::splat(MOST).select_lt(self, Self::splat(f64::INFINITY), inside);
        self.select_lt(Self::splat(LEAST), Self::splat(0.0), above)
    }

    /// exp(-z) for z >= 0, relative error below 1e-14 for z < 40, 0 beyond (exp(-40) is 4e-18).
    #[inline(always)]
    #[must_use]
    fn exp_of_negative(self) -> Self {
        let limit = Self::splat(40.0);
        self.select_lt(limit, (-self.min(limit)).moderate_exp(), Self::splat(0.0))
    }

    /// exp(x) where neither it nor its inverse overflows: 2^n exp(r) with |r| <= ln(2)/2, and the series of exp(r).
    #[inline(always)]
    #[must_use]
    fn moderate_exp(self) -> Self {
        // ln 2 in two parts, the first so short that n times it is exact (Cody and Waite 1980).
        const LN_2_HIGH: f64 = f64::from_bits(0x3fe6_2e42_fee0_0000);
        const LN_2_LOW: f64 = core::f64::consts::LN_2 - LN_2_HIGH + LN_2_MISSING;
        // What ln 2 has beyond a double.
        const LN_2_MISSING: f64 = 2.319_046_813_846_3e-17;
        let shifted = self.mul_add(Self::splat(core::f64::consts::LOG2_E), Self::splat(SHIFT));
        let n = shifted - Self::splat(SHIFT);
        let r = n.mul_add(Self::splat(-LN_2_LOW), n.mul_add(Self::splat(-LN_2_HIGH), self));
        let r2 = r * r;
        let r4 = r2 * r2;
        // By pairs (Estrin), which shortens the chain of dependent operations.
        let high = series_quad(8, r, r2).mul_add(r4, series_quad(4, r, r2));
        high.mul_add(r4, series_quad(0, r, r2)).times_power_of_two(shifted)
    }
}

/// Added to a number, it leaves the nearest whole number in the lowest bits of the sum.
pub const SHIFT: f64 = 6_755_399_441_055_744.0;

/// Four terms of the series of exp(r), those from r^first on, over r^first.
#[inline(always)]
fn series_quad<R: Real>(first: usize, r: R, r2: R) -> R {
    let [a, b, c, d] = [0, 1, 2, 3].map(|power| R::splat(INVERSE_FACTORIALS[first + power]));
    d.mul_add(r, c).mul_add(r2, b.mul_add(r, a))
}

/// 1/n! for n = 0 .. 11.
const INVERSE_FACTORIALS: [f64; 12] = [
    1.0,
    1.0,
    0.5,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5_040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
];

/// Two to the whole number in the lowest bits of `shifted`, times `x`.
#[inline(always)]
fn scalar_times_power_of_two(x: f64, shifted: f64) -> f64 {
    f64::from_bits(x.to_bits().wrapping_add(shifted.to_bits() << 52))
}

/// ln x = e ln 2 + ln m with m within a factor sqrt 2 of 1, by the series of artanh (m - 1)/(m + 1).
#[inline(always)]
fn scalar_ln(x: f64) -> f64 {
    const FRACTION: u64 = (1 << 52) - 1;
    #[expect(clippy::cast_possible_wrap, reason = "the sign of the shifted bits is the sign of the exponent")]
    let exponent_bits = |bits: u64| bits as i64 >> 52;
    // Shifts the break between two octaves from 1 to 1/sqrt 2.
    let shifted = x.to_bits().wrapping_sub(0x3fe6_a09e_667f_3bcd);
    let exponent = exponent_bits(shifted) as f64;
    let m = f64::from_bits((shifted & FRACTION).wrapping_add(0x3fe6_a09e_667f_3bcd));
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    let mut sum = 1.0 / 19.0;
    let mut odd = 17.0;
    while odd > 0.0 {
        sum = sum * z + 1.0 / odd;
        odd -= 2.0;
    }
    exponent * core::f64::consts::LN_2 + 2.0 * s * sum
}

impl Real for f64 {
    const LANES: usize = 1;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn lane(&self, _index: usize) -> f64 {
        *self
    }
    #[inline(always)]
    fn set_lane(&mut self, _index: usize, value: f64) {
        *self = value;
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[0] = self;
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn select_lt(self, bound: Self, then: Self, otherwise: Self) -> Self {
        if self < bound { then } else { otherwise }
    }
    #[inline(always)]
    fn any_lt(self, bound: Self) -> bool {
        self < bound
    }
    #[inline(always)]
    fn map(self, function: impl Fn(f64) -> f64) -> Self {
        function(self)
    }
    #[inline(always)]
    fn zip(self, other: Self, function: impl Fn(f64, f64) -> f64) -> Self {
        function(self, other)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        scalar_ln(self)
    }
    #[inline(always)]
    fn times_power_of_two(self, shifted: Self) -> Self {
        scalar_times_power_of_two(self, shifted)
    }
}

/// Several numbers side by side, one register or a few wide. `FUSED` lanes round a product and a sum
/// once; they are for code compiled for machines that can, elsewhere that takes a slow call.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Lanes<const N: usize, const FUSED: bool>(pub [f64; N]);

macro_rules! lanewise {
    ($($trait:ident $method:ident $op:tt;)*) => { $(
        impl<const N: usize, const FUSED: bool> $trait for Lanes<N, FUSED> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for lane in 0..N {
                    self.0[lane] $op other.0[lane];
                }
                self
            }
        }
    )* };
}

lanewise! {
    Add add +=;
    Sub sub -=;
    Mul mul *=;
    Div div /=;
}

impl<const N: usize, const FUSED: bool> Neg for Lanes<N, FUSED> {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        for lane in 0..N {
            self.0[lane] = -self.0[lane];
        }
        self
    }
}

impl<const N: usize, const FUSED: bool> Real for Lanes<N, FUSED> {
    const LANES: usize = N;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value; N])
    }
    #[inline(always)]
    fn lane(&self, index: usize) -> f64 {
        self.0[index]
    }
    #[inline(always)]
    fn set_lane(&mut self, index: usize, value: f64) {
        self.0[index] = value;
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[..N].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn mul_add(mut self, factor: Self, term: Self) -> Self {
        for lane in 0..N {
            self.0[lane] = if FUSED {
                f64::mul_add(self.0[lane], factor.0[lane], term.0[lane])
            } else {
                self.0[lane] * factor.0[lane] + term.0[lane]
            };
        }
        self
    }
    #[inline(always)]
    fn sqrt(mut self) -> Self {
        for lane in 0..N {
            self.0[lane] = f64::sqrt(self.0[lane]);
        }
        self
    }
    #[inline(always)]
    fn max(mut self, other: Self) -> Self {
        for lane in 0..N {
            self.0[lane] = if self.0[lane] > other.0[lane] { self.0[lane] } else { other.0[lane] };
        }
        self
    }
    #[inline(always)]
    fn min(mut self, other: Self) -> Self {
        for lane in 0..N {
            self.0[lane] = if self.0[lane] < other.0[lane] { self.0[lane] } else { other.0[lane] };
        }
        self
    }
    #[inline(always)]
    fn select_lt(self, bound: Self, then: Self, otherwise: Self) -> Self {
        let mut result = otherwise;
        for lane in 0..N {
            result.0[lane] = if self.0[lane] < bound.0[lane] { then.0[lane] } else { otherwise.0[lane] };
        }
        result
    }
    #[inline(always)]
    fn any_lt(self, bound: Self) -> bool {
        let mut any = false;
        for lane in 0..N {
            any |= self.0[lane] < bound.0[lane];
        }
        any
    }
    #[inline(always)]
    fn map(mut self, function: impl Fn(f64) -> f64) -> Self {
        for lane in 0..N {
            self.0[lane] = function(self.0[lane]);
        }
        self
    }
    #[inline(always)]
    fn zip(mut self, other: Self, function: impl Fn(f64, f64) -> f64) -> Self {
        for lane in 0..N {
            self.0[lane] = function(self.0[lane], other.0[lane]);
        }
        self
    }
    #[inline(always)]
    fn ln(mut self) -> Self {
        for lane in 0..N {
            self.0[lane] = scalar_ln(self.0[lane]);
        }
        self
    }
    #[inline(always)]
    fn times_power_of_two(mut self, shifted: Self) -> Self {
        for lane in 0..N {
            self.0[lane] = scalar_times_power_of_two(self.0[lane], shifted.0[lane]);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_functions_agree_with_the_library() {
        for i in 1..2000 {
            let x = f64::from(i) * 6e-4;
            assert!((Real::ln(x) - libm::log(x)).abs() <= 1e-15 + 4e-15 * libm::log(x).abs(), "ln {x}");
            let z = f64::from(i) * 0.0195;
            assert!((z.exp_of_negative() / libm::exp(-z) - 1.0).abs() < 1e-14, "exp -{z}");
            assert!((x.power(1.7) - libm::pow(x, 1.7)).abs() < 1e-13, "{x}^1.7");
        }
        for x in [-800.0, -706.9, -41.0, -39.9, -1.0, -1e-9, 0.0, 1e-9, 1.0, 39.9, 41.0, 700.0, 800.0, f64::INFINITY] {
            let (own, library) = (Real::exp(x), libm::exp(x));
            assert!(own == library || (own / library - 1.0).abs() < 1e-14, "exp {x}: {own} and {library}");
            assert_eq!(
                Real::exp(Lanes::<4, false>([x, 0.5, x, -3.0])).0[2].to_bits(),
                own.to_bits(),
                "exp {x} in a lane"
            );
        }
        assert!(Real::exp(f64::NAN).is_nan());
        assert_eq!(1e-300.power(2.0), 0.0);
        let lanes = Lanes::<4, false>([0.1, 0.5, 0.9, 1.1]).power(Lanes([1.5; 4]));
        assert_eq!(lanes.0, [0.1, 0.5, 0.9, 1.1].map(|x: f64| x.power(1.5)));
    }
}
