//! Special functions of the normal distribution.

use statrs::function::erf::erfc;

/// The logarithm of the standard normal distribution function, accurate far into the lower tail.
pub fn ln_normal_cdf(x: f64) -> f64 {
    if x > -20.0 {
        return (0.5 * erfc(-x / std::f64::consts::SQRT_2)).ln();
    }
    // The asymptotic series (Abramowitz and Stegun 26.2.12); its next term is below 1e-6.
    let square = x * x;
    -0.5 * square - (-x).ln() - 0.918_938_533_204_672_7 + (-1.0 / square + 2.5 / (square * square)).ln_1p()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_joins_the_centre() {
        assert!((ln_normal_cdf(0.0) + std::f64::consts::LN_2).abs() < 1e-12);
        let (above, below) = (ln_normal_cdf(-19.999_999), ln_normal_cdf(-20.000_001));
        assert!((above - below).abs() < 1e-4, "{above} {below}");
        // Reference: R 4.3, pnorm(-30, log.p = TRUE).
        assert!((ln_normal_cdf(-30.0) + 454.321_244).abs() < 1e-4, "{}", ln_normal_cdf(-30.0));
    }
}
