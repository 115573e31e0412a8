//! The sections about recorded strokes: the model beside them, calibrated to them, and what it lacks.

use identify::Stop;
use model_lab::calibrate::Calibration;
use model_lab::diagnosis::{DiagnoseOptions, Explanation};
use model_lab::residual_force::ResidualForce;
use report::Figure;
use report::html::{Block, Section};

use crate::commands::{adopt, calibrate, compare, explain, steps};
use answers::calibration::verdict_words;
use answers::figures::{
    calibration as calibrate_figures, comparison as compare_figures, explanation as explain_figures,
};
use answers::{CampaignInput, explanation};

/// Compares, calibrates and explains.
pub fn sections(input: &CampaignInput) -> anyhow::Result<Vec<Section>> {
    let mut sections = vec![compared(input)?];
    // Without tolerances there is nothing to calibrate.
    if !input.file.tolerances().is_empty() {
        let calibration = Calibration::new(&input.file, &input.campaign, Stop::never())?;
        sections.push(calibrated(input, &calibration));
    }
    let answer = explain::search(input, &DiagnoseOptions::default())?;
    sections.push(explained(input, &answer));
    Ok(sections)
}

fn figure(figure: Figure) -> Block {
    Block::Figure(Box::new(figure))
}

fn compared(input: &CampaignInput) -> anyhow::Result<Section> {
    let compared = compare::compared(input, &input.file)?;
    let comparison = &compared.comparison;
    let mut blocks: Vec<Block> = comparison.words().into_iter().map(Block::Callout).collect();
    blocks.extend(compare::error_lines(&compared).map(Block::Text));
    blocks.push(Block::Table(compare::run_table(comparison, None).into()));
    if !input.data.runs.is_empty() {
        blocks.push(figure(
            compare_figures::overlay(input, comparison, &steps::words(&comparison.overall.errors)).figure(),
        ));
        blocks.push(figure(compare_figures::strips(input, comparison, None).figure()));
        if let Some(force) = ResidualForce::new(&input.data, input.file.valve(), input.file.tolerances()) {
            blocks.push(figure(compare_figures::missing_force(&force).figure()));
            let signature = force.signature.as_ref();
            blocks.extend(signature.map(|found| {
                figure(compare_figures::signature(input.file.name(), found, compare::signature_words(found)).figure())
            }));
        }
    }
    Ok(Section { title: format!("Recorded strokes: {}", input.campaign.name), blocks })
}

fn calibrated(input: &CampaignInput, calibration: &Calibration) -> Section {
    let verdict = verdict_words(calibration);
    let mut blocks = vec![Block::Callout(verdict.to_owned())];
    blocks.extend(calibration.reasons.iter().filter(|reason| *reason != verdict).cloned().map(Block::Text));
    blocks.push(Block::Table(calibrate::parameter_table(calibration).into()));
    blocks.push(Block::Table(steps::rows(&calibration.steps).into()));
    blocks.push(Block::Text(format!("left: {}", steps::words(&calibration.steps[1].errors))));
    blocks.extend(
        explain::nuisance_lines(&calibration.nuisances).lines().map(|line| Block::Text(line.trim().to_owned())),
    );
    blocks.push(figure(calibrate_figures::shifts(input, calibration).figure()));
    Section { title: "Calibration".to_owned(), blocks }
}

fn explained(input: &CampaignInput, answer: &Explanation) -> Section {
    let (name, headline) = (&input.campaign.name, explanation::headline(answer));
    let mut blocks = vec![Block::Callout(headline.clone())];
    let parameters = adopt::parameter_lines(&answer.parameters);
    blocks.extend(parameters.lines().map(|line| Block::Text(line.to_owned())));
    blocks.extend(answer.notes.iter().cloned().map(Block::Text));
    let steps = explain_figures::steps(answer);
    blocks.push(Block::Table(steps::rows(&steps).into()));
    blocks.push(figure(explain_figures::staircase(name, &headline, &steps).figure()));
    blocks.push(figure(explain_figures::leaderboard(answer, name, &headline).figure()));
    for group in &answer.indistinguishable {
        if let Some(plan) = &group.experiment {
            let others: Vec<&str> = group.with.iter().map(|other| other.kind.id()).collect();
            let (kind, others) = (group.kind.id(), others.join(", "));
            blocks.push(Block::Text(format!("What would tell {kind} from {others}: {}", plan.purpose)));
            blocks.push(Block::Code(explanation::run_toml(plan)));
        }
    }
    blocks.extend(explain_figures::next_experiment(answer).map(|found| figure(found.figure())));
    if let Some(discrepancy) = &answer.discrepancy {
        blocks.push(figure(explain_figures::unexplained(discrepancy, name).figure()));
        blocks.push(Block::Text("The same as an effect for the valve file:".to_owned()));
        blocks.push(Block::Code(explanation::effect_toml(discrepancy)));
    }
    Section { title: "What is missing".to_owned(), blocks }
}
