//! How closely each record is simulated on the way of a search, and for what decides.
//!
//! Steps of different length are tried at the values of the valve file, and held against much shorter ones. What they are off by
//! counts in nats, as if it were an effect's doing: it grows with the eighth power of the step, so that neighbouring lengths
//! stand a fourth of an octave apart.

use valve_model::Fidelity;

use super::setup::{Kind, Setup};

/// Longest steps, in usual ones: from that on the way, from that where it decides, and what they are held against.
const ON_THE_WAY: f64 = 2.0;
const WHERE_DECIDED: f64 = std::f64::consts::SQRT_2;
const EXACT: f64 = 0.125;

/// Shortest steps on the way and where it decides, in usual ones.
const LEAST_ON_THE_WAY: f64 = 1.0;
const LEAST_WHERE_DECIDED: f64 = 0.25;

/// Lengths to an octave.
const TO_AN_OCTAVE: i32 = 4;

/// Substeps at most, on the way and where it decides.
const SUBSTEPS: [u32; 2] = [2, 4];

/// What a simulation may be off by on the way, where an optimum must only be close: in standard deviations of the rows (root mean
/// square).
const OFF_ON_THE_WAY: f64 = 0.5;

/// What the simulations of what decides may be off by in all, nats. Errors of so many nats move no value by more than a third of its
/// standard deviation, along directions that data hardly pin as well.
const OFF_WHERE_DECIDED: f64 = 0.05;

/// How many octaves finer a fit may go on that has ended before it was done.
const FINER: i32 = 2;

/// Steps that one may span on a stop on the way, where that costs little; the last one that does counts. For what decides none
/// are: where a piston begins to rest jumps from block to block with every parameter, and differences of these jumps look like
/// knowledge of directions that nothing else pins.
const SPANS: [u32; 3] = [2, 4, 8];

/// What spans may cost in all on the way, nats.
const SPANS_MAY_COST: f64 = 5.0;

/// A campaign as closely simulated as is wanted.
#[derive(Debug)]
pub struct Simulated {
    /// On the way.
    pub low: Setup,
    /// As finely as what decides asks for, then finer and finer.
    pub high: Vec<Setup>,
}

/// The way in which a step is shortened: its length in usual ones, and the most substeps.
type Rung = (f64, u32);

/// The rungs from a longest to a shortest step.
fn ladder(longest: f64, shortest: f64, substeps: u32) -> Vec<Rung> {
    let lengths = (0..).map(|index| longest * 2.0_f64.powf(-f64::from(index) / f64::from(TO_AN_OCTAVE)));
    lengths.take_while(|length| *length > 0.999 * shortest).map(|length| (length, substeps)).collect()
}

/// A record's fidelity on a rung, from its usual one.
fn on_rung(usual: Fidelity, (length, substeps): Rung) -> Fidelity {
    Fidelity {
        most_inert_kg: usual.most_inert_kg,
        ..Fidelity::with_step(length * usual.step_s).with_most_substeps(substeps).with_every_step()
    }
}

/// A campaign simulated roughly, before it is known how roughly it may be.
pub fn roughly(setup: &Setup) -> Setup {
    at(setup, &|recording| on_rung(setup.recordings[recording].fidelity, (ON_THE_WAY, SUBSTEPS[0])))
}

/// The same campaign with other fidelities.
fn at(setup: &Setup, fidelity: &dyn Fn(usize) -> Fidelity) -> Setup {
    let mut setup = setup.clone();
    for (index, recording) in setup.recordings.iter_mut().enumerate() {
        recording.fidelity = fidelity(index);
    }
    setup
}

