//! The answer of a search: in a sentence, and for programs with the names of the output's contract.

use std::collections::BTreeMap;
use std::fmt::Write;

use identify::select::BY_CHANCE;
use leak_table::mm2_from_m2;
use model_lab::diagnosis::discrepancy::ModelDiscrepancy;
use model_lab::diagnosis::experiment::Experiment;
use model_lab::diagnosis::{
    CandidateReport, Condition, Exchanged, Explanation, FittedParameter, Indistinguishable, LeftOut, Repair, Verdict,
};
use quantity::Unit;
use serde::Serialize;
use serde_json::Value;
use valve_model::EffectKind;
use valve_model::custom::CustomTarget;

use crate::error::BothErrors;
use crate::moved::{NuisanceDocument, ParameterDocument};
use crate::steps::StepDocument;
use crate::{CampaignInput, SCHEMA, moved, steps, value_of};

/// Effects in words.
pub fn joined(kinds: &[EffectKind]) -> String {
    kinds.iter().map(|kind| kind.id()).collect::<Vec<_>>().join(" + ")
}

fn ids(answer: &Explanation) -> String {
    answer.recommended.iter().map(|kind| kind.id()).collect::<Vec<_>>().join(" and ")
}

/// What was found, each effect with those that it cannot be told from.
fn groups(answer: &Explanation) -> String {
    let group = |kind: &EffectKind| {
        let with = answer.indistinguishable.iter().filter(|group| group.kind == *kind).flat_map(|group| &group.with);
        let names: Vec<&str> = with.map(|other| other.kind.id()).collect();
        if names.is_empty() { kind.id().to_owned() } else { format!("{} (or {})", kind.id(), names.join(", or ")) }
    };
    answer.recommended.iter().map(group).collect::<Vec<_>>().join(" and ")
}

/// The answer in a sentence.
pub fn headline(answer: &Explanation) -> String {
    headline_in(answer, &|rmse_m| format!("{:.3} mm", 1e3 * rmse_m))
}

/// The same with an error of a length, m, told in other words.
pub fn headline_in(answer: &Explanation, length: &dyn Fn(f64) -> String) -> String {
    let verdict = verdict_in(answer, length);
    if let Some(Exchanged { runs: [one, other], what }) = &answer.exchanged {
        return format!("with the {what} of {one} and {other} exchanged: {verdict}");
    }
    match &answer.left_out {
        Some(LeftOut { run, .. }) => format!("{run} contradicts all other runs and was left out; of these: {verdict}"),
        None => verdict,
    }
}

/// What else the reader should know; what is wrong with a run that was left out comes first.
pub fn notes(answer: &Explanation) -> Vec<String> {
    let slips = answer.left_out.iter().map(slip).chain(answer.exchanged.iter().map(exchange));
    let of_instruments = answer.recommended.iter().filter(|kind| kind.info().acts_on.is_measurement()).map(|kind| {
        format!(
            "{} is of what records the valve: the valve itself moves as before, and its stroke times stay",
            kind.id()
        )
    });
    slips.chain(of_instruments).chain(moved::far_off(&answer.moved)).chain(answer.notes.iter().cloned()).collect()
}

/// Two runs with something of each other's, and what is told of them all the same.
fn exchange(Exchanged { runs: [one, other], what }: &Exchanged) -> String {
    format!(
        "the {what} of {one} and {other} seem to have been written down for one another: as they stand something is left that \
         nothing explains, and exchanged nothing is; all of this is told with them exchanged, correct the campaign file"
    )
}

/// How surely an effect is needed, among all sets of effects that were compared; nothing where that is not known.
pub fn inclusion_words(answer: &Explanation, kind: EffectKind) -> Option<String> {
    /// What is surer than this is not told more finely: the priors of sets are no better known.
    const SURE: f64 = 0.999;
    let share = answer.inclusion.iter().find(|(one, _)| *one == kind)?.1;
    Some(if share > SURE { "> 99.9 %".to_owned() } else { format!("{:.1} %", 100.0 * share) })
}

