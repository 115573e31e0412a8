//! The answer of a diagnosis.

use valve_file::FoundValue;
use valve_model::{EffectKind, ParameterId, Valve};

use super::discrepancy::ModelDiscrepancy;
use super::experiment::Experiment;
use crate::errors::{Errors, StepReport};
use crate::identification::Known;

/// The verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing is missing beyond noise, tolerances and what instruments and conditions may be off by.
    Adequate,
    /// Effects of the catalogue explain the data.
    EffectFound,
    /// Effects are needed beyond doubt, and something else is left.
    PartlyExplained,
    /// Something is missing and nothing in the catalogue helps.
    OutsideCatalogue,
    /// The search was cut short, or too many effects could be it.
    NotEnoughData,
}

impl Verdict {
    /// The word in the output.
    pub fn id(self) -> &'static str {
        match self {
            Self::Adequate => "adequate",
            Self::EffectFound => "effect-found",
            Self::PartlyExplained => "partly-explained",
            Self::OutsideCatalogue => "outside-catalogue",
            Self::NotEnoughData => "not-enough-data",
        }
    }
}

/// A condition under which a run is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Condition {
    /// Supply pressure, Pa absolute.
    SupplyPressure,
    /// Temperature, K.
    Temperature,
    /// Area of a leak to atmosphere, m².
    LeakToAtmosphere,
    /// Area of a leak from the supply, m².
    LeakFromSupply,
}

/// A run that contradicts all others.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    /// Its file.
    pub run: String,
    /// What would have to be another for the run to be explained; nothing where no one condition does.
    pub repair: Option<Repair>,
    /// Atmospheric pressure, from which gauge pressures count, Pa.
    pub ambient_pa: f64,
    /// The error that the model of the other runs leaves of this one under what was written down, m.
    pub stated_rmse_m: f64,
    /// The error of the others, held out, m.
    pub others_rmse_m: f64,
}

/// A condition that was written down wrongly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repair {
    /// The condition.
    pub condition: Condition,
    /// Its value as it was written down, SI.
    pub stated: f64,
    /// The value with which the run is explained as well as the others, about, SI.
    pub right: f64,
    /// The leak that was written down in its place, where it is one; it would be none.
    pub in_place_of: Option<(Condition, f64)>,
    /// The error of the run with the right value, m.
    pub right_rmse_m: f64,
}

/// A fitted parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedParameter {
    /// The effect.
    pub effect: EffectKind,
    /// The parameter's key.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Value, SI.
    pub value: f64,
    /// One standard deviation, SI.
    pub sigma: f64,
}

/// A tolerated parameter that was refitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MovedParameter {
    /// Which.
    pub id: ParameterId,
    /// Value in the valve file, SI.
    pub before: f64,
    /// Fitted value, SI.
    pub after: f64,
    /// One standard deviation of it, SI.
    pub sigma: f64,
    /// The interval that holds the true value with a probability of 90 %, SI.
    pub interval_90: (f64, f64),
    /// Its tolerance, one standard deviation as a share of the value.
    pub tolerance: f64,
    /// How far it moved, in tolerances.
    pub pull: f64,
    /// One standard deviation of that: 1 means that the data say nothing about it.
    pub pull_sigma: f64,
    /// Whether it ended at its bound, with errors of nothing: a sign of something missing.
    pub is_at_bound: bool,
}

/// A parameter this many tolerances off is a sign of missing physics, or of a datasheet that is wrong.
const FAR_PULL: f64 = 3.0;

impl MovedParameter {
    /// Whether it is further off than its tolerance lets one expect: a conflict of what is stated with what was recorded.
    pub fn is_far(&self) -> bool {
        self.pull.abs() > FAR_PULL
    }

    /// As the history of a valve file keeps it; nothing at a bound, where how sure it is is not known.
    pub fn found(&self) -> Option<FoundValue> {
        (!self.is_at_bound).then(|| FoundValue {
            effect: None,
            parameter: self.id.key().to_owned(),
            value: self.after,
            standard_error: self.sigma,
            unit: self.id.si_unit().to_owned(),
        })
    }
}

/// What an instrument or a condition was found to be off by.
#[derive(Debug, Clone, PartialEq)]
pub struct NuisanceReport {
    /// What, in words: "zero of the position sensor".
    pub what: &'static str,
    /// The record it belongs to; nothing for what all records share.
    pub record: Option<String>,
    /// Value, SI or a share.
    pub value: f64,
    /// One standard deviation of it.
    pub sigma: f64,
    /// The standard deviation that it was believed to have beforehand.
    pub prior: f64,
    /// SI unit, empty for a share.
    pub unit: &'static str,
    /// Whether it ended at its bound: a sign of something missing.
    pub is_at_bound: bool,
}

