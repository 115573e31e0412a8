//! Effects added to a valve file, everything refitted on a campaign.

use campaign::Campaign;
use identify::Stop;
use model_lab::diagnosis::adopt::{Addition, Rung, Sequence, sequence};
use model_lab::diagnosis::{Explanation, MovedParameter};
use model_lab::errors::StepReport;
use model_lab::space::Target;
use serde::Serialize;
use serde_json::Value;
use valve_file::{FoundValue, HistoryEntry, ValveFile, ValveFileError};
use valve_model::{EffectKind, ParameterId};

use crate::explanation::EffectParameterDocument;
use crate::moved::{self, NuisanceDocument, ParameterDocument};
use crate::steps::StepDocument;
use crate::{SCHEMA, explanation, steps, value_of};

/// Name of the formula that a search finds where no effect explains the data.
const UNEXPLAINED: &str = "unexplained";

/// Why effects cannot be added.
#[derive(Debug, thiserror::Error)]
pub enum AdoptionError {
    /// No effect has this name.
    #[error("there is no effect {name:?}")]
    NoSuchEffect {
        /// The name.
        name: String,
        /// One that was perhaps meant.
        nearest: Option<String>,
    },
    /// A formula was asked for, and the search has none.
    #[error("no formula is needed or found: {headline}")]
    NoFormula {
        /// What the search says instead.
        headline: String,
    },
    /// The model cannot be simulated.
    #[error("{file}: its strokes cannot be simulated")]
    NotSimulated {
        /// The valve file.
        file: String,
    },
    /// The fit wants nothing of an effect.
    #[error("{name}: these data want none of it, its {parameter} ended at {value}")]
    NoneOfIt {
        /// The effect.
        name: &'static str,
        /// The parameter that says so.
        parameter: &'static str,
        /// Its value.
        value: f64,
    },
    /// The new valve file does not pass its checks.
    #[error(transparent)]
    File(#[from] ValveFileError),
}

impl AdoptionError {
    /// What to do about it, where the message does not say so.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::NoSuchEffect { nearest: Some(near), .. } => {
                Some(format!("did you mean {near}? `valve effects` lists the catalogue"))
            }
            Self::NoSuchEffect { nearest: None, .. } => {
                Some("`valve effects` lists the catalogue; a custom effect must stand in the valve file".to_owned())
            }
            Self::NoFormula { .. } | Self::NoneOfIt { .. } => {
                Some("`valve explain` tells what was found instead".to_owned())
            }
            Self::NotSimulated { .. } => Some(
                "look at the valve with `valve simulate`, and at the effects' parameters with `valve effects`"
                    .to_owned(),
            ),
            Self::File(_) => None,
        }
    }
}

/// A model with effects added, and how it came to that.
#[derive(Debug, Clone)]
pub struct Adoption {
    /// Ids and names of what was added.
    pub names: Vec<String>,
    /// What was done, in words.
    pub action: String,
    /// The model sequence and the parameters in the end.
    pub sequence: Sequence,
    /// The valve file after each step, by the step's name.
    pub models: Vec<(String, ValveFile)>,
    /// The valve file in the end, with the step in its history.
    pub file: ValveFile,
}

impl Adoption {
    /// Adds effects of the catalogue by their ids, or custom ones of the valve file by their names, and refits
    /// everything.
    pub fn new(file: &ValveFile, campaign: &Campaign, names: &[String]) -> Result<Self, AdoptionError> {
        let (additions, without) = additions(file, names)?;
        let sequence = sequence(&without, campaign, &additions, Stop::never())
            .ok_or_else(|| AdoptionError::NotSimulated { file: file.file_name().to_owned() })?;
        // No file can hold an effect that is infinitely small.
        if let Some(none) = sequence.parameters.iter().find(|parameter| !parameter.value.is_finite()) {
            let (name, parameter) = (none.effect.id(), none.name);
            return Err(AdoptionError::NoneOfIt { name, parameter, value: none.value });
        }
        let mut models = Vec::new();
        for rung in &sequence.rungs {
            models.push((rung.step.step.clone(), adopted(&without, rung)?));
        }
        let names: Vec<String> = additions.iter().map(|addition| addition.name().to_owned()).collect();
        let had = |name: &&String| file.valve().effects().iter().any(|effect| effect.kind().id() == name.as_str());
        let (again, new): (Vec<&String>, Vec<&String>) = names.iter().partition(had);
        let listed = |verb: &str, names: &[&String]| {
            let names = names.iter().map(|name| name.as_str()).collect::<Vec<_>>().join(" and ");
            (!names.is_empty()).then(|| format!("{verb} {names}"))
        };
        let actions: Vec<String> = [listed("added", &new), listed("refitted", &again)].into_iter().flatten().collect();
        let action = if actions.is_empty() { "calibrated".to_owned() } else { actions.join(", ") };
        let [first, .., last] = &sequence.rungs[..] else { unreachable!("it begins with datasheet and calibrated") };
        let [before, after] = [first, last].map(|rung| rung.step.errors.normalised_rms);
        let entry = HistoryEntry::new(&action, &campaign.name, before, after).with_found(found(&sequence));
        let file = adopted(&without, last)?.with_history(entry)?;
        Ok(Self { names, action, sequence, models, file })
    }

