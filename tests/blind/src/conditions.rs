//! The valve a user believes to have, and the conditions it is recorded under.

use rand::RngExt;
use rand::rngs::StdRng;

use crate::effects::log_uniform;
use crate::hidden::Hidden;
use crate::record::stroke_times;
use crate::rig::Conditions;
use crate::valve::{Orientation, PSI_PA, Valve};

/// Conditions of a campaign's strokes and the length of its traces.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    pub conditions: Vec<Conditions>,
    pub end_s: f64,
}

/// Supply pressures a valve is recorded at.
struct Range {
    low_psig: f64,
    step_psig: f64,
}

/// The testbed valve, or one drawn for a usual closing time between 0.4 and 3 s, with its plan and
/// that time; none where the drawn numbers make no valve that strokes.
pub(crate) fn believed_valve(
    testbed: bool,
    timings_only: bool,
    repeats: bool,
    rng: &mut StdRng,
) -> Option<(Valve, Plan, f64)> {
    let (valve, range) =
        if testbed { (Valve::testbed(), Range { low_psig: 55.0, step_psig: 10.0 }) } else { drawn_valve(rng)? };
    let at = |psig: f64| Conditions { supply_psig: psig, leak_to_atmosphere_m2: 0.0, leak_from_supply_m2: 0.0 };
    let nothing = Hidden::default();
    let (close, _) = stroke_times(&valve, &nothing, &at(valve.supply_psig), 1);
    // Traces of the testbed valve end after 9 s, of others with the cycle.
    let end_s = if testbed { 9.0 } else { valve.cycle_end_s };
    let conditions =
        if timings_only { timing_conditions(&valve, &range) } else { trace_conditions(&valve, &range, repeats) };
    Some((valve, Plan { conditions, end_s }, close?))
}

/// Areas of the leaks opened on purpose, to the atmosphere and from the supply: 0.15 and 0.05 mm2
/// on the testbed valve.
fn opened_leaks(valve: &Valve) -> (f64, f64) {
    let round = |area: f64| (area * 1e9).round() / 1e9;
    (round(0.3 * valve.solenoid_area_m2), round(0.1 * valve.solenoid_area_m2))
}

/// Five pressures and one stroke with each leak; or three pressures thrice and each leak twice.
fn trace_conditions(valve: &Valve, range: &Range, repeats: bool) -> Vec<Conditions> {
    let (out, into) = opened_leaks(valve);
    let (steps, each, leaked): (&[f64], usize, usize) =
        if repeats { (&[0.0, 2.0, 4.0], 3, 2) } else { (&[0.0, 1.0, 2.0, 3.0, 4.0], 1, 1) };
    let mut list = Vec::new();
    let mut add = |psig: f64, out: f64, into: f64, count: usize| {
        for _ in 0..count {
            list.push(Conditions { supply_psig: psig, leak_to_atmosphere_m2: out, leak_from_supply_m2: into });
        }
    };
    for step in steps {
        add(range.low_psig + step * range.step_psig, 0.0, 0.0, each);
    }
    add(valve.supply_psig, out, 0.0, leaked);
    add(valve.supply_psig, 0.0, into, leaked);
    list
}

/// Seven pressures four times, and three sizes of each leak thrice.
fn timing_conditions(valve: &Valve, range: &Range) -> Vec<Conditions> {
    let (out, into) = opened_leaks(valve);
    let mut list = Vec::new();
    let mut add = |psig: f64, out: f64, into: f64, count: usize| {
        for _ in 0..count {
            list.push(Conditions { supply_psig: psig, leak_to_atmosphere_m2: out, leak_from_supply_m2: into });
        }
    };
    for step in 0..7 {
        let psig = range.low_psig + f64::from(step) * range.step_psig * 4.0 / 6.0;
        add((10.0 * psig).round() / 10.0, 0.0, 0.0, 4);
    }
    for part in [0.6, 1.2, 1.8] {
        add(valve.supply_psig, (part * out * 1e9).round() / 1e9, 0.0, 3);
    }
    for part in [0.6, 1.2, 1.8] {
        add(valve.supply_psig, 0.0, (part * into * 1e9).round() / 1e9, 3);
    }
    list
}

/// A valve unlike the testbed's: the pressures at which its spring starts and ends to give way, its
/// stroke, piston, volumes and orifices are drawn, and the orifices are sized for a closing time.
fn drawn_valve(rng: &mut StdRng) -> Option<(Valve, Range)> {
    let target_s = log_uniform(rng, 0.4, 3.0);
    let stroke_m = log_uniform(rng, 12e-3, 45e-3);
    let piston_area_m2 = log_uniform(rng, 15e-4, 80e-4);
    let start_pa = rng.random_range(110e3..220e3);
    let end_pa = start_pa * rng.random_range(1.35..1.9);
    let swept_m3 = piston_area_m2 * stroke_m;
    let spring_n_per_m = (end_pa - start_pa) * piston_area_m2 / stroke_m;
    let preload_n = start_pa * piston_area_m2;
    let low_psig = (end_pa * rng.random_range(1.17..1.3) / PSI_PA / 5.0).ceil() * 5.0;
    let step_psig = [7.5, 10.0][rng.random_range(0..2)];
    // As on the testbed, viscous friction at the usual speed is some hundredths of the preload.
    let viscous_ns_per_m = rng.random_range(0.02..0.08) * preload_n * 0.4 * target_s / stroke_m;
    let orientation =
        [Orientation::Upright, Orientation::Inverted, Orientation::Horizontal][[0, 0, 1, 2][rng.random_range(0..4)]];
    let mut valve = Valve {
        mass_kg: 1.5 * (piston_area_m2 / 31e-4) * rng.random_range(0.6..1.6),
        stroke_m,
        piston_area_m2,
        dead_volume_m3: swept_m3 * rng.random_range(0.15..0.6),
        viscous_ns_per_m,
        spring_n_per_m,
        preload_m: preload_n / spring_n_per_m,
        contact_n_per_m: preload_n / rng.random_range(0.4e-3..0.8e-3),
        supply_psig: low_psig + 2.0 * step_psig,
        pipe_volume_m3: swept_m3 * rng.random_range(0.25..1.0),
        solenoid_area_m2: 0.5e-6 * (swept_m3 / 79e-6) / target_s,
        port_area_m2: 0.0,
        orientation,
        open_at_s: 8.0 * target_s,
        cycle_end_s: 24.0 * target_s,
    };
    let port_ratio = log_uniform(rng, 3.0, 10.0);
    let nothing = Hidden::default();
    let times = |valve: &Valve, psig: f64| {
        let set = Conditions { supply_psig: psig, leak_to_atmosphere_m2: 0.0, leak_from_supply_m2: 0.0 };
        stroke_times(valve, &nothing, &set, 1)
    };
    for _ in 0..2 {
        valve.port_area_m2 = port_ratio * valve.solenoid_area_m2;
        let close_s = times(&valve, valve.supply_psig).0?;
        valve.solenoid_area_m2 *= close_s / target_s;
    }
    valve.port_area_m2 = port_ratio * valve.solenoid_area_m2;
    let (slow_close_s, _) = times(&valve, low_psig);
    let (_, slow_open_s) = times(&valve, low_psig + 4.0 * step_psig);
    let half_seconds = |t: f64| (2.0 * t).ceil() / 2.0;
    valve.open_at_s = half_seconds(2.0 * slow_close_s?);
    valve.cycle_end_s = valve.open_at_s + half_seconds(1.8 * slow_open_s?);
    Some((valve.rounded(), Range { low_psig, step_psig }))
}
