//! All hypotheses of one valve together.

use leak_table::{Fault, Stroke, TableBundle};

use super::config::{BayesConfig, Noise, StartPrior};
use super::model::FaultModel;
use super::posterior::{
    GrowthPrior, NoisePrior, Posterior, Quantiles, View, ln_evidence_without_growth, ln_sum,
    posterior,
};
use super::sums::{GlitchModel, Sums};
use super::track::{Priors, Track};
use crate::reading::Reading;

/// Number of first readings that are fitted together.
const FIRST: usize = 8;

/// Probability of each hypothesis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultProbability {
    /// The leak does not grow.
    pub none: f64,
    /// A growing leak to atmosphere.
    pub atmosphere: f64,
    /// A growing leak from the supply.
    pub supply: f64,
}

impl FaultProbability {
    /// The probability of one fault.
    pub fn of(&self, fault: Fault) -> f64 {
        match fault {
            Fault::Atmosphere => self.atmosphere,
            Fault::Supply => self.supply,
        }
    }
}

/// The estimate after a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BayesEstimate {
    /// Probability of each hypothesis.
    pub probability: FaultProbability,
    /// The more probable of the two faults; the fields below hold given it.
    pub leading: Fault,
    /// Leak area now, in m2.
    pub leak_area_m2: f64,
    /// Growth of the leak area in m2 per cycle.
    pub leak_rate_m2: f64,
    /// The cycle at end of life.
    pub eol_cycle: Quantiles,
    /// Estimated standard deviation of the timings' noise, in s.
    pub noise_sd_s: f64,
    /// Probability that the close and the open timing of this cycle were
    /// proper readings.
    pub inlier: [f64; 2],
    /// Residuals of this cycle's timings in expected standard deviations.
    pub surprise: [Option<f64>; 2],
}

/// The recursive estimate of one valve. Its size does not grow.
#[derive(Clone, Debug)]
pub struct BayesEstimator {
    priors: Priors,
    ln_none: f64,
    ln_fault: f64,
    healthy: Vec<View>,
    unknown: Vec<View>,
    first: Vec<Reading>,
    origin: u64,
    tracks: Option<[(Track, bool); 2]>,
    none: NoneTrack,
}

/// The hypothesis that nothing grows, for a leak that stays at zero.
#[derive(Clone, Copy, Debug)]
struct NoneTrack {
    sums: [Sums; 2],
    sigma2: f64,
}

impl BayesEstimator {
    /// An estimator that has seen nothing.
    pub fn new(config: &BayesConfig) -> Self {
        let noise = match config.noise {
            Noise::Known { sd_s } => {
                let a = 1e6;
                NoisePrior { a, b: a * sd_s * sd_s }
            }
            Noise::Estimated { prior_readings, prior_sd_s } => {
                let a = 0.5 * prior_readings;
                NoisePrior { a, b: a * prior_sd_s * prior_sd_s }
            }
        };
        let growth =
            GrowthPrior { ln_median: -config.life_median_cycles.ln(), ln_sd: config.life_ln_sd };
        let right = 1.0 - config.wrong_start;
        let any = |weight: f64| View { ln_weight: weight.ln(), mean: 0.4, sd: 0.4 };
        let (healthy, unknown) = match config.start {
            StartPrior::Healthy => (
                vec![
                    View { ln_weight: (right * config.no_start_leak).ln(), mean: 0.0, sd: 0.0 },
                    View {
                        ln_weight: (right * (1.0 - config.no_start_leak)).ln(),
                        mean: 0.0,
                        sd: config.start_sd,
                    },
                ],
                vec![any(config.wrong_start)],
            ),
            StartPrior::Unknown => (Vec::new(), vec![any(1.0)]),
        };
        Self {
            priors: Priors { noise, growth, glitch: GlitchModel { share: config.outlier_share } },
            ln_none: config.no_fault.ln(),
            ln_fault: (0.5 * (1.0 - config.no_fault)).ln(),
            healthy,
            unknown,
            first: Vec::with_capacity(FIRST),
            origin: 0,
            tracks: None,
            none: NoneTrack { sums: [Sums::default(); 2], sigma2: noise.b / noise.a },
        }
    }

    /// Takes in one cycle and gives the estimate after it.
    pub fn update(&mut self, tables: &TableBundle, reading: &Reading) -> BayesEstimate {
        if self.first.is_empty() {
            self.origin = reading.cycle;
        }
        let models = Fault::ALL.map(|fault| FaultModel::new(tables, fault));
        let origin = self.origin;
        let shape = |cycle: u64| cycle.saturating_sub(origin) as f64;
        if self.first.len() < FIRST {
            self.first.push(*reading);
            let tracks = models.map(|model| {
                let fit = |views: &[View]| {
                    (!views.is_empty())
                        .then(|| Track::fit(&model, &self.first, &shape, views, &self.priors))
                };
                match (fit(&self.healthy), fit(&self.unknown)) {
                    (Some(a), Some(b)) if b.state.ln_evidence > a.state.ln_evidence => (b, false),
                    (Some(a), _) => (a, true),
                    (None, Some(b)) => (b, false),
                    (None, None) => unreachable!("there is always a prior of the start"),
                }
            });
            self.tracks = Some(tracks);
            self.none = NoneTrack::fit(&models, &self.first, &shape, &self.priors);
        } else if let Some(tracks) = &mut self.tracks {
            let phi = shape(reading.cycle);
            for ((track, healthy), model) in tracks.iter_mut().zip(&models) {
                let views = if *healthy { &self.healthy } else { &self.unknown };
                track.update(model, reading, phi, views, &self.priors);
            }
            self.none.update(&models, reading, phi, &self.priors);
        }
        self.estimate(&models, reading)
    }