/// What is to be mended of a run that was left out: "run.csv: supply_pressure 58.0 psig should be about 84.9 psig".
pub fn correction(one: &LeftOut) -> String {
    let Some(repair) = &one.repair else { return format!("{}: what was recorded or noted wrongly in it", one.run) };
    let right = condition_text(one, repair.condition, repair.right);
    let condition = condition_id(repair.condition);
    match repair.in_place_of {
        Some((other, stated)) => format!(
            "{}: {} {} should be {condition} of about {right}",
            one.run,
            condition_id(other),
            condition_text(one, other, stated)
        ),
        None => {
            format!(
                "{}: {condition} {} should be about {right}",
                one.run,
                condition_text(one, repair.condition, repair.stated)
            )
        }
    }
}

/// The value of a condition, in the units of people.
fn condition_text(one: &LeftOut, condition: Condition, value: f64) -> String {
    match condition {
        Condition::SupplyPressure => {
            let unit = Unit::parse("psig").unwrap_or_else(|_| unreachable!("a unit of the program's own"));
            format!("{:.1} psig", unit.from_si(value - one.ambient_pa))
        }
        Condition::Temperature => format!("{value:.1} K"),
        _ if value == 0.0 => "none".to_owned(),
        Condition::LeakToAtmosphere | Condition::LeakFromSupply => format!("{:.3} mm2", mm2_from_m2(value)),
    }
}

/// What is wrong with a run, in the units of people and in those of programs.
fn slip(one: &LeftOut) -> String {
    let (stated_mm, others_mm) = (1e3 * one.stated_rmse_m, 1e3 * one.others_rmse_m);
    let Some(repair) = &one.repair else {
        return format!(
            "{}: the model that explains the other runs to {others_mm:.3} mm is off by {stated_mm:.3} mm in this one, and no other pressure, \
             temperature or leak explains that. Did its clock or its sensor jump, is it of another valve, or are conditions of two \
             runs exchanged? If it is in order, it alone shows what is missing",
            one.run
        );
    };
    let shown = |condition: Condition, value: f64| match condition {
        Condition::SupplyPressure => {
            format!("{}, {:.1} kPa absolute", condition_text(one, condition, value), 1e-3 * value)
        }
        _ => condition_text(one, condition, value),
    };
    let words = |condition: Condition| condition_id(condition).replace('_', " ");
    let (condition, written) = repair.in_place_of.unwrap_or((repair.condition, repair.stated));
    let of_other_kind = repair.in_place_of.map_or_else(String::new, |_| format!("a {} of ", words(repair.condition)));
    format!(
        "{}: under the {} that was written down ({}) an error of {stated_mm:.3} mm is left, where the other runs leave {others_mm:.3} mm; \
         under {of_other_kind}about {} it would be explained as well, to {:.3} mm. Is it mistyped?",
        one.run,
        words(condition),
        shown(condition, written),
        shown(repair.condition, repair.right),
        1e3 * repair.right_rmse_m,
    )
}

/// The key of a condition in a campaign file.
fn condition_id(condition: Condition) -> &'static str {
    match condition {
        Condition::SupplyPressure => "supply_pressure",
        Condition::Temperature => "temperature",
        Condition::LeakToAtmosphere => "leak_to_atmosphere",
        Condition::LeakFromSupply => "leak_from_supply",
    }
}

