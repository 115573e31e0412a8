//! What sensors and loggers make of what happens.

use std::f64::consts::TAU;

use rand::RngExt;
use rand::rngs::StdRng;

use crate::effects::log_uniform;
use crate::measure::normal;
use crate::world::play::Impact;
use crate::world::realism::Realisms;

/// The position sensor and the logger of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Instrument {
    pub stroke_m: f64,
    /// One sigma of the noise.
    pub noise_m: f64,
    /// Correlation time of the noise; zero: white.
    pub correlation_s: f64,
    pub zero_sigma_m: f64,
    pub gain: f64,
    /// Largest drift over a record.
    pub drift_m: f64,
    /// Parts of the stroke by which it is off at its middle and in its halves.
    pub bow: (f64, f64),
    pub quantum_m: f64,
    pub hum_m: f64,
    pub hum_hz: f64,
    pub spike_share: f64,
    /// Amplitude of ringing per speed of impact, s; frequency and decay.
    pub ringing_s: f64,
    pub ringing_hz: f64,
    pub ringing_decay_s: f64,
    /// Pressure channels: one sigma of noise, zero, gain.
    pub pressure_noise_pa: f64,
    pub pressure_zero_pa: f64,
    pub pressure_gain: f64,
}

fn sign(rng: &mut StdRng) -> f64 {
    if rng.random_bool(0.5) { 1.0 } else { -1.0 }
}

impl Instrument {
    /// The instrument of a campaign; `noise_m` is the noise of its sensor, `close_s` the time of a stroke.
    pub fn draw(realisms: &Realisms, stroke_m: f64, noise_m: f64, close_s: f64, rng: &mut StdRng) -> Self {
        let of_stroke = |name: &str| realisms.size(name) * stroke_m;
        let tilt = rng.random_range(0.0..TAU);
        let nonlinearity = realisms.size("nonlinearity");
        Self {
            stroke_m,
            noise_m,
            correlation_s: realisms.size("coloured-noise") * close_s,
            zero_sigma_m: of_stroke("zero-by-run"),
            gain: 1.0 + sign(rng) * realisms.size("gain"),
            drift_m: of_stroke("drift"),
            bow: (nonlinearity * tilt.cos(), nonlinearity * tilt.sin()),
            // Every logger has a resolution; a coarse one is a realism.
            quantum_m: if realisms.has("quantised") { of_stroke("quantised") } else { 0.1 * noise_m },
            hum_m: of_stroke("hum"),
            hum_hz: if rng.random_bool(0.5) { 50.0 } else { 60.0 } * (1.0 + 1e-3 * normal(rng)),
            spike_share: realisms.size("spikes"),
            ringing_s: of_stroke("ringing") / (2.0 * stroke_m / close_s),
            ringing_hz: log_uniform(rng, 15.0, 120.0),
            ringing_decay_s: log_uniform(rng, 0.02, 0.12),
            pressure_noise_pa: log_uniform(rng, 200.0, 1500.0),
            pressure_zero_pa: sign(rng) * realisms.size("pressure-zero"),
            pressure_gain: 1.0 + sign(rng) * realisms.size("pressure-gain"),
        }
    }

    /// What is written down of a position that is really `position_m` at the times `at_s`.
    pub fn read(&self, position_m: &[f64], at_s: &[f64], impacts: &[Impact], rng: &mut StdRng) -> Vec<f64> {
        let zero_m = self.zero_sigma_m * normal(rng);
        let drift_m = self.drift_m * rng.random_range(-1.0..1.0);
        let hum_phase = rng.random_range(0.0..TAU);
        let ringing_phase = rng.random_range(0.0..TAU);
        let (first, last) = (at_s.first().copied().unwrap_or(0.0), at_s.last().copied().unwrap_or(1.0));
        let mut coloured = normal(rng);
        let mut before = first;
        at_s.iter()
            .zip(position_m)
            .map(|(&t, &x)| {
                let u = x / self.stroke_m;
                let bow = self.bow.0 * (4.0 * u * (1.0 - u)) + self.bow.1 * (TAU * u).sin();
                let mut shown = self.gain * (x + bow * self.stroke_m) + zero_m;
                shown += drift_m * (t - first) / (last - first).max(1e-9);
                shown += self.hum_m * (TAU * self.hum_hz * t + hum_phase).sin();
                shown += self.ringing(t, impacts, ringing_phase);
                let white = normal(rng);
                if self.correlation_s > 0.0 {
                    let keep = (-(t - before) / self.correlation_s).exp();
                    coloured = keep * coloured + (1.0 - keep * keep).sqrt() * white;
                    before = t;
                    shown += self.noise_m * coloured;
                } else {
                    shown += self.noise_m * white;
                }
                if self.spike_share > 0.0 && rng.random_bool(self.spike_share) {
                    shown += sign(rng) * log_uniform(rng, 0.03, 1.5) * self.stroke_m;
                }
                (shown / self.quantum_m).round() * self.quantum_m
            })
            .collect()
    }