    fn estimate(&self, models: &[FaultModel; 2], reading: &Reading) -> BayesEstimate {
        let tracks = self.tracks.as_ref().expect("the first update makes the tracks");
        let none = if self.healthy.is_empty() {
            self.none.ln_evidence(&self.unknown, &self.priors)
        } else {
            self.none.ln_evidence(&self.healthy, &self.priors)
        };
        let ln = [
            self.ln_none + none,
            self.ln_fault + tracks[0].0.state.ln_evidence,
            self.ln_fault + tracks[1].0.state.ln_evidence,
        ];
        let total = ln_sum(ln.iter().copied());
        let [none, atmosphere, supply] = ln.map(|value| (value - total).exp());
        let leading = if atmosphere >= supply { Fault::Atmosphere } else { Fault::Supply };
        let (track, _) = &tracks[leading as usize];
        let limit_m2 = models[leading as usize].limit_m2();
        let Posterior { start, growth, sigma2, eol_phi, .. } = track.state;
        let phi = reading.cycle.saturating_sub(self.origin) as f64;
        let origin = self.origin as f64;
        BayesEstimate {
            probability: FaultProbability { none, atmosphere, supply },
            leading,
            leak_area_m2: (start + growth * phi) * limit_m2,
            leak_rate_m2: growth * limit_m2,
            eol_cycle: Quantiles {
                p05: origin + eol_phi.p05,
                p50: origin + eol_phi.p50,
                p95: origin + eol_phi.p95,
            },
            noise_sd_s: sigma2.sqrt(),
            inlier: track.inlier,
            surprise: track.surprise,
        }
    }
}

impl NoneTrack {
    fn fit(
        models: &[FaultModel; 2],
        readings: &[Reading],
        shape: &impl Fn(u64) -> f64,
        priors: &Priors,
    ) -> Self {
        let mut sizes: Vec<f64> = readings
            .iter()
            .flat_map(|r| Stroke::ALL.into_iter().filter_map(|s| r.time_s(s).map(|t| (s, t))))
            .map(|(s, t)| (t - models[0].time_and_slope(s, 0.0).0).abs())
            .collect();
        sizes.sort_by(f64::total_cmp);
        let n = sizes.len() as f64;
        let sd = sizes.get(sizes.len() / 2).map_or(0.0, |median| 1.4826 * median);
        let mut track = Self {
            sums: [Sums::default(); 2],
            sigma2: (2.0 * priors.noise.b + n * sd * sd) / (2.0 * priors.noise.a + n),
        };
        for _ in 0..4 {
            track.sums = [Sums::default(); 2];
            for reading in readings {
                track.add(models, reading, shape(reading.cycle), priors);
            }
            track.settle(priors);
        }
        track
    }

    fn update(&mut self, models: &[FaultModel; 2], reading: &Reading, phi: f64, priors: &Priors) {
        self.add(models, reading, phi, priors);
        self.settle(priors);
    }

    fn add(&mut self, models: &[FaultModel; 2], reading: &Reading, phi: f64, priors: &Priors) {
        for stroke in Stroke::ALL {
            let Some(time) = reading.time_s(stroke) else {
                for sums in &mut self.sums {
                    sums.ln_extra += priors.glitch.share.ln();
                }
                continue;
            };
            for (sums, model) in self.sums.iter_mut().zip(models) {
                let (expected, slope) = model.time_and_slope(stroke, 0.0);
                let residual = time - expected;
                let window = model.window_s(stroke);
                let (p, ln_extra) = priors.glitch.inlier(residual, self.sigma2, window);
                let lin = super::sums::Linearised { leak: 0.0, residual, slope };
                sums.add(phi, &lin, p);
                sums.ln_extra += ln_extra;
            }
        }
    }

    fn settle(&mut self, priors: &Priors) {
        let sums = &self.sums[0];
        self.sigma2 = (priors.noise.b + 0.5 * sums.c) / (priors.noise.a + 0.5 * sums.n);
    }

    /// Half of the probability for a constant leak of either kind; without a
    /// leak the two are the same.
    fn ln_evidence(&self, views: &[View], priors: &Priors) -> f64 {
        let one = |sums: &Sums| {
            ln_evidence_without_growth(sums, views, &priors.noise, self.sigma2) - 2.0_f64.ln()
        };
        ln_sum([one(&self.sums[0]), one(&self.sums[1])].into_iter())
    }
}

#[expect(dead_code, reason = "placeholder")]
fn unused() {
    let _ = posterior;
}
