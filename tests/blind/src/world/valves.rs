//! Valves as they are believed to be: from a needle valve of 4 mm to a gate of 300 mm, strokes of 0.1 to 60 s, and
//! vertical cylinders without a spring.

use rand::RngExt;
use rand::rngs::StdRng;

use crate::effects::log_uniform;
use crate::hidden::Hidden;
use crate::valve::{GRAVITY_M_PER_S2, Orientation, PSI_PA, Valve};
use crate::world::play::{at, plain_cycle, times_of};

/// Kinds of valves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Of a hand's size, closing in 0.3 to 4 s.
    Common,
    /// 4 to 10 mm of stroke, closing in 0.1 to 0.6 s.
    Needle,
    /// 120 to 300 mm of stroke.
    Gate,
    /// Closing in 10 to 60 s.
    Slow,
    /// A vertical cylinder that falls by its weight.
    Springless,
}

impl Class {
    /// The word for it in the truth.
    pub fn word(self) -> &'static str {
        match self {
            Self::Common => "common",
            Self::Needle => "needle",
            Self::Gate => "gate",
            Self::Slow => "slow",
            Self::Springless => "springless",
        }
    }

    /// The kind of that word.
    pub fn of_word(word: &str) -> Option<Self> {
        [Self::Common, Self::Needle, Self::Gate, Self::Slow, Self::Springless].into_iter().find(|c| c.word() == word)
    }

    /// Draws a kind; most are common.
    pub(crate) fn draw(rng: &mut StdRng) -> Self {
        match rng.random_range(0..20) {
            0..=10 => Self::Common,
            11..=12 => Self::Needle,
            13..=14 => Self::Gate,
            15..=16 => Self::Slow,
            _ => Self::Springless,
        }
    }

    /// Ranges of closing time in s, stroke in m and piston area in m2.
    fn ranges(self) -> [(f64, f64); 3] {
        match self {
            Self::Common => [(0.3, 4.0), (10e-3, 60e-3), (10e-4, 100e-4)],
            Self::Needle => [(0.1, 0.6), (4e-3, 10e-3), (3e-4, 15e-4)],
            Self::Gate => [(1.0, 15.0), (120e-3, 300e-3), (150e-4, 800e-4)],
            Self::Slow => [(10.0, 60.0), (15e-3, 80e-3), (10e-4, 120e-4)],
            Self::Springless => [(0.15, 1.5), (30e-3, 200e-3), (3e-4, 25e-4)],
        }
    }
}

/// A believed valve and what its strokes take.
#[derive(Debug, Clone)]
pub(crate) struct Subject {
    pub class: Class,
    pub valve: Valve,
    /// Supply pressures it may be recorded at, rising.
    pub pressures_psig: Vec<f64>,
    /// Closing and opening time at its usual supply pressure.
    pub close_s: f64,
    pub open_s: f64,
    /// Longest closing and opening time over all pressures.
    pub slow_close_s: f64,
    pub slow_open_s: f64,
}

impl Subject {
    /// What forces are measured by: the preload, or without a spring twice the weight.
    pub fn force_n(&self) -> f64 {
        let preload = self.valve.spring_n_per_m * self.valve.preload_m;
        if preload > 0.0 { preload } else { 2.0 * self.valve.mass_kg * GRAVITY_M_PER_S2 }
    }

    /// Parameters that the user knows within a tolerance only: key and relative one sigma.
    pub fn tolerances(&self) -> Vec<(usize, f64)> {
        match self.class {
            // Viscous friction, dead volume and port; the pipe is measured.
            Class::Springless => vec![(0, 0.5), (1, 0.3), (5, 0.5)],
            _ => crate::valve::TOLERANCES.iter().enumerate().map(|(index, (_, sigma))| (index, *sigma)).collect(),
        }
    }
}

/// Draws a valve of a class; none where the numbers make none that strokes fully.
pub(crate) fn subject(class: Class, rng: &mut StdRng) -> Option<Subject> {
    if class == Class::Springless { springless(rng) } else { sprung(class, rng) }
}

fn draw(rng: &mut StdRng, (low, high): (f64, f64)) -> f64 {
    log_uniform(rng, low, high)
}