fn verdict_in(answer: &Explanation, length: &dyn Fn(f64) -> String) -> String {
    let missing =
        if answer.interrupted { "missing, as far as the search got before it was cut short" } else { "missing" };
    match answer.verdict {
        Verdict::Adequate if answer.remainder.nats > BY_CHANCE => {
            format!(
                "nothing is missing that is larger than what instruments and small laws are off by; an error of {} is left",
                left(answer, length)
            )
        }
        Verdict::Adequate => {
            "nothing is missing beyond noise, tolerances and what instruments and conditions may be off by".into()
        }
        Verdict::EffectFound => format!("{missing}: {}", groups(answer)),
        Verdict::PartlyExplained => {
            let left = left(answer, length);
            format!("{missing}: {}; that explains most of it, and an error of {left} is left", groups(answer))
        }
        Verdict::OutsideCatalogue => {
            let missing = format!(
                "something is missing ({} are left), and no effect of the catalogue, nor a pair, explains it",
                left(answer, length)
            );
            match answer.discrepancy.as_ref().and_then(|discrepancy| Some((discrepancy, discrepancy.errors.rmse_m?))) {
                Some((discrepancy, rmse_m)) => {
                    let formula = format!(
                        "a formula for {} {}",
                        acting(discrepancy.axis.target),
                        along(discrepancy.axis.variable)
                    );
                    if is_explained(answer) {
                        format!("{missing}; {formula} does, but for {}", length(rmse_m))
                    } else {
                        format!("{missing}; nor does {formula}, which leaves {}", length(rmse_m))
                    }
                }
                None => missing,
            }
        }
        Verdict::NotEnoughData if answer.interrupted && answer.recommended.is_empty() => {
            "the search was cut short before it was known what is missing, if anything is".into()
        }
        Verdict::NotEnoughData if answer.interrupted => {
            format!("something is missing; {} explains part of it, and the search was cut short there", ids(answer))
        }
        Verdict::NotEnoughData => {
            format!("something is missing; {} explains it, and so do too many others", ids(answer))
        }
    }
}

/// Whether a formula takes away at least half of what no effect explains; else it stands in for something that is neither
/// a force nor a flow of this kind of valve.
#[must_use]
pub fn is_explained(answer: &Explanation) -> bool {
    let formula = answer.discrepancy.as_ref().and_then(|found| found.errors.rmse_m);
    let without = answer.steps.last().and_then(|step| step.errors.rmse_m);
    match (formula, without) {
        (Some(formula), Some(without)) => formula < 0.5 * without,
        // Of stroke times alone the evidence is all there is.
        _ => answer.discrepancy.is_some(),
    }
}

/// What a formula adds, in words.
fn acting(target: CustomTarget) -> &'static str {
    match target {
        CustomTarget::Force => "a force",
        CustomTarget::Friction => "a friction",
        CustomTarget::PipeFlow => "a flow into the pipe",
        CustomTarget::ChamberFlow => "a flow into the chamber",
    }
}

/// What a formula lies along, in words.
fn along(variable: &str) -> &str {
    match variable {
        "x" => "along the stroke",
        "v" => "over the speed",
        "t_since_command" => "after each command",
        other => other,
    }
}

/// The error that is left, in words.
fn left(answer: &Explanation, length: &dyn Fn(f64) -> String) -> String {
    let last = answer.steps.last();
    match last.and_then(|step| step.held_out.and_then(|errors| errors.rmse_m).or(step.errors.rmse_m)) {
        Some(rmse) => length(rmse),
        None => {
            last.and_then(|step| step.errors.time_rmse_s).map_or("some".into(), |rmse| format!("{:.1} ms", 1e3 * rmse))
        }
    }
}

/// A search for programs.
#[derive(Debug, Clone, Serialize)]
struct ExplanationDocument<'a> {
    schema: u32,
    campaign: &'a str,
    verdict: &'static str,
    recommended: Vec<&'static str>,
    parameters: Vec<EffectParameterDocument>,
    calibrated_parameters: Vec<ParameterDocument>,
    nuisances: Vec<NuisanceDocument>,
    indistinguishable: BTreeMap<&'static str, IndistinguishableDocument<'a>>,
    candidates: Vec<CandidateDocument<'a>>,
    probability: Probabilities,
    steps: Vec<StepDocument>,
    remainder: RemainderDocument,
    residual: Option<DiscrepancyDocument<'a>>,
    left_out: Option<LeftOutDocument<'a>>,
    exchanged: Option<ExchangedDocument<'a>>,
    notes: Vec<String>,
    doubts: Vec<String>,
    interrupted: bool,
}

