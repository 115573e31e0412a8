//! What a model lacks on a campaign: which effects, how large, how sure, what they leave, and what would tell more.

pub mod adopt;
mod alternatives;
mod answer;
mod apart;
mod candidates;
pub mod discrepancy;
mod exchanged;
pub mod experiment;
mod naming;
mod report;
mod taken;
pub mod uncertainty;

use campaign::Campaign;
use identify::Stop;
use identify::select::{Model, News, SelectOptions, select};
use valve_file::ValveFile;
use valve_model::EffectKind;

use crate::errors;
use crate::identification::{Catalogue, Known, NuisanceSizes, Subject, ValveProblem};

pub use report::nuisance_reports;
pub use taken::{TakenBy, taken};

pub use answer::{
    Alternative, CandidateReport, Condition, Exchanged, Explanation, FittedParameter, Indistinguishable, LeftOut,
    MovedParameter, NuisanceReport, Remainder, Repair, Verdict,
};

/// A set of effects that was fitted to a campaign.
type Fitted<'a> = Model<ValveProblem<'a>>;

/// What a search tells while it runs.
#[derive(Debug, Clone, PartialEq)]
pub enum Progress {
    /// A set of effects was fitted.
    Tried {
        /// Its effects.
        kinds: Vec<EffectKind>,
        /// Its logarithm of the evidence, nats.
        log_evidence: f64,
        /// The error that it leaves, in units of the noise as the fit found it.
        error: f64,
        /// Sets in this round.
        of: usize,
    },
    /// The search goes on from a set.
    Reached {
        /// Its effects.
        kinds: Vec<EffectKind>,
        /// Gain of evidence over the calibrated model, nats.
        gain: f64,
    },
    /// Something else is being done.
    Doing(&'static str),
}

/// Numbers that steer a diagnosis.
#[derive(Debug, Clone)]
pub struct DiagnoseOptions {
    /// The effects that are searched through: those of the catalogue, and whatever a program brings along.
    pub effects: Vec<EffectKind>,
    /// What instruments and conditions may be off by.
    pub nuisances: NuisanceSizes,
    /// How effects are searched for.
    pub select: SelectOptions,
    /// An error on what was held out that is good enough for the user, m; nothing to go on to the noise.
    pub good_enough_m: Option<f64>,
}

impl Default for DiagnoseOptions {
    fn default() -> Self {
        Self {
            effects: EffectKind::ALL.to_vec(),
            nuisances: NuisanceSizes::default(),
            select: SelectOptions::default(),
            good_enough_m: None,
        }
    }
}

/// When a force or a flow without a law is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Formula {
    WhereSomethingIsLeft,
    /// Runs without one of them are only asked whether the others are explained then.
    Never,
}

/// Explains what a valve file's model lacks on a campaign; nothing if its strokes cannot be simulated, or if somebody asked to
/// stop before the model was calibrated.
pub fn explain(
    file: &ValveFile,
    campaign: &Campaign,
    options: &DiagnoseOptions,
    tell: &(dyn Fn(Progress) + Sync),
    stop: &Stop,
) -> Option<Explanation> {
    let subject = Subject::new(file, campaign, &options.nuisances, stop);
    let (found, contradicting) = searched(&subject, options, tell, stop, Formula::WhereSomethingIsLeft, None)?;
    let leaves = |found: &Explanation| matches!(found.verdict, Verdict::OutsideCatalogue | Verdict::PartlyExplained);
    let is_left = leaves(&found);
    if let Some(exchange) = is_left.then(|| exchanged::exchanged(&subject, campaign, stop)).flatten() {
        tell(Progress::Doing("all runs, with the conditions of two exchanged"));
        let right = exchanged::the_other_way_round(campaign, exchange);
        let right = Subject::new(file, &right, &options.nuisances, stop);
        let explained = searched(&right, options, tell, stop, Formula::Never, None).map(|(explained, _)| explained);
        if let Some(explained) = explained.filter(|explained| !leaves(explained) && !stop.is_asked()) {
            return Some(Explanation { exchanged: Some(exchanged::told(campaign, exchange)), ..explained });
        }
    }
    let mut without_repair = None;
    for run in contradicting.into_iter().filter(|_| is_left) {
        if stop.is_asked() {
            break;
        }
        tell(Progress::Doing("all runs but one that contradicts them"));
        let rest = Subject::new(file, &apart::without(campaign, run), &options.nuisances, stop);
        let others = searched(&rest, options, tell, stop, Formula::Never, None)
            .map(|(others, _)| others)
            .filter(|_| !stop.is_asked());
        let Some(others) = others else { break };
        let Some(left_out) = apart::left_out(&subject, campaign, run, &others, stop) else { continue };
        let is_repaired = left_out.repair.is_some();
        if !is_repaired && apart::is_explained_with_all(&subject, &others, stop) {
            let all = searched(&subject, options, tell, stop, Formula::Never, Some(&others.known));
            if let Some((all, _)) = all.filter(|(all, _)| !leaves(all) && !stop.is_asked()) {
                return Some(all);
            }
        }
        let of_others = Explanation { left_out: Some(left_out), ..others };
        if is_repaired {
            return Some(of_others);
        }
        without_repair = without_repair.or(Some(of_others));
    }
    Some(without_repair.unwrap_or(found))
}

/// What a search finds, and the runs that contradict all others: by the calibrated model, and by what was found, since physics
/// that is missing may contradict more than a slip.
fn searched(
    subject: &Subject,
    options: &DiagnoseOptions,
    tell: &(dyn Fn(Progress) + Sync),
    stop: &Stop,
    formula: Formula,
    known: Option<&Known>,
) -> Option<(Explanation, Vec<usize>)> {
    let kinds = Catalogue::new(subject, &options.effects, &|_| (), stop).without_inert().kinds;
    let of = |set: &[usize]| -> Vec<EffectKind> { set.iter().map(|one| kinds[*one]).collect() };
    let news = |news: News<'_>| match news {
        News::Fitted { set, log_evidence, rms, of: count } => {
            tell(Progress::Tried { kinds: of(set), log_evidence, error: rms, of: count });
        }
        News::Reached { set, gain } => tell(Progress::Reached { kinds: of(set), gain }),
    };
    let mut catalogue = Catalogue::new(subject, &kinds, &news, stop);
    catalogue.known = known;
    let enough = |model: &Fitted<'_>| {
        let left = || errors::held_out(model).unwrap_or_else(|| errors::fitted(model)).rmse_m;
        options.good_enough_m.is_some_and(|enough| left().is_some_and(|rmse| rmse < enough))
    };
    catalogue.enough = &enough;
    tell(Progress::Doing("the calibrated model"));
    let found = select(&catalogue, &options.select)?;
    let models = [found.model(&[]), found.model(found.accepted())];
    let mut contradicting: Vec<usize> = models.into_iter().flatten().filter_map(apart::contradicting).collect();
    contradicting.extend(found.model(&[]).and_then(apart::farthest));
    let mut seen = Vec::new();
    contradicting.retain(|run| {
        !seen.contains(run) && {
            seen.push(*run);
            true
        }
    });
    Some((report::assemble(&catalogue, &found, options, tell, formula), contradicting))
}
