//! Effects that the user chose: everything refitted with them, one after the other.

use campaign::Campaign;
use identify::held_out::{OwnFits, folds, held_out};
use identify::select::{Family, Level, Model, SelectOptions, afresh};
use identify::{Fit, FitOptions, Stop, fit};
use rayon::prelude::*;
use valve_file::ValveFile;
use valve_model::custom::CustomEffect;
use valve_model::{EffectKind, ParameterId};

use super::answer::{FittedParameter, MovedParameter, NuisanceReport};
use super::report::nuisance_reports;
use super::uncertainty::{Certainty, effect_parameters, found_beside, moved_parameters};
use crate::errors::{self, CALIBRATED, StepReport};
use crate::identification::{Catalogue, NuisanceSizes, Subject, ValveProblem};
use crate::space::Space;

/// Something to add.
#[derive(Debug, Clone)]
pub enum Addition {
    /// An effect of the catalogue.
    Catalogue(EffectKind),
    /// An effect of the user's own.
    Own(CustomEffect),
}

impl Addition {
    /// Its id or name.
    pub fn name(&self) -> &str {
        match self {
            Self::Catalogue(kind) => kind.id(),
            Self::Own(effect) => effect.name(),
        }
    }
}

/// One step of the model sequence with what was fitted in it.
#[derive(Debug, Clone)]
pub struct Rung {
    /// Its errors.
    pub step: StepReport,
    /// The parameters and effects.
    pub space: Space,
    /// Their coordinates.
    pub u: Vec<f64>,
    /// Parameters that have no tolerance and were found to be others than in the valve file, SI.
    pub beside: Vec<(ParameterId, f64)>,
}

/// The model sequence: the datasheet's values, calibrated, then with one effect after the other.
#[derive(Debug, Clone)]
pub struct Sequence {
    /// Its steps.
    pub rungs: Vec<Rung>,
    /// The parameters of the catalogue's effects in the last step.
    pub parameters: Vec<FittedParameter>,
    /// The valve file's own parameters in it, those among them that have no tolerance and were found to be others.
    pub moved: Vec<MovedParameter>,
    /// What instruments and conditions were found to be off by in it.
    pub nuisances: Vec<NuisanceReport>,
    /// Whether it leaves more than instruments and small laws explain: something else is missing.
    pub leaves_much: bool,
}

/// Refits a valve file's model on a campaign with effects added one after the other; nothing where its strokes cannot
/// be simulated, or where somebody asked to stop.
pub fn sequence(file: &ValveFile, campaign: &Campaign, additions: &[Addition], stop: &Stop) -> Option<Sequence> {
    let subject = Subject::new(file, campaign, &NuisanceSizes::default(), stop);
    let quiet = |_: identify::select::News<'_>| ();
    let catalogue = Catalogue::new(&subject, EffectKind::ALL, &quiet, stop);
    let options = FitOptions::new(subject.setup(Level::High).groups.clone());
    let mut space = subject.space.clone();
    let base = subject.problem(space.clone(), Level::High, stop);
    let start = base.at_their_word();
    let datasheet = StepReport::as_stated(&subject, errors::at(&base, &start)?);
    let u = start[..space.coordinates.len()].to_vec();
    let mut rungs = vec![Rung { step: datasheet, space: space.clone(), u, beside: Vec::new() }];
    let mut model = subject.calibrated(stop)?;
    rungs.push(rung(CALIBRATED, &model));
    let calibrated = model.clone();
    let mut plain = space.clone();
    for addition in additions {
        // On the way without refinements, as in a search.
        (plain, space) = match addition {
            Addition::Catalogue(kind) => (plain.with_effect(*kind), space.with_refined_effect(*kind)),
            Addition::Own(effect) => (plain.with_custom(effect), space.with_custom(effect)),
        };
        let low = subject.problem(plain.clone(), Level::Low, stop);
        let mut starts = vec![low.start()];
        starts.extend(least(&low, catalogue.warm(&low, &model.problem, &model.fit.u)));
        let fits: Vec<Fit> = starts.par_iter().filter_map(|start| fit(&low, start, &options)).collect();
        let first = fits.into_iter().max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
        let high = subject.problem(space.clone(), Level::High, stop);
        let start = catalogue.carried(&low, &first.u, &high);
        model = best(&subject, &space, &[start], &options, stop)?;
        rungs.push(rung(addition.name(), &model));
    }
    let kinds: Vec<EffectKind> = additions
        .iter()
        .filter_map(|addition| match addition {
            Addition::Catalogue(kind) => Some(*kind),
            Addition::Own(_) => None,
        })
        .collect();
    let place = |kind: &EffectKind| catalogue.kinds.iter().position(|other| other == kind);
    let mut set: Vec<usize> = kinds.iter().filter_map(place).collect();
    set.sort_unstable();
    // From where a search fits them as well, so that both tell the same.
    if set.len() == additions.len()
        && let Some((problem, fit)) = afresh(&catalogue, &set, &calibrated)
        && fit.log_evidence > model.fit.log_evidence
        && let Some(last) = rungs.last_mut()
    {
        let held_out = held_out(&problem, &fit, &folds(&problem), &options, OwnFits::WhereShort);
        model = Model { set: Vec::new(), level: Level::High, problem, fit, held_out };
        let name = last.step.step.clone();
        *last = rung(&name, &model);
    }
    let leaves_much = errors::is_large(&model, SelectOptions::default().large);
    let certainty = Certainty::of_model(&model);
    let parameters = effect_parameters(&model.problem, &model.fit, &certainty, &kinds, true);
    let mut moved = moved_parameters(&model.problem, &model.fit, &certainty);
    moved.extend(found_beside(&model, &certainty));
    let nuisances = nuisance_reports(&model, &certainty, &moved);
    Some(Sequence { rungs, parameters, moved, nuisances, leaves_much })
}

/// Of several points the one with the least error.
fn least(problem: &ValveProblem<'_>, points: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    let error = |u: &Vec<f64>| errors::at(problem, u).map_or(f64::INFINITY, |errors| errors.normalised_rms);
    points.into_iter().map(|u| (error(&u), u)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, u)| u)
}

/// The best fit of a space from several starts.
fn best<'a>(
    subject: &'a Subject,
    space: &Space,
    starts: &[Vec<f64>],
    options: &FitOptions,
    stop: &'a Stop,
) -> Option<Model<ValveProblem<'a>>> {
    let problem = subject.problem(space.clone(), Level::High, stop);
    let fits: Vec<Fit> = starts.par_iter().filter_map(|start| fit(&problem, start, options)).collect();
    let fit = fits.into_iter().max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
    let held_out = held_out(&problem, &fit, &folds(&problem), options, OwnFits::WhereShort);
    Some(Model { set: Vec::new(), level: Level::High, problem, fit, held_out })
}

fn rung(name: &str, model: &Model<ValveProblem<'_>>) -> Rung {
    let step = StepReport::new(name, model);
    let space = model.problem.space.clone();
    let u = model.fit.u[..space.coordinates.len()].to_vec();
    let found = found_beside(model, &Certainty::of_model(model));
    let beside = found.iter().map(|parameter| (parameter.id, parameter.after)).collect();
    Rung { step, space, u, beside }
}
