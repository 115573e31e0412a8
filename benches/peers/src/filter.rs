//! A particle filter as the older work on this valve has it: Daigle and Goebel, "A Model-Based Prognostics Approach Applied
//! to Pneumatic Valves", IJPHM 2 (2011). Each particle is a leak and its growth a cycle, whose logarithm takes a random walk;
//! readings weigh the particles, systematic resampling keeps those that count, and all are carried on to the limit.
//!
//! The paper simulates each particle's strokes; here the table tells its times, as it does for the prognoser.

use leak_table::{Fault, Stroke, TableBundle};
use prognoser::Reading;
use prognoser::study::NoiseSource;

/// Share of the particles that must effectively be left, or else they are drawn anew.
const FEWEST: f64 = 0.5;
/// Cycles ahead that a particle is carried at most.
const FARTHEST: u32 = 1000;

/// What the filter is told and how it works.
#[derive(Clone, Debug)]
pub struct Settings {
    /// How many particles.
    pub particles: usize,
    /// Standard deviation of the noise of the timings, s.
    pub noise_s: f64,
    /// The strokes whose times it is shown.
    pub strokes: &'static [Stroke],
    /// Cycles from health to the limit, beforehand: the median, and the standard deviation of the logarithm.
    pub life: (f64, f64),
    /// Standard deviation of what the logarithm of the growth changes by in a cycle.
    pub walk: f64,
    /// Whether the growth goes on to change on the way to the limit; else a particle keeps the growth it has.
    pub walks_on: bool,
}

/// The predicted end of life, a cycle.
#[derive(Clone, Copy, Debug)]
pub struct End {
    /// Its median.
    pub median: f64,
    /// 5 %.
    pub p05: f64,
    /// 95 %.
    pub p95: f64,
}

#[derive(Clone, Copy, Debug)]
struct Particle {
    leak_m2: f64,
    growth_m2: f64,
    weight: f64,
}

/// The filter of one valve with a leak to atmosphere.
pub struct Filter<'a> {
    settings: &'a Settings,
    tables: &'a TableBundle,
    particles: Vec<Particle>,
    drawn: Vec<Particle>,
    ends: Vec<(f64, f64)>,
    random: NoiseSource,
    cycle: u64,
}

impl<'a> Filter<'a> {
    /// A filter that has seen nothing, of a valve that has no leak at cycle 0.
    pub fn new(settings: &'a Settings, tables: &'a TableBundle, seed: u64) -> Self {
        let mut random = NoiseSource::new(seed, 1);
        let limit_m2 = tables.limit_area_m2(Fault::Atmosphere);
        let weight = 1.0 / settings.particles as f64;
        let mut particle = || {
            let life = settings.life.0 * (settings.life.1 * random.normal()).exp();
            Particle { leak_m2: 0.0, growth_m2: limit_m2 / life, weight }
        };
        let particles = (0..settings.particles).map(|_| particle()).collect();
        Self { settings, tables, particles, drawn: Vec::new(), ends: Vec::new(), random, cycle: 0 }
    }

    /// The leak as the particles have it on average, m2.
    #[cfg(test)]
    pub fn leak_m2(&self) -> f64 {
        self.particles.iter().map(|particle| particle.weight * particle.leak_m2).sum()
    }

    /// Takes in a reading; the end after it.
    pub fn update(&mut self, reading: &Reading) -> End {
        let cycles = reading.cycle - self.cycle;
        self.cycle = reading.cycle;
        for particle in &mut self.particles {
            for _ in 0..cycles {
                grow(particle, self.settings.walk, &mut self.random);
            }
        }
        self.weigh(reading);
        let end = self.end();
        let effective = 1.0 / self.particles.iter().map(|particle| particle.weight.powi(2)).sum::<f64>();
        if effective < FEWEST * self.particles.len() as f64 {
            self.resample();
        }
        end
    }