/// Two runs with something of each other's, for programs.
#[derive(Debug, Clone, Serialize)]
struct ExchangedDocument<'a> {
    runs: &'a [String; 2],
    what: &'static str,
}

/// A run that contradicts all others, for programs, SI.
#[derive(Debug, Clone, Serialize)]
struct LeftOutDocument<'a> {
    run: &'a str,
    condition: Option<&'static str>,
    stated: Option<f64>,
    right: Option<f64>,
    in_place_of: Option<&'static str>,
    stated_rmse_m: f64,
    right_rmse_m: Option<f64>,
    others_rmse_m: f64,
}

/// A value of an effect for programs, SI.
#[derive(Debug, Clone, Serialize)]
pub struct EffectParameterDocument {
    effect: &'static str,
    name: &'static str,
    value: f64,
    standard_error: f64,
    unit: &'static str,
}

/// What an effect cannot be told from.
#[derive(Debug, Clone, Serialize)]
struct IndistinguishableDocument<'a> {
    with: Vec<&'static str>,
    delta_log_evidence: Vec<f64>,
    next_experiment: Option<ExperimentDocument<'a>>,
}

/// A run that would tell effects apart.
#[derive(Debug, Clone, Serialize)]
struct ExperimentDocument<'a> {
    purpose: &'a str,
    run: String,
    record_pressures: bool,
    repeats: usize,
    separation_chi2: f64,
}

/// A set of effects that was tried.
#[derive(Debug, Clone, Serialize)]
struct CandidateDocument<'a> {
    effects: Vec<&'static str>,
    #[serde(flatten)]
    errors: BothErrors,
    parameters: Vec<EffectParameterDocument>,
    log_evidence_gain: f64,
    probability: Option<f64>,
    delta_bic: f64,
    rejected: Option<&'a str>,
}

/// How likely effects and sets of them are.
#[derive(Debug, Clone, Serialize)]
struct Probabilities {
    effects: BTreeMap<&'static str, f64>,
    models: Vec<ModelProbability>,
}

/// How likely a set of effects is.
#[derive(Debug, Clone, Serialize)]
struct ModelProbability {
    effects: Vec<&'static str>,
    probability: f64,
}

/// What is left.
#[derive(Debug, Clone, Serialize)]
struct RemainderDocument {
    model_error_share_of_stroke: f64,
    correlation_time_s: f64,
    log_evidence: f64,
    noise_multiplier: f64,
}

/// Something that no effect of the catalogue explains.
#[derive(Debug, Clone, Serialize)]
struct DiscrepancyDocument<'a> {
    acts_on: &'static str,
    along: &'a str,
    table: TableDocument<'a>,
    custom: CustomDocument<'a>,
    toml: String,
    log_evidence_gain: f64,
    with_custom: BothErrors,
}

/// A force or flow without a law.
#[derive(Debug, Clone, Serialize)]
struct TableDocument<'a> {
    at: &'a [f64],
    value: &'a [f64],
    standard_error: &'a [f64],
}

/// A formula for it.
#[derive(Debug, Clone, Serialize)]
struct CustomDocument<'a> {
    acts_on: &'static str,
    formula: &'a str,
    parameters: BTreeMap<&'a str, CustomParameter<'a>>,
}

/// A number of a formula.
#[derive(Debug, Clone, Serialize)]
struct CustomParameter<'a> {
    value: f64,
    standard_error: f64,
    unit: &'a str,
}