    fn ringing(&self, t: f64, impacts: &[Impact], phase: f64) -> f64 {
        if self.ringing_s == 0.0 {
            return 0.0;
        }
        impacts
            .iter()
            .map(|impact| (t - impact.at_s, impact.speed_m_per_s))
            .filter(|(since, _)| (0.0..10.0 * self.ringing_decay_s).contains(since))
            .map(|(since, speed)| {
                let wave = (TAU * self.ringing_hz * since + phase).sin();
                self.ringing_s * speed * wave * (-since / self.ringing_decay_s).exp()
            })
            .sum()
    }

    /// What is written down of a pressure.
    pub fn read_pressure(&self, pressure_pa: &[f64], rng: &mut StdRng) -> Vec<f64> {
        pressure_pa
            .iter()
            .map(|p| {
                let shown = self.pressure_gain * p + self.pressure_zero_pa + self.pressure_noise_pa * normal(rng);
                (shown / 10.0).round() * 10.0
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    const ROWS: usize = 20_000;

    fn read(name: &'static str, size: f64) -> (Vec<f64>, Vec<f64>) {
        let mut rng = StdRng::seed_from_u64(1);
        let instrument = Instrument::draw(&Realisms::only(name, size), 0.02, 1e-5, 1.0, &mut rng);
        let at: Vec<f64> = (0..ROWS).map(|row| row as f64 * 1e-3).collect();
        let place: Vec<f64> = at.iter().map(|t| 0.01 + 0.01 * (0.3 * t).cos()).collect();
        let impacts = [Impact { at_s: 5.0, speed_m_per_s: 0.04 }];
        let shown = instrument.read(&place, &at, &impacts, &mut rng);
        (shown.iter().zip(&place).map(|(a, b)| a - b).collect(), place)
    }

    fn rms(values: &[f64]) -> f64 {
        (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
    }

    #[test]
    fn a_plain_sensor_has_white_noise_of_its_size() {
        let (off, _) = read("clock-rate", 1e-9);
        assert!((rms(&off) / 1e-5 - 1.0).abs() < 0.05);
        let next: f64 = off.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / (ROWS as f64 * 1e-10);
        assert!(next.abs() < 0.05, "{next}");
    }

    #[test]
    fn coloured_noise_has_its_size_and_its_time() {
        let (off, _) = read("coloured-noise", 0.02);
        assert!((rms(&off) / 1e-5 - 1.0).abs() < 0.15);
        let next: f64 = off.windows(21).map(|w| w[0] * w[20]).sum::<f64>() / off.iter().map(|v| v * v).sum::<f64>();
        assert!((next - (-1.0_f64).exp()).abs() < 0.15, "{next}");
    }

    #[test]
    fn a_gain_scales_and_a_nonlinearity_bends() {
        let (off, place) = read("gain", 0.01);
        let slope = off.iter().zip(&place).map(|(o, x)| o * x).sum::<f64>() / place.iter().map(|x| x * x).sum::<f64>();
        assert!((slope.abs() - 0.01).abs() < 1e-4, "{slope}");
        let (bent, _) = read("nonlinearity", 5e-3);
        let largest = bent.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        assert!((0.5e-4..1.6e-4).contains(&largest), "{largest}");
    }

    #[test]
    fn steps_spikes_hum_and_ringing_are_there() {
        let (off, place) = read("quantised", 0.01);
        let shown = off[3] + place[3];
        assert!((shown / 2e-4 - (shown / 2e-4).round()).abs() < 1e-9);
        let (spiked, _) = read("spikes", 2e-3);
        let far = spiked.iter().filter(|v| v.abs() > 5e-4).count();
        assert!((15..80).contains(&far), "{far}");
        let (hum, _) = read("hum", 5e-3);
        assert!((rms(&hum) / (1e-4 / 2.0_f64.sqrt()) - 1.0).abs() < 0.05);
        let (ringing, _) = read("ringing", 0.02);
        assert!(rms(&ringing[5000..5010]) > 1e-4 && rms(&ringing[4000..4900]) < 2e-5);
    }

    #[test]
    fn zeros_differ_by_run_and_drift_stays_in_its_bounds() {
        let mut rng = StdRng::seed_from_u64(2);
        let instrument = Instrument::draw(&Realisms::only("zero-by-run", 0.01), 0.02, 1e-7, 1.0, &mut rng);
        let zeros: Vec<f64> = (0..200).map(|_| instrument.read(&[0.0], &[0.0], &[], &mut rng)[0]).collect();
        assert!((rms(&zeros) / 2e-4 - 1.0).abs() < 0.15, "{}", rms(&zeros));
        let (drift, _) = read("drift", 0.01);
        assert!((drift[ROWS - 1] - drift[0]).abs() < 2e-4 + 1e-4);
        assert!(rms(&drift) > 1e-5);
    }
}