fn sprung(class: Class, rng: &mut StdRng) -> Option<Subject> {
    let [time, stroke, area] = class.ranges();
    let (target_s, stroke_m, piston_area_m2) = (draw(rng, time), draw(rng, stroke), draw(rng, area));
    let start_pa = rng.random_range(90e3..250e3);
    let end_pa = start_pa * rng.random_range(1.2..2.2);
    let swept_m3 = piston_area_m2 * stroke_m;
    let spring_n_per_m = (end_pa - start_pa) * piston_area_m2 / stroke_m;
    let preload_n = start_pa * piston_area_m2;
    let low_psig = (end_pa * rng.random_range(1.17..1.35) / PSI_PA / 5.0).ceil() * 5.0;
    let step_psig = [5.0, 7.5, 10.0][rng.random_range(0..3)];
    let pressures_psig: Vec<f64> = (0..5).map(|step| low_psig + f64::from(step) * step_psig).collect();
    let orientation =
        [Orientation::Upright, Orientation::Inverted, Orientation::Horizontal][[0, 0, 1, 2][rng.random_range(0..4)]];
    let mut valve = Valve {
        mass_kg: 1.5 * (piston_area_m2 / 31e-4) * (stroke_m / 25e-3).powf(0.4) * rng.random_range(0.5..2.0),
        stroke_m,
        piston_area_m2,
        dead_volume_m3: swept_m3 * rng.random_range(0.1..0.8),
        viscous_ns_per_m: log_uniform(rng, 0.005, 0.08) * preload_n * 0.4 * target_s.min(2.0) / stroke_m,
        spring_n_per_m,
        preload_m: preload_n / spring_n_per_m,
        contact_n_per_m: preload_n / (stroke_m * rng.random_range(0.012..0.03)),
        supply_psig: pressures_psig[2],
        pipe_volume_m3: swept_m3 * log_uniform(rng, 0.15, 1.2),
        solenoid_area_m2: 0.5e-6 * (swept_m3 / 79e-6) / target_s,
        port_area_m2: 0.0,
        orientation,
        open_at_s: 10.0 * target_s,
        cycle_end_s: 30.0 * target_s,
    };
    let port_ratio = log_uniform(rng, 2.0, 12.0);
    for _ in 0..2 {
        valve.port_area_m2 = port_ratio * valve.solenoid_area_m2;
        valve.solenoid_area_m2 *= times(&valve, valve.supply_psig).0? / target_s;
    }
    valve.port_area_m2 = port_ratio * valve.solenoid_area_m2;
    timed(class, valve, pressures_psig)
}

fn springless(rng: &mut StdRng) -> Option<Subject> {
    let [time, stroke, area] = Class::Springless.ranges();
    let (target_s, stroke_m, piston_area_m2) = (draw(rng, time), draw(rng, stroke), draw(rng, area));
    let swept_m3 = piston_area_m2 * stroke_m;
    // The load weighs some hundredths to some tenths of what the supply can lift.
    let supply_psig = (rng.random_range(25.0..80.0_f64) / 5.0).round() * 5.0;
    let mass_kg = log_uniform(rng, 0.02, 0.25) * supply_psig * PSI_PA * piston_area_m2 / GRAVITY_M_PER_S2;
    let step_psig = [5.0, 7.5, 10.0][rng.random_range(0..3)];
    let mut valve = Valve {
        mass_kg,
        stroke_m,
        piston_area_m2,
        dead_volume_m3: swept_m3 * rng.random_range(0.08..0.4),
        viscous_ns_per_m: log_uniform(rng, 0.01, 0.15) * mass_kg * GRAVITY_M_PER_S2 * target_s / stroke_m,
        spring_n_per_m: 0.0,
        preload_m: 0.0,
        contact_n_per_m: 1e6,
        supply_psig,
        pipe_volume_m3: swept_m3 * log_uniform(rng, 0.1, 0.6),
        solenoid_area_m2: 1e-6 * (swept_m3 / 79e-6) / target_s,
        port_area_m2: 0.0,
        orientation: Orientation::Inverted,
        open_at_s: 10.0 * target_s,
        cycle_end_s: 40.0 * target_s,
    };
    let port_ratio = log_uniform(rng, 0.4, 2.0);
    for _ in 0..2 {
        valve.port_area_m2 = port_ratio * valve.solenoid_area_m2;
        valve.solenoid_area_m2 *= times(&valve, supply_psig).0? / target_s;
    }
    valve.port_area_m2 = port_ratio * valve.solenoid_area_m2;
    timed(Class::Springless, valve, vec![supply_psig - step_psig, supply_psig, supply_psig + step_psig])
}

fn times(valve: &Valve, psig: f64) -> (Option<f64>, Option<f64>) {
    let play = plain_cycle(valve, &Hidden::default(), &at(psig), valve.open_at_s, valve.cycle_end_s);
    times_of(&play, valve.open_at_s, valve.cycle_end_s, 4000)
}

/// Sets the usual cycle by the slowest strokes.
fn timed(class: Class, mut valve: Valve, pressures_psig: Vec<f64>) -> Option<Subject> {
    let mut slowest = (0.0_f64, 0.0_f64);
    for &psig in [pressures_psig.first()?, pressures_psig.last()?] {
        let (close, open) = times(&valve, psig);
        slowest = (slowest.0.max(close?), slowest.1.max(open?));
    }
    let (close, open) = times(&valve, valve.supply_psig);
    let (close_s, open_s) = (close?, open?);
    // Strokes of 60 s are long enough.
    if slowest.0.max(slowest.1) > 150.0 {
        return None;
    }
    let nice = |t: f64| {
        let unit = 10.0_f64.powf(t.log10().floor() - 1.0);
        (t / unit).ceil() * unit
    };
    valve.open_at_s = nice(2.0 * slowest.0);
    valve.cycle_end_s = valve.open_at_s + nice(1.8 * slowest.1);
    Some(Subject {
        class,
        valve: valve.rounded(),
        pressures_psig,
        close_s,
        open_s,
        slow_close_s: slowest.0,
        slow_open_s: slowest.1,
    })
}