/// The whole answer.
pub fn document(answer: &Explanation, input: &CampaignInput) -> Value {
    let models = answer.candidates.iter().filter_map(|candidate| {
        Some(ModelProbability { effects: ids_of(&candidate.kinds), probability: candidate.probability? })
    });
    value_of(&ExplanationDocument {
        schema: SCHEMA,
        campaign: &input.campaign.name,
        verdict: answer.verdict.id(),
        recommended: ids_of(&answer.recommended),
        parameters: parameters(&answer.parameters),
        calibrated_parameters: moved::parameters(&answer.moved),
        nuisances: moved::nuisances(&answer.nuisances),
        indistinguishable: answer
            .indistinguishable
            .iter()
            .map(|group| (group.kind.id(), indistinguishable_document(group)))
            .collect(),
        candidates: answer.candidates.iter().map(candidate_document).collect(),
        probability: Probabilities {
            effects: answer.inclusion.iter().map(|(kind, share)| (kind.id(), *share)).collect(),
            models: models.collect(),
        },
        steps: steps::documents(&answer.steps),
        remainder: RemainderDocument {
            model_error_share_of_stroke: answer.remainder.discrepancy,
            correlation_time_s: answer.remainder.time_s,
            log_evidence: answer.remainder.nats,
            noise_multiplier: answer.remainder.multiplier,
        },
        residual: answer.discrepancy.as_ref().map(discrepancy_document),
        left_out: answer.left_out.as_ref().map(left_out_document),
        exchanged: answer.exchanged.as_ref().map(|Exchanged { runs, what }| ExchangedDocument { runs, what }),
        notes: notes(answer),
        doubts: input.doubts(),
        interrupted: answer.interrupted,
    })
}

fn ids_of(kinds: &[EffectKind]) -> Vec<&'static str> {
    kinds.iter().map(|kind| kind.id()).collect()
}

/// Values of effects for programs.
pub fn parameters(fitted: &[FittedParameter]) -> Vec<EffectParameterDocument> {
    let document = |parameter: &FittedParameter| EffectParameterDocument {
        effect: parameter.effect.id(),
        name: parameter.name,
        value: parameter.value,
        standard_error: parameter.sigma,
        unit: parameter.unit,
    };
    fitted.iter().map(document).collect()
}

fn indistinguishable_document(group: &Indistinguishable) -> IndistinguishableDocument<'_> {
    IndistinguishableDocument {
        with: group.with.iter().map(|other| other.kind.id()).collect(),
        delta_log_evidence: group.with.iter().map(|other| -other.behind).collect(),
        next_experiment: group.experiment.as_ref().map(|plan| ExperimentDocument {
            purpose: &plan.purpose,
            run: run_toml(plan),
            record_pressures: plan.pressures,
            repeats: plan.replicates,
            separation_chi2: plan.separation,
        }),
    }
}

fn left_out_document(one: &LeftOut) -> LeftOutDocument<'_> {
    let repair: Option<&Repair> = one.repair.as_ref();
    LeftOutDocument {
        run: &one.run,
        condition: repair.map(|repair| condition_id(repair.condition)),
        stated: repair.map(|repair| repair.stated),
        right: repair.map(|repair| repair.right),
        in_place_of: repair.and_then(|repair| repair.in_place_of).map(|(other, _)| condition_id(other)),
        stated_rmse_m: one.stated_rmse_m,
        right_rmse_m: repair.map(|repair| repair.right_rmse_m),
        others_rmse_m: one.others_rmse_m,
    }
}

fn candidate_document(candidate: &CandidateReport) -> CandidateDocument<'_> {
    CandidateDocument {
        effects: ids_of(&candidate.kinds),
        errors: BothErrors::new(&candidate.errors, candidate.held_out.as_ref()),
        parameters: parameters(&candidate.parameters),
        log_evidence_gain: candidate.gain,
        probability: candidate.probability,
        delta_bic: candidate.delta_bic,
        rejected: candidate.rejected.as_deref(),
    }
}

