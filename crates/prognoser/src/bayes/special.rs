//! The few special functions that the posterior needs.

/// Standard normal quantile of 0.95.
const Z95: f64 = 1.644_853_626_951_472_7;

/// Logarithm of the gamma function for x > 0: Stirling's series after shifting
/// the argument above 7 (Abramowitz and Stegun 6.1.41). Error below 1e-8.
pub(crate) fn ln_gamma(x: f64) -> f64 {
    let mut shifted = x;
    let mut product = 1.0;
    while shifted < 7.0 {
        product *= shifted;
        shifted += 1.0;
    }
    let inverse = 1.0 / shifted;
    let square = inverse * inverse;
    let series = inverse * (1.0 / 12.0 - square * (1.0 / 360.0 - square * (1.0 / 1260.0 - square / 1680.0)));
    let shift = if product == 1.0 { 0.0 } else { quick_ln(product) };
    (shifted - 0.5) * quick_ln(shifted) - shifted + 0.918_938_533_204_672_7 + series - shift
}

/// The 0.95 quantile of Student's t distribution: the expansion in 1/dof of
/// Abramowitz and Stegun 26.7.5. Error below 1 % from 3 degrees of freedom on.
pub(crate) fn t_quantile_95(dof: f64) -> f64 {
    let z = Z95;
    let (z3, z5) = (z.powi(3), z.powi(5));
    let (z7, z9) = (z.powi(7), z.powi(9));
    let g1 = (z3 + z) / 4.0;
    let g2 = (5.0 * z5 + 16.0 * z3 + 3.0 * z) / 96.0;
    let g3 = (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / 384.0;
    let g4 = (79.0 * z9 + 776.0 * z7 + 1482.0 * z5 - 1920.0 * z3 - 945.0 * z) / 92160.0;
    let u = 1.0 / dof.max(2.0);
    z + u * (g1 + u * (g2 + u * (g3 + u * g4)))
}

/// Probability that a standard normal variable exceeds `z`: Abramowitz and
/// Stegun 7.1.26. Absolute error below 1.5e-7.
pub(crate) fn normal_tail(z: f64) -> f64 {
    let x = z.abs() / std::f64::consts::SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let poly =
        t * (0.254_829_592 + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    let upper = 0.5 * poly * (-x * x).exp();
    if z >= 0.0 { upper } else { 1.0 - upper }
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
    fn ln_gamma_meets_known_values() {
        for (x, expected) in
            [(0.5, std::f64::consts::PI.sqrt().ln()), (1.0, 0.0), (5.0, 24.0_f64.ln()), (10.5, 13.940_625_219_403_763)]
        {
            assert!((ln_gamma(x) - expected).abs() < 1e-8, "{x}: {}", ln_gamma(x));
        }
    }

    #[test]
    fn t_quantile_meets_tables() {
        for (dof, expected) in [(3.0, 2.3534), (5.0, 2.0150), (10.0, 1.8125), (30.0, 1.6973)] {
            assert!((t_quantile_95(dof) - expected).abs() < 0.01 * expected, "{dof}");
        }
    }

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
