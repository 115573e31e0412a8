//! Which files are recorded: their conditions, what is commanded in them and when they begin and end.

use rand::RngExt;
use rand::rngs::StdRng;

use crate::rig::Conditions;
use crate::spool::Edge;
use crate::world::play::at;
use crate::world::realism::{Realisms, World};
use crate::world::valves::{Class, Subject};

/// One file to be recorded; times count from its first row.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sheet {
    pub conditions: Conditions,
    /// Commands, the ones before the first row included.
    pub commanded: Vec<Edge>,
    pub end_s: f64,
}

/// Rows over a closing stroke where the logger is not slow.
const USUAL_ROWS: f64 = 800.0;

/// Time between rows: one of 1, 2, 5, 10 ... ms, for about as many rows over a stroke.
pub(crate) fn interval_s(realisms: &Realisms, subject: &Subject) -> f64 {
    let rows = if realisms.has("slow-logger") { realisms.size("slow-logger") } else { USUAL_ROWS };
    let wanted_ms = (subject.close_s.min(subject.open_s) / rows * 1e3).max(1.0);
    let decade = 10.0_f64.powf(wanted_ms.log10().floor());
    let step = [5.0, 2.0, 1.0].into_iter().find(|step| step * decade <= wanted_ms).unwrap_or(1.0);
    step * decade * 1e-3
}

/// The conditions a campaign is recorded under, one a file, and whether some come more than once.
pub(crate) fn conditions(world: World, subject: &Subject, rng: &mut StdRng) -> (Vec<Conditions>, bool) {
    let all = &subject.pressures_psig;
    let usual = at(subject.valve.supply_psig);
    let alone = if subject.class == Class::Springless { 0.6 } else { [0.1, 0.3][usize::from(world == World::Plant)] };
    if rng.random_bool(alone) {
        return (vec![usual; rng.random_range(3..=6)], true);
    }
    let mut list: Vec<Conditions> = all.iter().map(|psig| at(*psig)).collect();
    while list.len() > 3 && rng.random_bool(0.3) {
        list.remove(rng.random_range(0..list.len()));
    }
    if subject.class != Class::Springless && rng.random_bool([0.6, 0.2][usize::from(world == World::Plant)]) {
        let round = |area: f64| (area * 1e10).round() / 1e10;
        let leak = round(0.3 * subject.valve.solenoid_area_m2);
        list.push(Conditions { leak_to_atmosphere_m2: leak, ..usual.clone() });
        if rng.random_bool(0.5) {
            list.push(Conditions { leak_from_supply_m2: round(0.3 * leak), ..usual });
        }
    }
    let repeats = rng.random_bool(0.3);
    if repeats {
        let times = rng.random_range(2..=3);
        list = list.iter().flat_map(|set| std::iter::repeat_n(set.clone(), times)).collect();
    }
    (list, repeats)
}

/// The files of a campaign.
pub(crate) fn sheets(
    realisms: &Realisms,
    subject: &Subject,
    conditions: &[Conditions],
    rng: &mut StdRng,
) -> Vec<Sheet> {
    let mut list: Vec<Sheet> = conditions
        .iter()
        .map(|set| {
            let (commanded, end_s) = if subject.class == Class::Springless {
                falling(subject, rng)
            } else {
                timeline(realisms, subject, rng)
            };
            Sheet { conditions: set.clone(), commanded, end_s }
        })
        .collect();
    if realisms.has("many-cycles") {
        // Each file holds many strokes; a few files are enough.
        list.truncate(rng.random_range(1..=3));
    }
    list
}

fn timeline(realisms: &Realisms, subject: &Subject, rng: &mut StdRng) -> (Vec<Edge>, f64) {
    let (close_s, open_s) = (subject.close_s, subject.open_s);
    let hold_s = 1.5 * subject.slow_close_s;
    let rest_s = 1.5 * subject.slow_open_s;
    let mut edges = Vec::new();
    let mut push = |at_s: f64, close: bool| edges.push(Edge { at_s, close });
    let first = if realisms.has("begins-filling") {
        -close_s * rng.random_range(0.05..0.45)
    } else if realisms.has("begins-moving") {
        -close_s * rng.random_range(0.5..0.95)
    } else if realisms.has("begins-before-rest") {
        // A stroke before this one is not over yet.
        let opened = -open_s * rng.random_range(0.3..0.9);
        push(opened - hold_s, true);
        push(opened, false);
        open_s * rng.random_range(0.2..0.8)
    } else if rng.random_bool(0.2) {
        0.0
    } else {
        close_s * rng.random_range(0.05..0.5)
    };
    let cycles = if realisms.has("many-cycles") { rng.random_range(4..=9) } else { 1 };
    let mut now = first;
    for cycle in 0..cycles {
        push(now, true);
        let held = now + hold_s * rng.random_range(1.0..1.2);
        push(held, false);
        now = held + rest_s * rng.random_range(1.0..1.2);
        if cycle + 1 == cycles && rng.random_bool(0.15) {
            // The logger was stopped before the valve was at rest.
            now = held + open_s * rng.random_range(0.6..0.95);
        }
    }
    (edges, now)
}

/// Cycles of a cylinder that falls and is lifted again, mostly before it reaches a stop; the file begins while it falls.
fn falling(subject: &Subject, rng: &mut StdRng) -> (Vec<Edge>, f64) {
    let full = rng.random_bool(0.4);
    let mut part = |time_s: f64| {
        if full { time_s * rng.random_range(1.2..1.5) } else { time_s * rng.random_range(0.6..1.1) }
    };
    let fall_s = part(subject.open_s);
    let mut now = -0.4 * fall_s;
    let mut edges =
        vec![Edge { at_s: now - 1.5 * subject.slow_close_s, close: true }, Edge { at_s: now, close: false }];
    now += fall_s;
    for _ in 0..3 {
        edges.push(Edge { at_s: now, close: true });
        now += part(subject.close_s);
        edges.push(Edge { at_s: now, close: false });
        now += part(subject.open_s);
    }
    (edges, now)
}
