//! What readings that were rounded to the same step of a recorder have in common.
//!
//! Where noise is larger than a step of the recorder, it makes the errors of rounding independent of one another, and means get
//! better with the readings in them. Where it is smaller, readings at one place are rounded alike, however many they are: for white
//! noise of standard deviation w before it is rounded to steps of q, the mean of many readings at x is off by
//! Σ (-1)^k q / (π k) exp(-2 π² k² w² / q²) sin(2 π k x / q) (Widrow and Kollár, Quantization Noise, Cambridge 2008, chapter 4, from
//! the characteristic function of the noise), whose mean square over all places within a step is q²/12 for w = 0.

use core::f64::consts::PI;

/// Harmonics of the error of rounding; the mean square of those that are left out is below 1 % of q²/12.
const HARMONICS: i32 = 60;

/// The variance of a reading that is rounded, where nothing tells where in a step it lies, in the unit of the readings squared.
pub fn variance(step: f64) -> f64 {
    step * step / 12.0
}

/// The mean square of what readings at one place have in common, in the unit of the readings squared.
pub fn common_variance(step: f64, noise: f64) -> f64 {
    if step <= 0.0 {
        return 0.0;
    }
    let harmonic = |k: i32| {
        let k = f64::from(k);
        (step / (PI * k)).powi(2) / 2.0 * (-(2.0 * PI * k * noise / step).powi(2)).exp()
    };
    (1..=HARMONICS).map(harmonic).sum()
}

#[cfg(test)]
mod tests {
    use super::{common_variance, variance};

    /// The mean square, over places within a step, of how far the mean of all readings is off, by adding up what each code is
    /// read with.
    fn added_up(step: f64, noise: f64) -> f64 {
        let places = 400;
        let below = |z: f64| identify::special::ln_normal_cdf(z).exp();
        let error = |place: i32| {
            let x = step * (f64::from(place) + 0.5) / f64::from(places);
            let code = |code: i32| {
                let middle = f64::from(code) * step;
                let of = |edge: f64| below((middle + edge * step - x) / noise);
                middle * (of(0.5) - of(-0.5))
            };
            (-40..=40).map(code).sum::<f64>() - x
        };
        (0..places).map(|place| error(place).powi(2)).sum::<f64>() / f64::from(places)
    }

    #[test]
    fn readings_at_one_place_are_rounded_alike_as_far_as_noise_lets_them() {
        assert!((common_variance(0.1, 0.0) / variance(0.1) - 1.0).abs() < 0.02);
        for noise in [0.02, 0.03, 0.05] {
            let (found, exact) = (common_variance(0.1, noise), added_up(0.1, noise));
            assert!((found / exact - 1.0).abs() < 0.01, "{noise}: {found} {exact}");
        }
        assert!(common_variance(0.1, 0.1) < 1e-6 * variance(0.1));
        assert!(common_variance(0.0, 0.1) < f64::MIN_POSITIVE);
    }
}
