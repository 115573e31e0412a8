//! The few special functions that the posterior needs.

/// Probability that a standard normal variable exceeds `z`: Abramowitz and
/// Stegun 7.1.26. Absolute error below 1.5e-7.
#[inline]
pub(crate) const fn normal_tail(z: f64) -> f64 {
    let x = z.abs() / std::f64::consts::SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let poly =
        t * (0.254_829_592 + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    let upper = 0.5 * poly * quick_exp(-x * x);
    if z >= 0.0 { upper } else { 1.0 - upper }
}

/// Steps of the table of [`normal_share`] a standard deviation, and how far it goes.
const STEPS: u32 = 64;
const FARTHEST: f64 = 6.0;

/// Places of the table: the next power of two, so that a mask keeps a place within it and no place has to be checked.
const PLACES: usize = (12 * STEPS as usize + 1).next_power_of_two();

/// Values of the normal distribution function from -6 to 6, and one more for the last place's neighbour.
static SHARES: [f64; PLACES + 1] = {
    let mut shares = [0.0; PLACES + 1];
    let mut i = 0;
    while i < 12 * STEPS as usize + 2 {
        shares[i] = normal_tail(FARTHEST - i as f64 / STEPS as f64);
        i += 1;
    }
    shares
};

/// Probability that a standard normal variable is below `z`, from a table.
/// Absolute error below 1e-5, a third of the cost of [`normal_tail`].
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "a place in the table, within its mask")]
pub(crate) fn normal_share(z: f64) -> f64 {
    let along = (z.clamp(-FARTHEST, FARTHEST) + FARTHEST) * f64::from(STEPS);
    // The integer below, found by adding a number so large that nothing but integers is left, and no conversion.
    let nearest = (along + ROUNDER) - ROUNDER;
    let floor = if nearest > along { nearest - 1.0 } else { nearest };
    let place = (floor + ROUNDER).to_bits() as usize & (PLACES - 1);
    let (at, below, above) = (along - floor, SHARES[place], SHARES[place + 1]);
    below + at * (above - below)
}

/// The deviation below which a standard normal variable lies with a probability:
/// Acklam's rational approximations. Absolute error below 1e-7 for the deviation
/// of any probability between 1e-9 and 1 - 1e-9, to which it is bounded.
pub(crate) fn normal_deviation(probability: f64) -> f64 {
    let p = probability.clamp(1e-9, 1.0 - 1e-9);
    let tail = p.min(1.0 - p);
    if tail < 0.024_25 {
        let q = (-2.0 * quick_ln(tail)).sqrt();
        let over = ((((-7.784_894_002_430_293e-3 * q - 0.322_396_458_041_136_4) * q - 2.400_758_277_161_838) * q
            - 2.549_732_539_343_734)
            * q
            + 4.374_664_141_464_968)
            * q
            + 2.938_163_982_698_783;
        let under = (((7.784_695_709_041_462e-3 * q + 0.322_467_129_070_039_8) * q + 2.445_134_137_142_996) * q
            + 3.754_408_661_907_416)
            * q
            + 1.0;
        return if p < 0.5 { over / under } else { -over / under };
    }
    let q = p - 0.5;
    let r = q * q;
    let over = (((((-39.696_830_286_653_76 * r + 220.946_098_424_520_5) * r - 275.928_510_446_968_7) * r
        + 138.357_751_867_269)
        * r
        - 30.664_798_066_147_16)
        * r
        + 2.506_628_277_459_239)
        * q;
    let under = ((((-54.476_098_798_224_06 * r + 161.585_836_858_040_9) * r - 155.698_979_859_886_6) * r
        + 66.801_311_887_719_72)
        * r
        - 13.280_681_552_885_72)
        * r
        + 1.0;
    over / under
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
#[inline(always)]
pub(crate) const fn quick_ln(x: f64) -> f64 {
    // Shifts the exponent so that the mantissa lies in sqrt(1/2)..sqrt(2).
    // Unsigned operations only, which every processor has for whole vectors.
    let bits = x.to_bits();
    let shifted = bits.wrapping_sub(0x3FE6_A09E_667F_3BCD).wrapping_add(1023 << 52);
    let biased = shifted >> 52;
    let mantissa = f64::from_bits(bits.wrapping_sub(biased << 52).wrapping_add(1023 << 52));
    let exponent = f64::from_bits(biased | 0x4330_0000_0000_0000) - (4_503_599_627_370_496.0 + 1023.0);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let q = s * s;
    // Pairs of terms side by side, so that none waits for all others.
    let q2 = q * q;
    let series = 2.0 * s * ((1.0 + q * (1.0 / 3.0)) + q2 * ((1.0 / 5.0 + q * (1.0 / 7.0)) + q2 * (1.0 / 9.0)));
    series + exponent * std::f64::consts::LN_2
}

/// Adding and taking off this number rounds to an integer, which then stands
/// in the lowest bits.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// Exponential of a number below 700, next to zero below -700. Relative error
/// below 1e-9.
#[inline(always)]
pub(crate) const fn quick_exp(x: f64) -> f64 {
    let x = x.max(-700.0);
    let shifted = x * std::f64::consts::LOG2_E + ROUNDER;
    let r = x - (shifted - ROUNDER) * std::f64::consts::LN_2;
    let (r2, r4) = (r * r, r * r * r * r);
    let first = (1.0 + r) + r2 * (0.5 + r * (1.0 / 6.0));
    let second = (1.0 / 24.0 + r * (1.0 / 120.0)) + r2 * (1.0 / 720.0 + r * (1.0 / 5040.0));
    let series = first + r4 * (second + r4 * (1.0 / 40320.0));
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
    fn deviations_and_shares_are_each_others_inverse() {
        for i in -590..590 {
            let z = f64::from(i) * 0.01 + 0.003;
            let share = 1.0 - normal_tail(z);
            assert!((normal_share(z) - share).abs() < 1e-5, "{z}: {}", normal_share(z));
            // The tail itself is off by up to 1.5e-7.
            let by = 2e-7 / (0.4 * (-0.5 * z * z).exp());
            assert!((normal_deviation(share) - z).abs() < 1e-6 + by, "{z}: {}", normal_deviation(share));
        }
        assert!((normal_deviation(0.05) + 1.644_853_627).abs() < 1e-6);
        assert!((normal_share(-50.0)).abs() < 1e-8 && (normal_share(50.0) - 1.0).abs() < 1e-8);
    }

    #[test]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place in the table")]
    fn a_place_of_the_table_is_found_by_its_floor() {
        let exactly = |z: f64| {
            let along = (z + FARTHEST) * f64::from(STEPS);
            let place = along.floor() as usize;
            SHARES[place] + (along - along.floor()) * (SHARES[place + 1] - SHARES[place])
        };
        // On the places, a little beside them and between them.
        for i in 1..12 * 64 {
            for beside in [-1e-12, 0.0, 1e-12, 0.003, 0.007_812_5, 0.012] {
                let z = f64::from(i) / 64.0 - 6.0 + beside;
                assert_eq!(normal_share(z).to_bits(), exactly(z).to_bits(), "{z}");
            }
        }
        assert!(normal_share(f64::NAN).is_nan());
    }

    #[test]
    fn normal_tail_meets_tables() {
        for (z, expected) in [(0.0, 0.5), (1.0, 0.158_655), (-1.644_854, 0.95), (3.0, 0.001_350)] {
            assert!((normal_tail(z) - expected).abs() < 1e-6, "{z}");
        }
    }
}