/// One candidate.
#[derive(Debug, Clone)]
pub struct CandidateReport {
    /// Its effects.
    pub kinds: Vec<EffectKind>,
    /// Their parameters.
    pub parameters: Vec<FittedParameter>,
    /// Gain of the logarithm of the evidence over the calibrated model, nats.
    pub gain: f64,
    /// Its probability among the models that were fitted to the end; nothing where it was not.
    pub probability: Option<f64>,
    /// What it leaves.
    pub errors: Errors,
    /// What it leaves where it was held out.
    pub held_out: Option<Errors>,
    /// Change of the Bayesian information criterion against the calibrated model, by the whitened residuals.
    pub delta_bic: f64,
    /// Why it was not chosen.
    pub rejected: Option<String>,
}

/// An effect that explains the data as well as a recommended one.
#[derive(Debug, Clone)]
pub struct Alternative {
    /// The effect that could stand in.
    pub kind: EffectKind,
    /// The whole set of effects with it.
    pub kinds: Vec<EffectKind>,
    /// How much less likely it is, nats (more likely where it is negative).
    pub behind: f64,
    /// Its parameters.
    pub parameters: Vec<FittedParameter>,
    /// The valve with it.
    pub valve: Valve,
    /// Valves that the data leave open about it, see [`Hypothesis::spread`](super::experiment::Hypothesis::spread).
    pub spread: Vec<Valve>,
}

/// What cannot be told from a recommended effect, and what would tell.
#[derive(Debug, Clone)]
pub struct Indistinguishable {
    /// The recommended effect.
    pub kind: EffectKind,
    /// The others.
    pub with: Vec<Alternative>,
    /// What would tell it from the closest.
    pub experiment: Option<Experiment>,
}

/// What the last step leaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Remainder {
    /// Size of the model error, as a share of the stroke at full speed.
    pub discrepancy: f64,
    /// Its correlation time, s.
    pub time_s: f64,
    /// How much more likely it makes the records than noise alone, nats.
    pub nats: f64,
    /// Noise multiplier of the position.
    pub multiplier: f64,
}

/// Two runs whose conditions seem to have been written down for one another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exchanged {
    /// Their files.
    pub runs: [String; 2],
    /// What of theirs stands with the other one, in words.
    pub what: &'static str,
}

/// The whole answer.
#[derive(Debug, Clone)]
pub struct Explanation {
    /// The verdict.
    pub verdict: Verdict,
    /// The effects to add, in the order they were found.
    pub recommended: Vec<EffectKind>,
    /// Their parameters.
    pub parameters: Vec<FittedParameter>,
    /// The tolerated parameters, refitted with the effects.
    pub moved: Vec<MovedParameter>,
    /// What instruments and conditions were found to be off by.
    pub nuisances: Vec<NuisanceReport>,
    /// For each recommended effect, what cannot be told from it.
    pub indistinguishable: Vec<Indistinguishable>,
    /// Every candidate tried, best first.
    pub candidates: Vec<CandidateReport>,
    /// The model sequence.
    pub steps: Vec<StepReport>,
    /// Probability that an effect is needed, most likely first.
    pub inclusion: Vec<(EffectKind, f64)>,
    /// What the last step leaves.
    pub remainder: Remainder,
    /// The model discrepancy that nothing in the catalogue explains.
    pub discrepancy: Option<ModelDiscrepancy>,
    /// The valve with the recommended effects, everything refitted.
    pub valve: Valve,
    /// Valves that the data leave open about it, see [`Hypothesis::spread`](super::experiment::Hypothesis::spread).
    pub spread: Vec<Valve>,
    /// One standard deviation of a position's noise, m, as it was found.
    pub noise_m: Option<f64>,
    /// A run that contradicts all others under the conditions that were written down for it; the answer is that of the others.
    pub left_out: Option<LeftOut>,
    /// Two runs whose conditions seem to have been written down for one another; the answer is that with them exchanged.
    pub exchanged: Option<Exchanged>,
    /// Where the search ended.
    pub(super) known: Known,
    /// What else the reader should know.
    pub notes: Vec<String>,
    /// Whether the search was cut short.
    pub interrupted: bool,
}
