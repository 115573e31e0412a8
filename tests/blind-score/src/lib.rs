//! What `explain` says of campaigns whose truth is known to the one who drew them.

mod summary;

pub use summary::Summary;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use blind_benchmark::Campaign;
use blind_benchmark::truth::{Category, Channels, Truth};
use model_lab::data::valve_facts;
use model_lab::explain::report::FittedParameter;
use model_lab::explain::{Explanation, Verdict, Watch, explain};
use model_lab::{Dataset, Space};
use valve_file::ValveFile;
use valve_model::EffectKind;

/// A group of effects up to this size still names something.
const LARGEST_GROUP: usize = 3;

/// What was said of one campaign, beside what is true.
#[derive(Debug, Clone)]
pub struct Scored {
    /// The campaign.
    pub name: String,
    /// Its truth.
    pub truth: Truth,
    /// The verdict.
    pub verdict: Verdict,
    /// The effects recommended, in order.
    pub recommended: Vec<&'static str>,
    /// For each of them, it and what cannot be told from it.
    pub groups: Vec<Vec<&'static str>>,
    /// How far the first parameter of each hidden effect that was named is off, as a share of its distance
    /// from neutral.
    pub size_errors: Vec<f64>,
    /// Error on left-out conditions at the end of the ladder, in units of the noise.
    pub held_out: Option<f64>,
    /// Lack of fit at the end, in standard deviations of pure noise.
    pub lack: f64,
    /// The recommended parameters as text.
    pub parameters: String,
    /// Wall-clock time, s.
    pub seconds: f64,
}

impl Scored {
    fn hidden(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.truth.effects.iter().map(|effect| effect.id)
    }

    /// Whether the first effect recommended is one of the hidden ones.
    pub fn first_is_right(&self) -> bool {
        self.recommended.first().is_some_and(|first| self.hidden().any(|id| id == *first))
    }

    /// Whether every hidden effect is in a reported group of at most three.
    pub fn is_in_groups(&self) -> bool {
        let named = |id| self.groups.iter().any(|group| group.len() <= LARGEST_GROUP && group.contains(&id));
        self.hidden().all(named)
    }

    /// Whether just the hidden effects are recommended.
    pub fn is_exact(&self) -> bool {
        self.recommended.len() == self.truth.effects.len() && self.hidden().all(|id| self.recommended.contains(&id))
    }

    /// Whether every hidden effect is recommended.
    pub fn names_all(&self) -> bool {
        self.hidden().all(|id| self.recommended.contains(&id))
    }

    /// Whether the answer is what was hoped for.
    pub fn is_right(&self) -> bool {
        match self.truth.category {
            Category::Nothing => self.verdict == Verdict::Adequate,
            Category::Outside => self.verdict == Verdict::OutsideCatalogue,
            Category::One | Category::Two if self.truth.channels == Channels::Timings => self.is_in_groups(),
            Category::One | Category::Two => self.is_exact(),
        }
    }
}

/// A drawn campaign as the program sees it.
#[derive(Debug)]
pub struct Drawn {
    /// The valve as it is believed to be.
    pub file: ValveFile,
    /// The records.
    pub data: Dataset,
    /// What may move.
    pub space: Space,
}

impl Drawn {
    /// Writes a campaign to a folder and reads it as the program would.
    pub fn through_files(drawn: &Campaign, parent: &Path) -> Result<Self> {
        let folder = drawn.write_to(parent)?;
        let file = ValveFile::read(&folder.join("valve.toml"))?;
        let campaign = campaign::Campaign::read(&folder.join("campaign.toml"), &valve_facts(file.valve()))?;
        let data = Dataset::new(&campaign, file.schedule());
        let space = Space::tolerated(&file);
        Ok(Self { file, data, space })
    }
}

/// Scores what is said of a campaign that went through the files of a folder.
pub fn score(drawn: &Campaign, parent: &Path) -> Result<Scored> {
    let Drawn { data, space, .. } =
        Drawn::through_files(drawn, parent).with_context(|| format!("{}, as it was drawn", drawn.name))?;
    let start = Instant::now();
    let answer = explain(&data, &space, &Watch::nobody()).context("the valve file's own values cannot be simulated")?;
    Ok(scored(drawn, &answer, start.elapsed().as_secs_f64()))
}

fn scored(drawn: &Campaign, answer: &Explanation, seconds: f64) -> Scored {
    let groups = answer
        .recommended
        .iter()
        .map(|kind| {
            let twins = answer.twins.iter().filter(|twins| twins.kind == *kind).flat_map(|twins| &twins.with);
            std::iter::once(kind.id()).chain(twins.map(|twin| twin.kind.id())).collect()
        })
        .collect();
    let texts = answer.parameters.iter().map(|p| format!("{} {:.4e} +- {:.1e}", p.name, p.value, p.sigma));
    Scored {
        name: drawn.name.clone(),
        truth: drawn.truth.clone(),
        verdict: answer.verdict,
        recommended: answer.recommended.iter().map(|kind| kind.id()).collect(),
        groups,
        size_errors: size_errors(&drawn.truth, &answer.parameters),
        held_out: answer.steps.last().and_then(|step| step.held_out_normalised_rms),
        lack: answer.lack,
        parameters: texts.collect::<Vec<_>>().join(", "),
        seconds,
    }
}

fn size_errors(truth: &Truth, parameters: &[FittedParameter]) -> Vec<f64> {
    let mut errors = Vec::new();
    for effect in &truth.effects {
        let Some(first) = effect.parameters.first() else { continue };
        let found = parameters.iter().find(|p| p.effect.id() == effect.id && p.name == first.name);
        if let Some(found) = found {
            let neutral = neutral(found.effect);
            errors.push(((found.value - neutral) / (first.value - neutral) - 1.0).abs());
        }
    }
    errors
}

fn neutral(kind: EffectKind) -> f64 {
    let neutral = kind.info().neutral;
    if neutral.is_finite() { neutral } else { 0.0 }
}