/// A planned run as it is pasted into a campaign file.
pub fn run_toml(plan: &Experiment) -> String {
    let conditions = &plan.run.conditions;
    // Writing to a string cannot fail.
    let mut text = format!(
        "[[run]]\nsupply_pressure = \"{:.2} kPa\"\ntemperature = \"{:.2} K\"\n",
        conditions.supply_pressure_pa * 1e-3,
        conditions.temperature_k
    );
    for (key, area) in
        [("leak_to_atmosphere", conditions.leak_to_atmosphere_m2), ("leak_from_supply", conditions.leak_from_supply_m2)]
    {
        if area > 0.0 {
            let _ = writeln!(text, "{key} = \"{:.4} mm2\"", mm2_from_m2(area));
        }
    }
    let commands: Vec<String> = plan
        .run
        .commands
        .iter()
        .map(|edge| format!("{{ at = \"{:.3} s\", close = {} }}", edge.time_s, edge.closes()))
        .collect();
    let _ = writeln!(text, "commands = [ {} ]\nend = \"{:.3} s\"", commands.join(", "), plan.run.end_s);
    text
}

fn discrepancy_document(found: &ModelDiscrepancy) -> DiscrepancyDocument<'_> {
    let numbers = found.effect.parameters().iter().zip(&found.parameter_sigmas).map(|(parameter, sigma)| {
        let number = CustomParameter { value: parameter.value, standard_error: *sigma, unit: &parameter.unit };
        (parameter.name.as_str(), number)
    });
    DiscrepancyDocument {
        acts_on: found.axis.target.id(),
        along: found.axis.variable,
        table: TableDocument { at: &found.knots, value: &found.values, standard_error: &found.sigmas },
        custom: CustomDocument {
            acts_on: found.effect.target().id(),
            formula: found.effect.formula().source(),
            parameters: numbers.collect(),
        },
        toml: effect_toml(found),
        log_evidence_gain: found.gain,
        with_custom: BothErrors::new(&found.errors, found.held_out.as_ref()),
    }
}

/// The custom effect as it is pasted into a valve file.
pub fn effect_toml(found: &ModelDiscrepancy) -> String {
    let effect = &found.effect;
    // Writing to a string cannot fail.
    let mut text = format!(
        "[[effect]]\nkind = \"custom\"\nname = \"{}\"\nacts_on = \"{}\"\nformula = \"{}\"\n[effect.parameters]\n",
        effect.name(),
        effect.target().id(),
        effect.formula().source()
    );
    for parameter in effect.parameters() {
        let _ = writeln!(
            text,
            "{} = {{ start = {:.6e}, lower = {:.3e}, upper = {:.3e}, unit = \"{}\" }}",
            parameter.name, parameter.value, parameter.lower, parameter.upper, parameter.unit
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_at_odds_with_all_others_is_told_with_what_repairs_it() {
        let odd = LeftOut {
            run: "third.csv".to_owned(),
            repair: None,
            ambient_pa: 101_325.0,
            stated_rmse_m: 1.9e-3,
            others_rmse_m: 5e-5,
        };
        let words = slip(&odd);
        let expected = "third.csv: the model that explains the other runs to 0.050 mm is off by 1.900 mm in this one, and no other pressure";
        assert!(words.starts_with(expected), "{words}");
        assert_eq!(correction(&odd), "third.csv: what was recorded or noted wrongly in it");
        let repair = Repair {
            condition: Condition::LeakToAtmosphere,
            stated: 0.0,
            right: 0.15e-6,
            in_place_of: Some((Condition::LeakFromSupply, 0.2e-6)),
            right_rmse_m: 6e-5,
        };
        let of_other_kind = LeftOut { repair: Some(repair), ..odd.clone() };
        assert_eq!(
            correction(&of_other_kind),
            "third.csv: leak_from_supply 0.200 mm2 should be leak_to_atmosphere of about 0.150 mm2"
        );
        let words = slip(&of_other_kind);
        let expected = "third.csv: under the leak from supply that was written down (0.200 mm2) an error of 1.900 mm is left, where the \
                        other runs leave 0.050 mm; under a leak to atmosphere of about 0.150 mm2 it would be explained as well, to 0.060 mm";
        assert!(words.starts_with(expected), "{words}");
        let forgotten = Repair { in_place_of: None, ..repair };
        let forgotten = LeftOut { repair: Some(forgotten), ..odd };
        assert_eq!(correction(&forgotten), "third.csv: leak_to_atmosphere none should be about 0.150 mm2");
    }
}
