//! The few special functions that the posterior needs.

/// Probability that a standard normal variable exceeds `z`: Abramowitz and
/// Stegun 7.1.26. Absolute error below 1.5e-7.
#[inline]
pub(crate) fn normal_tail(z: f64) -> f64 {
    let x = z.abs() / std::f64::consts::SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let poly =
        t * (0.254_829_592 + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    let upper = 0.5 * poly * quick_exp(-x * x);
    if z >= 0.0 { upper } else { 1.0 - upper }
}

/// Logarithm of the probability that a normal variable of unit variance and mean
/// `z`, not above zero, exceeds zero, and its mean beyond `z` if it does.
pub(crate) fn above_zero(z: f64) -> (f64, f64) {
    let density = 0.398_942_280_401_432_7 * quick_exp(-0.5 * z * z);
    if z > -4.0 {
        let share = normal_tail(-z);
        return (quick_ln(share), density / share);
    }
    // The continued fraction of the tail.
    let mills = -z + 1.0 / (-z + 2.0 / (-z + 3.0 / -z));
    (-0.5 * z * z - 0.918_938_533_204_672_7 - quick_ln(mills), mills)
}

/// Natural logarithm of a positive, normal number by the series of the inverse
/// hyperbolic tangent. Relative error of the argument below 1e-9: enough for
/// probabilities, at a fraction of the cost of the exact function.
#[inline]
pub(crate) fn quick_ln(x: f64) -> f64 {
    // Shifts the exponent so that the mantissa lies in sqrt(1/2)..sqrt(2).
    // Unsigned operations only, which every processor has for whole vectors.
    let bits = x.to_bits();
    let shifted = bits.wrapping_sub(0x3FE6_A09E_667F_3BCD).wrapping_add(1023 << 52);
    let biased = shifted >> 52;
    let mantissa = f64::from_bits(bits.wrapping_sub(biased << 52).wrapping_add(1023 << 52));
    let exponent = f64::from_bits(biased | 0x4330_0000_0000_0000) - (4_503_599_627_370_496.0 + 1023.0);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let q = s * s;
    let series = 2.0 * s * (1.0 + q * (1.0 / 3.0 + q * (1.0 / 5.0 + q * (1.0 / 7.0 + q * (1.0 / 9.0)))));
    series + exponent * std::f64::consts::LN_2
}

/// Adding and taking off this number rounds to an integer, which then stands
/// in the lowest bits.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// Exponential of a number below 700, next to zero below -700. Relative error
/// below 1e-9.
#[inline]
pub(crate) fn quick_exp(x: f64) -> f64 {
    let x = x.max(-700.0);
    let shifted = x * std::f64::consts::LOG2_E + ROUNDER;
    let r = x - (shifted - ROUNDER) * std::f64::consts::LN_2;
    let series = 1.0
        + r * (1.0
            + r * (0.5
                + r * (1.0 / 6.0
                    + r * (1.0 / 24.0
                        + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r * (1.0 / 5040.0 + r * (1.0 / 40320.0))))))));
    series * f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quick_functions_are_close_to_the_exact_ones() {
        for i in 1..20_000 {
            let x = f64::from(i) * 0.037;
            assert!((quick_ln(x) - x.ln()).abs() < 2e-9, "ln {x}: {}", quick_ln(x));
            let y = -f64::from(i) * 0.034;
            assert!((quick_exp(y) / y.exp() - 1.0).abs() < 2e-9, "exp {y}: {}", quick_exp(y));
        }
        assert!(quick_exp(-1e9) < 1e-300);
        assert!((quick_ln(1e-300) - 1e-300_f64.ln()).abs() < 1e-6);
    }

    #[test]
    fn normal_tail_meets_tables() {
        for (z, expected) in [(0.0, 0.5), (1.0, 0.158_655), (-1.644_854, 0.95), (3.0, 0.001_350)] {
            assert!((normal_tail(z) - expected).abs() < 1e-6, "{z}");
        }
    }
}