    /// The error after each step.
    pub fn steps(&self) -> Vec<StepReport> {
        self.sequence.rungs.iter().map(|rung| rung.step.clone()).collect()
    }

    /// The last step.
    pub fn best(&self) -> &Rung {
        &self.sequence.rungs[self.sequence.rungs.len() - 1]
    }

    /// Whether anything that was added changes how the valve moves, and not only what is recorded of it.
    pub fn changes_valve(&self) -> bool {
        let is_recorded_only =
            |name: &String| EffectKind::from_id(name).is_some_and(|kind| kind.info().acts_on.is_measurement());
        self.names.is_empty() || !self.names.iter().all(is_recorded_only)
    }

    /// For programs.
    pub fn document(&self) -> Value {
        value_of(&AdoptionDocument {
            schema: SCHEMA,
            effects: &self.names,
            steps: steps::documents(&self.steps()),
            parameters: explanation::parameters(&self.sequence.parameters),
            calibrated_parameters: moved::parameters(&self.sequence.moved),
            leaves_much: self.sequence.leaves_much,
            nuisances: moved::nuisances(&self.sequence.nuisances),
        })
    }
}

/// An adoption for programs.
#[derive(Debug, Clone, Serialize)]
struct AdoptionDocument<'a> {
    schema: u32,
    effects: &'a [String],
    steps: Vec<StepDocument>,
    parameters: Vec<EffectParameterDocument>,
    calibrated_parameters: Vec<ParameterDocument>,
    leaves_much: bool,
    nuisances: Vec<NuisanceDocument>,
}

/// Whether the formula of what no effect explains is asked for and not in the valve file yet, so that it has to be searched
/// for.
pub fn needs_formula(file: &ValveFile, names: &[String]) -> bool {
    let has = file.valve().custom().iter().any(|effect| effect.name() == UNEXPLAINED);
    !has && names.iter().any(|name| name == UNEXPLAINED)
}

/// The valve file with the formula that a search found.
pub fn with_formula(file: &ValveFile, answer: &Explanation) -> Result<ValveFile, AdoptionError> {
    let discrepancy = answer.discrepancy.as_ref();
    let discrepancy =
        discrepancy.ok_or_else(|| AdoptionError::NoFormula { headline: crate::explanation::headline(answer) })?;
    Ok(file.with_custom(&discrepancy.effect)?)
}

/// What to add, and the valve file without the custom effects that are to be refitted.
fn additions(file: &ValveFile, names: &[String]) -> Result<(Vec<Addition>, ValveFile), AdoptionError> {
    let mut without = file.clone();
    let mut additions = Vec::new();
    for name in names {
        let own = file.valve().custom().iter().find(|effect| effect.name() == name);
        if let Some(kind) = EffectKind::from_id(name) {
            additions.push(Addition::Catalogue(kind));
        } else if let Some(effect) = own {
            additions.push(Addition::Own(effect.clone()));
            without = without.without_custom(name)?;
        } else {
            let known: Vec<&str> = EffectKind::ALL.iter().map(|kind| kind.id()).collect();
            let nearest = quantity::suggest::nearest(name, known).map(str::to_owned);
            return Err(AdoptionError::NoSuchEffect { name: name.clone(), nearest });
        }
    }
    Ok((additions, without))
}

/// What a sequence found in the end, as a valve file keeps it.
fn found(sequence: &Sequence) -> Vec<FoundValue> {
    let of_effects = sequence.parameters.iter().map(|one| FoundValue {
        effect: Some(one.effect.id().to_owned()),
        parameter: one.name.to_owned(),
        value: one.value,
        standard_error: one.sigma,
        unit: one.unit.to_owned(),
    });
    of_effects.chain(sequence.moved.iter().filter_map(MovedParameter::found)).collect()
}

/// The valve file with everything that a fit moved.
fn adopted(file: &ValveFile, best: &Rung) -> Result<ValveFile, ValveFileError> {
    let base = best.space.base_at(&best.u);
    let moved: Vec<(ParameterId, f64)> = best
        .space
        .coordinates
        .iter()
        .filter_map(|coordinate| match coordinate.target {
            Target::Base(id) => Some((id, base.get(id))),
            _ => None,
        })
        .chain(best.beside.iter().copied())
        .collect();
    let mut new = file.with_parameters(&moved)?;
    for effect in best.space.effects_at(&best.u) {
        new = new.with_effect(&effect)?;
    }
    for effect in best.space.custom_at(&best.u) {
        new = new.with_custom(&effect)?;
    }
    Ok(new)
}
