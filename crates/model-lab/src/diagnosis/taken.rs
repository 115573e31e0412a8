//! How much of an error each kind of instrument and condition takes.
//!
//! A zero, a gain and a clock may each be unsure while what they do together is sure: strokes tell the sum.

use identify::problem::predict_all;
use identify::select::Model;

use crate::errors::Errors;
use crate::identification::{Nuisance, ValveProblem};

/// Kinds of instruments and conditions that are told together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TakenBy {
    /// Zero, gain, drift and curve of the position sensor.
    PositionSensor,
    /// Clock of the recorder and delays of commands.
    Clock,
    /// Supply, temperature, load and opened leaks of the runs.
    Conditions,
    /// How records begin.
    Start,
    /// Pressure sensors: those beside the position, and one that drives the model.
    PressureSensors,
    /// Piston area and damping of the stops.
    Valve,
}

impl TakenBy {
    const ALL: [Self; 6] =
        [Self::PositionSensor, Self::Clock, Self::Conditions, Self::Start, Self::PressureSensors, Self::Valve];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::PositionSensor => "the position sensor",
            Self::Clock => "the clock and delays of commands",
            Self::Conditions => "the supply, temperature and load of the runs",
            Self::Start => "how records begin",
            Self::PressureSensors => "the pressure sensors",
            Self::Valve => "the piston area and the damping of the stops",
        }
    }

    fn of(nuisance: Nuisance) -> Self {
        match nuisance {
            Nuisance::Zero(_) | Nuisance::Drift(_) | Nuisance::Gain | Nuisance::Linearity(_) => Self::PositionSensor,
            Nuisance::Clock | Nuisance::CloseDelay(_) | Nuisance::OpenDelay(_) | Nuisance::UnseenEdge(_) => Self::Clock,
            Nuisance::Supply(_)
            | Nuisance::Load(_)
            | Nuisance::Temperature(_)
            | Nuisance::Gauge
            | Nuisance::LeakToAtmosphere
            | Nuisance::LeakFromSupply => Self::Conditions,
            Nuisance::StartPressure(_) | Nuisance::StartPosition(_) | Nuisance::StartSpeed(_) => Self::Start,
            Nuisance::PressureZero(_) | Nuisance::PressureGain(_) | Nuisance::DrivingZero | Nuisance::DrivingGain => {
                Self::PressureSensors
            }
            Nuisance::Bore | Nuisance::StopDamping => Self::Valve,
        }
    }
}

/// What each kind takes of the error of a model at its fit, against instruments and conditions at their word, as errors of their
/// own, the largest first; only what is larger than the noise. They need not add up: what two take may cancel.
pub fn taken(model: &Model<ValveProblem<'_>>) -> Vec<(TakenBy, Errors)> {
    let (problem, fit) = (&model.problem, &model.fit);
    let word = problem.at_their_word();
    let first = problem.space.coordinates.len();
    let of_kind = |kind: TakenBy| {
        let mut u = fit.u.clone();
        for (place, entry) in problem.nuisances.iter().enumerate() {
            if TakenBy::of(entry.nuisance) == kind {
                u[first + place] = word[first + place];
            }
        }
        let [with, without] = [&fit.u, &u].map(|u| predict_all(problem, std::slice::from_ref(u)).pop());
        let (with, without) = (with??, without??);
        let off: Vec<Vec<f64>> = with
            .iter()
            .zip(&without)
            .map(|(with, without)| with.iter().zip(without).map(|(with, without)| with - without).collect())
            .collect();
        Some((kind, Errors::of(problem, &off)))
    };
    let mut all: Vec<(TakenBy, Errors)> =
        TakenBy::ALL.into_iter().filter_map(of_kind).filter(|(_, errors)| errors.normalised_rms >= 1.0).collect();
    all.sort_by(|a, b| b.1.normalised_rms.total_cmp(&a.1.normalised_rms));
    all
}
