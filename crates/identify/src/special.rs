//! Special functions of the normal distribution, and of Student's.

use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};
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

/// The value that Student's t of so many degrees of freedom (more than zero) exceeds with a probability of 5 %.
pub fn t_quantile_95(freedom: f64) -> f64 {
    const NORMAL: f64 = 1.644_853_626_951_472_7;
    if freedom.is_infinite() {
        return NORMAL;
    }
    StudentsT::new(0.0, 1.0, freedom).map_or(NORMAL, |student| student.inverse_cdf(0.95))
}

/// The value that a sum of so many squares of standard normal deviates (one at least) exceeds with a probability of 1 %.
pub fn chi_squared_quantile_99(freedom: usize) -> f64 {
    ChiSquared::new(freedom as f64).map_or(f64::INFINITY, |sum| sum.inverse_cdf(0.99))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_squares_have_their_tails() {
        // Tables of chi-squared (Abramowitz and Stegun 26.8).
        for (freedom, exact) in [(1, 6.635), (3, 11.345), (6, 16.812)] {
            let found = chi_squared_quantile_99(freedom);
            assert!((found - exact).abs() < 1e-3, "{freedom}: {found}");
        }
    }

    #[test]
    fn few_degrees_of_freedom_make_wide_intervals() {
        // Tables of Student's t (Abramowitz and Stegun 26.10).
        for (freedom, exact) in [(1.0, 6.314), (3.0, 2.353), (12.0, 1.782), (f64::INFINITY, 1.645)] {
            assert!((t_quantile_95(freedom) - exact).abs() < 1e-3, "{freedom}: {}", t_quantile_95(freedom));
        }
    }

    #[test]
    fn the_tail_joins_the_centre() {
        assert!((ln_normal_cdf(0.0) + std::f64::consts::LN_2).abs() < 1e-12);
        let (above, below) = (ln_normal_cdf(-19.999_999), ln_normal_cdf(-20.000_001));
        assert!((above - below).abs() < 1e-4, "{above} {below}");
        // Reference: R 4.3, pnorm(-30, log.p = TRUE).
        assert!((ln_normal_cdf(-30.0) + 454.321_244).abs() < 1e-4, "{}", ln_normal_cdf(-30.0));
    }
}
