//! Two runs whose conditions were written down for one another.
//!
//! Without either of them the other one is still wrong, so that no search without one run finds this. What the model as its file
//! states it makes of every run under the conditions of every other one costs a few simulations; the pair that is told apart
//! by it is then searched once more the other way round.

use campaign::{Campaign, RunConditions};
use identify::problem::predict_all;
use identify::select::Level;
use identify::{Problem, Stop};

use super::answer::Exchanged;
use crate::data::conditions;
use crate::identification::{Subject, ValveProblem};

/// The error of both runs must fall to less than this share of what it is as written down: of less the values of the valve file, which
/// may be off, make as much.
const FALLS_TO: f64 = 0.67;

/// Sets of conditions that are tried at most.
const MOST_TRIED: usize = 40;

/// What two runs may have of one another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Part {
    /// All that was written down.
    Conditions,
    /// The supply pressure.
    Supply,
    /// The leaks that were opened on purpose.
    Leaks,
}

impl Part {
    const ALL: [Self; 3] = [Self::Conditions, Self::Supply, Self::Leaks];

    /// The conditions of one run with this part of another one's.
    fn mixed(self, own: RunConditions, other: RunConditions) -> RunConditions {
        match self {
            Self::Conditions => other,
            Self::Supply => RunConditions { supply_pressure_pa: other.supply_pressure_pa, ..own },
            Self::Leaks => {
                RunConditions { supply_pressure_pa: own.supply_pressure_pa, temperature_k: own.temperature_k, ..other }
            }
        }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Conditions => "conditions",
            Self::Supply => "supply pressures",
            Self::Leaks => "leaks",
        }
    }
}

/// Two runs, by index, and what of theirs stands with the other one.
pub(super) type Exchange = (usize, usize, Part);

/// Two runs that both lie nearer to what the valve file says with something of each other's conditions; of several pairs the one that
/// gains the most. Nothing where a supply was recorded, or drives the model: that is known then.
pub(super) fn exchanged(subject: &Subject, campaign: &Campaign, stop: &Stop) -> Option<Exchange> {
    let stated: Vec<RunConditions> = campaign.runs.iter().map(|run| run.conditions).collect();
    let is_recorded = campaign.runs.iter().any(|run| run.trace.supply_pressure_pa.is_some());
    if is_recorded || subject.setup(Level::High).is_prescribed {
        return None;
    }
    let pairs = (0..stated.len()).flat_map(|one| (one + 1..stated.len()).map(move |other| (one, other)));
    let exchanges = pairs.flat_map(|(one, other)| Part::ALL.map(|part| (one, other, part)));
    let exchanges: Vec<Exchange> =
        exchanges.filter(|(one, other, part)| part.mixed(stated[*one], stated[*other]) != stated[*one]).collect();
    let mut tried: Vec<RunConditions> = Vec::new();
    let other_ways = exchanges.iter().flat_map(|(one, other, part)| {
        [part.mixed(stated[*one], stated[*other]), part.mixed(stated[*other], stated[*one])]
    });
    for given in stated.iter().copied().chain(other_ways) {
        if !tried.contains(&given) {
            tried.push(given);
        }
    }
    if tried.len() > MOST_TRIED {
        return None;
    }
    let errors: Vec<Vec<f64>> =
        tried.iter().map(|given| errors_under(subject, stated.len(), given, stop)).collect::<Option<_>>()?;
    let error = |run: usize, given: RunConditions| {
        tried.iter().position(|one| *one == given).map_or(f64::INFINITY, |place| errors[place][run])
    };
    let gain = |exchange: &Exchange| -> Option<f64> {
        let (one, other, part) = *exchange;
        let of = |run: usize, from: usize| {
            let (now, then) = (error(run, stated[run]), error(run, part.mixed(stated[run], stated[from])));
            (then < FALLS_TO * FALLS_TO * now).then_some(now - then)
        };
        Some(of(one, other)? + of(other, one)?)
    };
    let gains = exchanges.iter().filter_map(|exchange| Some((gain(exchange)?, *exchange)));
    gains.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, exchange)| exchange)
}

/// Mean squared error of each run as if all had been made under the same conditions, by the valve file, in units of the rows' activity.
fn errors_under(subject: &Subject, runs: usize, given: &RunConditions, stop: &Stop) -> Option<Vec<f64>> {
    let mut setup = subject.setup(Level::High).clone();
    for recording in setup.recordings.iter_mut().filter(|recording| recording.is_trace()) {
        recording.run.conditions = conditions(given);
    }
    let problem = ValveProblem::new(&setup, subject.space.clone(), subject.nuisances(), stop);
    let predicted = predict_all(&problem, &[problem.at_their_word()]).pop().flatten()?;
    let mut sums = vec![(0.0, 0usize); runs];
    let of_traces = setup.recordings.iter().zip(problem.records().iter().zip(&predicted));
    for (recording, (record, predicted)) in of_traces.filter(|(recording, _)| recording.is_trace()) {
        let (sum, rows) = &mut sums[recording.source];
        *sum += record.error_in_activity(predicted);
        *rows += record.row_count();
    }
    Some(sums.into_iter().map(|(sum, rows)| sum / rows.max(1) as f64).collect())
}

/// A campaign with what two of its runs have of one another exchanged.
pub(super) fn the_other_way_round(campaign: &Campaign, (one, other, part): Exchange) -> Campaign {
    let mut exchanged = campaign.clone();
    let [of_one, of_other] = [one, other].map(|run| campaign.runs[run].conditions);
    exchanged.runs[one].conditions = part.mixed(of_one, of_other);
    exchanged.runs[other].conditions = part.mixed(of_other, of_one);
    exchanged
}

/// What is told of a pair with which everything is explained as soon as it is exchanged.
pub(super) fn told(campaign: &Campaign, (one, other, part): Exchange) -> Exchanged {
    Exchanged { runs: [one, other].map(|run| campaign.runs[run].file.clone()), what: part.words() }
}