    fn weigh(&mut self, reading: &Reading) {
        let table = self.tables.table(Fault::Atmosphere);
        let told =
            self.settings.strokes.iter().filter_map(|stroke| Some((table.curve(*stroke), reading.time_s(*stroke)?)));
        let told: Vec<_> = told.collect();
        let mut sum = 0.0;
        for particle in &mut self.particles {
            let square: f64 = told
                .iter()
                .map(|(curve, time_s)| (time_s - curve.extrapolated_time_and_slope(particle.leak_m2).0).powi(2))
                .sum();
            // The least weight keeps the sum above 0 where no particle is near.
            particle.weight *= (-0.5 * square / self.settings.noise_s.powi(2)).exp().max(f64::MIN_POSITIVE);
            sum += particle.weight;
        }
        for particle in &mut self.particles {
            particle.weight /= sum;
        }
    }

    /// Every particle carried on to the limit.
    fn end(&mut self) -> End {
        let limit_m2 = self.tables.limit_area_m2(Fault::Atmosphere);
        self.ends.clear();
        for particle in &self.particles {
            let mut ahead = *particle;
            let mut cycles = 0;
            if self.settings.walks_on {
                while ahead.leak_m2 < limit_m2 && cycles < FARTHEST {
                    grow(&mut ahead, self.settings.walk, &mut self.random);
                    cycles += 1;
                }
            }
            // What is left, or was too much, at the growth it has by then.
            let left = (limit_m2 - ahead.leak_m2) / ahead.growth_m2;
            self.ends.push((self.cycle as f64 + f64::from(cycles) + left, particle.weight));
        }
        self.ends.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let at = |share: f64| {
            let mut sum = 0.0;
            let reached = |(_, weight): &&(f64, f64)| {
                sum += weight;
                sum >= share
            };
            self.ends.iter().find(reached).or(self.ends.last()).map_or(f64::NAN, |end| end.0)
        };
        End { median: at(0.5), p05: at(0.05), p95: at(0.95) }
    }

    /// Systematic resampling (Kitagawa 1996): one random number, and a comb of equal teeth.
    fn resample(&mut self) {
        let count = self.particles.len() as f64;
        let first = self.random.uniform();
        self.drawn.clear();
        let mut sum = 0.0;
        for particle in &self.particles {
            sum += particle.weight;
            while (self.drawn.len() as f64 + first) / count < sum && self.drawn.len() < self.particles.len() {
                self.drawn.push(Particle { weight: 1.0 / count, ..*particle });
            }
        }
        // Rounding of the sum may leave the last tooth without one.
        while self.drawn.len() < self.particles.len() {
            self.drawn.push(Particle { weight: 1.0 / count, ..self.particles[self.particles.len() - 1] });
        }
        std::mem::swap(&mut self.particles, &mut self.drawn);
    }
}

fn grow(particle: &mut Particle, walk: f64, random: &mut NoiseSource) {
    if walk > 0.0 {
        particle.growth_m2 *= (walk * random.normal()).exp();
    }
    particle.leak_m2 += particle.growth_m2;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference_valve::tables;

    #[test]
    fn a_known_leak_and_its_end_are_found() {
        let tables = tables();
        let settings = Settings {
            particles: 1000,
            noise_s: 0.01,
            strokes: &[Stroke::Close],
            life: (50.0, 1.25),
            walk: 0.03,
            walks_on: false,
        };
        let limit_m2 = tables.limit_area_m2(Fault::Atmosphere);
        let mut filter = Filter::new(&settings, &tables, 1);
        let leak_m2 = |cycle: u32| limit_m2 * f64::from(cycle) / 40.0;
        let mut end = None;
        for cycle in 0..30 {
            let time =
                tables.table(Fault::Atmosphere).curve(Stroke::Close).extrapolated_time_and_slope(leak_m2(cycle)).0;
            let reading = Reading { cycle: u64::from(cycle), close_time_s: Some(time), ..Reading::default() };
            end = Some(filter.update(&reading));
        }
        let end = end.expect("readings were given");
        assert!((filter.leak_m2() - leak_m2(29)).abs() < 0.01 * limit_m2, "{}", filter.leak_m2());
        assert!((end.median - 40.0).abs() < 1.0 && end.p05 < 40.0 && 40.0 < end.p95, "{end:?}");
    }
}