/// How closely to simulate each record of a campaign, whose usual fidelities are given, by what its recorder can see of the difference;
/// what is cut short all the same counts as noise. `predict` predicts all rows. Nothing where they cannot be predicted.
pub fn chosen(
    setup: &Setup,
    usual: &[Fidelity],
    predict: &dyn Fn(&Setup) -> Option<Vec<Vec<f64>>>,
) -> Option<Simulated> {
    let exact = predict(&at(setup, &|recording| on_rung(usual[recording], (EXACT, SUBSTEPS[1]))))?;
    let errors_of = |setup: &Setup| Some(differences(&predict(setup)?, &exact));
    let recordings = 0..usual.len();
    // Stroke times are all simulated alike.
    let alike = |recording: usize| -> Vec<usize> {
        let is_timed = |recording: usize| matches!(setup.recordings[recording].kind, Kind::Times(_));
        let is_alike = |other: &usize| *other == recording || is_timed(*other) && is_timed(recording);
        recordings.clone().filter(is_alike).collect()
    };
    // For each record the longest step that is off by no more than so many nats.
    let longest = |ladder: Vec<Rung>, most_nats: &dyn Fn(&[usize]) -> f64| -> Option<Vec<Option<Rung>>> {
        let mut found: Vec<Option<Rung>> = vec![None; usual.len()];
        for rung in ladder {
            if found.iter().all(Option::is_some) {
                break;
            }
            let errors = errors_of(&at(setup, &|recording| on_rung(usual[recording], rung)))?;
            for (recording, found) in found.iter_mut().enumerate().filter(|(_, found)| found.is_none()) {
                let alike = alike(recording);
                *found = (nats(setup, &alike, &errors) <= most_nats(&alike)).then_some(rung);
            }
        }
        Some(found)
    };
    let rows = |records: &[usize]| records.iter().map(|record| setup.records[*record].row_count()).sum::<usize>();
    let on_the_way = ladder(ON_THE_WAY, LEAST_ON_THE_WAY, SUBSTEPS[0]);
    let low = longest(on_the_way, &|alike| 0.5 * OFF_ON_THE_WAY * OFF_ON_THE_WAY * rows(alike) as f64)?;
    let where_decided = ladder(WHERE_DECIDED, LEAST_WHERE_DECIDED, SUBSTEPS[1]);
    let high = longest(where_decided, &|alike| OFF_WHERE_DECIDED * alike.len() as f64 / usual.len() as f64)?;
    let mut low = at(setup, &|recording| on_rung(usual[recording], low[recording].unwrap_or((1.0, SUBSTEPS[1]))));
    choose_spans(&mut low, SPANS_MAY_COST, predict);
    let decided = |finer: i32| {
        at(setup, &|recording| {
            let (length, substeps) = high[recording].unwrap_or((LEAST_WHERE_DECIDED, SUBSTEPS[1]));
            on_rung(usual[recording], ((length * 0.5_f64.powi(finer)).max(EXACT), substeps))
        })
    };
    let mut high: Vec<Setup> = (0..=FINER).map(decided).collect();
    if let Some(errors) = errors_of(&low) {
        low.add_noise(&errors);
    }
    // What is cut short stays with the rows of the finer ones, so that all of these have the same.
    if let Some(errors) = errors_of(&high[0]) {
        for setup in &mut high {
            setup.add_noise(&errors);
        }
    }
    Some(Simulated { low, high })
}

/// What errors by record and row cost over some records, nats.
fn nats(setup: &Setup, records: &[usize], errors: &[Vec<f64>]) -> f64 {
    let rows = records.iter().flat_map(|record| setup.records[*record].rows().zip(&errors[*record]));
    0.5 * rows.map(|(row, error)| (error / row.sigma).powi(2)).sum::<f64>()
}

/// What some predictions differ by from others, by record and row.
fn differences(one: &[Vec<f64>], other: &[Vec<f64>]) -> Vec<Vec<f64>> {
    one.iter().zip(other).map(|(one, other)| one.iter().zip(other).map(|(one, other)| one - other).collect()).collect()
}

/// Lets steps on a stop span several in each record, as many as cost no more than its share of so many nats against every step taken. Stroke
/// times are all simulated alike.
fn choose_spans(setup: &mut Setup, most_nats: f64, predict: &dyn Fn(&Setup) -> Option<Vec<Vec<f64>>>) {
    let count = setup.recordings.len();
    let Some(every) = predict(setup) else { return };
    let mut chosen = vec![1; count];
    for span in SPANS {
        let spanned = at(setup, &|recording| Fidelity { most_span: span, ..setup.recordings[recording].fidelity });
        let Some(predicted) = predict(&spanned) else { continue };
        let errors = differences(&predicted, &every);
        let is_cheap = |recording: usize| nats(setup, &[recording], &errors) <= most_nats / count as f64;
        let is_timed = |recording: usize| matches!(setup.recordings[recording].kind, Kind::Times(_));
        let are_timed_cheap = (0..count).filter(|recording| is_timed(*recording)).all(is_cheap);
        for (recording, chosen) in chosen.iter_mut().enumerate() {
            if if is_timed(recording) { are_timed_cheap } else { is_cheap(recording) } {
                *chosen = span;
            }
        }
    }
    for (recording, span) in setup.recordings.iter_mut().zip(chosen) {
        recording.fidelity.most_span = span;
    }
}
