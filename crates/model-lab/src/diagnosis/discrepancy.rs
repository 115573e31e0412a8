//! The model discrepancy: where a force or a flow sits that no effect of the catalogue explains, and a formula for it.
//!
//! A free-form table (straight lines between knots) along one axis at a time is fitted together with parameters and
//! nuisances. Those that are most likely name the place; short formulas that start from their shape are then fitted, and
//! the most likely one that also predicts what was held out becomes a ready custom effect.

use identify::held_out::{OwnFits, folds, held_out};
use identify::normal::Linearised;
use identify::select::{Level, Model};
use identify::variance::{Effort as Thoroughness, components, evidence};
use identify::{Difference, Differences, Fit, FitOptions, Problem, fit};
use rayon::prelude::*;
use valve_model::custom::{CustomEffect, CustomParameter, CustomTarget, VARIABLE_NAMES, Variables};
use valve_model::orifice::CHOKED_FLOW;

use super::DiagnoseOptions;
use super::answer::{MovedParameter, NuisanceReport};
use super::report::nuisance_reports;
use super::uncertainty::{Certainty, moved_parameters};
use crate::errors::{self, Errors};
use crate::identification::{Catalogue, Setup, ValveProblem};
use crate::space::Space;

/// Numbers that steer the search: each bounds what is fitted, and with it the time.
struct Effort {
    /// Knots of a table: the finest shape that is looked for is a twelfth of the axis.
    knots: usize,
    /// Tables that are followed to formulas, the likeliest first.
    followed: usize,
    /// Formulas of each table that are fitted a little.
    begun: usize,
    /// Rounds of such a fit; its noise is that of its table.
    begun_rounds: usize,
    /// Formulas of each table that are fitted to the end.
    finished: usize,
    /// Rounds in which a table is fitted with a noise that is annealed, and then settled: it only has to show a place and a
    /// shape.
    table_rounds: (usize, usize),
}

const EFFORT: Effort = Effort { knots: 13, followed: 2, begun: 6, begun_rounds: 3, finished: 3, table_rounds: (3, 1) };

/// The largest force that a table or a formula may have, share of the largest of spring and weight; one that is larger is
/// no detail that a model lacks.
const LARGEST_FORCE: f64 = 0.2;

/// The same of a flow, share of what the solenoid passes at most.
const LARGEST_FLOW: f64 = 0.3;

/// Speed up to which an axis of speed goes, in mean speeds of a stroke: a piston is about twice as fast in its midst.
const FASTEST: f64 = 2.0;

/// Time since the last command up to which an axis of time goes, share of the longest record, in whose rest nothing moves.
const LONGEST: f64 = 0.6;

/// Narrowest feature of a formula, share of its axis: beyond that one reading decides.
const NARROWEST: f64 = 0.02;

/// Wave lengths that waves start with, shares of the axis.
const WAVES: [f64; 3] = [0.2, 0.35, 0.6];

/// What a damping by the square of the speed starts with, and may be at most: its force at the largest speed, in largest
/// forces. It is only reached for an instant, so that it may be larger than those.
const DAMPING: (f64, f64) = (0.1, 20.0);

/// What a table lies along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axis {
    /// What it adds to.
    pub target: CustomTarget,
    /// The variable of the formula: "x" or "v" or "p_t".
    pub variable: &'static str,
}

const AXES: [Axis; 6] = [
    Axis { target: CustomTarget::Friction, variable: "x" },
    Axis { target: CustomTarget::Force, variable: "x" },
    Axis { target: CustomTarget::Friction, variable: "v" },
    Axis { target: CustomTarget::PipeFlow, variable: "x" },
    Axis { target: CustomTarget::ChamberFlow, variable: "x" },
    Axis { target: CustomTarget::PipeFlow, variable: "t_since_command" },
];

/// A discrepancy of the model that no effect of the catalogue explains.
#[derive(Debug, Clone)]
pub struct ModelDiscrepancy {
    /// The axis.
    pub axis: Axis,
    /// Knots of the table, SI.
    pub knots: Vec<f64>,
    /// Values of the table at the knots, N or kg/s.
    pub values: Vec<f64>,
    /// One standard deviation of each value.
    pub sigmas: Vec<f64>,
    /// The formula as a custom effect.
    pub effect: CustomEffect,
    /// One standard deviation of each of its parameters.
    pub parameter_sigmas: Vec<f64>,
    /// Gain of evidence over the model without it, nats.
    pub gain: f64,
    /// The error with the formula.
    pub errors: Errors,
    /// The error with the formula on what was held out.
    pub held_out: Option<Errors>,
    /// The valve file's parameters beside it.
    pub moved: Vec<MovedParameter>,
    /// What instruments and conditions are off by beside it.
    pub nuisances: Vec<NuisanceReport>,
    /// The recorded pressures that it leaves unexplained: [`errors::pressures_left`].
    pub pressures_left: Option<(f64, f64)>,
}

impl ModelDiscrepancy {
    /// The formula at a place along its axis, SI.
    pub fn formula_at(&self, at: f64) -> f64 {
        let values = VARIABLE_NAMES.map(|name| match name {
            name if name == self.axis.variable => at,
            // A formula along one axis has no other variable.
            _ => 0.0,
        });
        self.effect.formula().evaluate(&Variables { values: values.each_ref() }, &self.effect.operands())
    }
}

/// A table or a formula and everything fitted with it.
struct Tried<'a> {
    problem: ValveProblem<'a>,
    fit: Fit,
}

/// Finds where what is missing sits, on top of a model; nothing where no formula predicts what was held out better.
pub fn model_discrepancy<'a>(
    catalogue: &Catalogue<'a>,
    best: &Model<ValveProblem<'a>>,
    options: &DiagnoseOptions,
) -> Option<ModelDiscrepancy> {
    let setup = catalogue.subject.setup(Level::Low);
    let space = &best.problem.space;
    let scales = Scales::new(setup, space, &best.fit.u);
    let quick = FitOptions {
        annealed: EFFORT.table_rounds.0,
        settled: EFFORT.table_rounds.1,
        ..FitOptions::new(setup.groups.clone())
    };
    let tables: Vec<(Axis, Vec<f64>, CustomEffect)> = AXES
        .iter()
        .filter(|axis| !(setup.is_prescribed && axis.target == CustomTarget::PipeFlow))
        .filter_map(|axis| table(*axis, &scales).map(|(knots, effect)| (*axis, knots, effect)))
        .collect();
    let likely = foreseen(catalogue, best, tables, |(.., effect)| effect, &best.fit, EFFORT.followed);
    let tables: Vec<(Axis, Vec<f64>, Tried<'a>)> = likely
        .into_par_iter()
        .filter_map(|(axis, knots, effect)| {
            Some((axis, knots, tried(catalogue, best, &effect, Level::Low, &best.fit.u, &quick)?))
        })
        .collect();
    // What lies close to a fit needs no annealing.
    let near =
        |fit: &Fit| FitOptions { annealed: 0, known: Some(fit.noise.clone()), ..FitOptions::new(setup.groups.clone()) };
    let mut found: Option<ModelDiscrepancy> = None;
    for (axis, knots, table) in tables {
        if catalogue.stop.is_asked() {
            break;
        }
        let (values, sigmas) = own(&table);
        let likely =
            foreseen(catalogue, best, shapes(axis, &knots, &values, &scales), |shape| shape, &table.fit, EFFORT.begun);
        let mut formulas: Vec<Tried<'a>> = likely
            .into_par_iter()
            .filter_map(|effect| {
                let options = FitOptions { settled: EFFORT.begun_rounds, ..near(&table.fit) };
                tried(catalogue, best, &effect, Level::Low, &table.fit.u, &options)
            })
            .collect();
        formulas.sort_by(|a, b| b.fit.log_evidence.total_cmp(&a.fit.log_evidence));
        formulas.truncate(EFFORT.finished);
        let finished: Vec<Tried<'a>> = formulas
            .into_par_iter()
            .filter_map(|one| {
                let effect = one.problem.space.custom_at(&one.fit.u).pop()?;
                tried(catalogue, best, &effect, Level::High, &one.fit.u, &near(&one.fit))
            })
            .collect();
        for one in finished {
            // A formula that was not held against what it had not seen is none.
            let place = Place { axis, knots: knots.clone(), values: values.clone(), sigmas: sigmas.clone() };
            let judged = judged(best, &one, place, &near(&one.fit), options);
            found = judged.filter(|_| !catalogue.stop.is_asked()).into_iter().chain(found).max_by(by_gain);
        }
    }
    found
}

/// What a formula that was found on top of some effects makes of the model without them; nothing where it predicts no better
/// what was held out.
pub fn without_effects<'a>(
    catalogue: &Catalogue<'a>,
    base: &Model<ValveProblem<'a>>,
    found: &ModelDiscrepancy,
    options: &DiagnoseOptions,
) -> Option<ModelDiscrepancy> {
    let fresh = FitOptions::new(catalogue.subject.setup(Level::Low).groups.clone());
    let low = tried(catalogue, base, &found.effect, Level::Low, &base.fit.u, &fresh)?;
    let effect = low.problem.space.custom_at(&low.fit.u).pop()?;
    let near = FitOptions { annealed: 0, known: Some(low.fit.noise.clone()), ..fresh };
    let high = tried(catalogue, base, &effect, Level::High, &low.fit.u, &near)?;
    let ModelDiscrepancy { axis, knots, values, sigmas, .. } = found.clone();
    judged(base, &high, Place { axis, knots, values, sigmas }, &near, options)
}

/// Where a table found something.
struct Place {
    axis: Axis,
    knots: Vec<f64>,
    values: Vec<f64>,
    sigmas: Vec<f64>,
}

fn by_gain(a: &ModelDiscrepancy, b: &ModelDiscrepancy) -> std::cmp::Ordering {
    a.gain.total_cmp(&b.gain)
}

/// A fitted formula on top of a model; nothing where it gains too little or predicts no better what was held out.
fn judged(
    on: &Model<ValveProblem<'_>>,
    formula: &Tried<'_>,
    place: Place,
    near: &FitOptions,
    options: &DiagnoseOptions,
) -> Option<ModelDiscrepancy> {
    let (problem, fit) = (&formula.problem, &formula.fit);
    let gain = fit.log_evidence - on.fit.log_evidence;
    if gain < options.select.accept {
        return None;
    }
    let held = held_out(problem, fit, &folds(problem), near, OwnFits::WhereShort);
    let model =
        Model { set: on.set.clone(), level: Level::High, problem: problem.clone(), fit: fit.clone(), held_out: held };
    let held = errors::held_out(&model);
    if let (Some(held), Some(before)) = (held, errors::held_out(on))
        && held.normalised_rms >= (1.0 - options.select.held_out_fall) * before.normalised_rms
    {
        return None;
    }
    let effect = problem.space.custom_at(&fit.u).pop()?;
    let (_, parameter_sigmas) = own(formula);
    let errors = Errors::of(problem, &fit.linear.residual);
    let certainty = Certainty::of_model(&model);
    let moved = moved_parameters(problem, fit, &certainty);
    let nuisances = nuisance_reports(&model, &certainty, &moved);
    let Place { axis, knots, values, sigmas } = place;
    Some(ModelDiscrepancy {
        axis,
        knots,
        values,
        sigmas,
        effect,
        parameter_sigmas,
        gain,
        errors,
        held_out: held,
        moved,
        nuisances,
        pressures_left: errors::pressures_left(&model, options.select.large),
    })
}

/// Of what adds a custom effect to a model the few that are most likely, the likeliest first: foreseen about a fit by its
/// derivatives and those of the effect's own parameters. The fit is of the model, or of one with another effect.
fn foreseen<T: Send>(
    catalogue: &Catalogue<'_>,
    best: &Model<ValveProblem<'_>>,
    all: Vec<T>,
    effect: impl Fn(&T) -> &CustomEffect + Sync,
    around: &Fit,
    most: usize,
) -> Vec<T> {
    let shared = best.problem.space.coordinates.len();
    let mut judged: Vec<(f64, T)> = all
        .into_par_iter()
        .filter_map(|one| {
            let space = best.problem.space.with_custom(effect(&one));
            let problem = catalogue.subject.problem(space, Level::Low, catalogue.stop);
            let u = carried(&problem, shared, &around.u);
            let nuisances = problem.nuisances.len();
            let (own, theirs) = (u.len() - nuisances, around.u.len() - nuisances);
            let steps: Vec<Difference> =
                problem.coordinates().iter().zip(&u).map(|(c, u)| c.step_at(*u, f64::INFINITY)).collect();
            let differences = Differences::new(problem.coordinates(), problem.records().len(), &u, &steps, shared..own);
            let predicted = problem.predict(&differences.points, &differences.requests);
            let mut linear = differences.linear(predicted)?;
            let place = |index: usize| match index {
                index if index < shared => Some(index),
                index if index >= theirs => Some(own + index - theirs),
                _ => None,
            };
            for (linear, columns) in linear.iter_mut().zip(&around.linear.columns) {
                let known = columns.iter().filter_map(|(index, column)| Some((place(*index)?, column.clone())));
                linear.columns.extend(known);
            }
            let groups = &catalogue.subject.setup(Level::Low).groups;
            let at = Linearised::new(&problem, u, linear);
            let noise = components(&problem, &at, groups, &around.noise, Thoroughness::Local);
            let likely = evidence(&problem, &at, &at.normal(&problem, &noise), groups, &noise);
            likely.is_finite().then_some((likely, one))
        })
        .collect();
    judged.sort_by(|a, b| b.0.total_cmp(&a.0));
    judged.truncate(most);
    judged.into_iter().map(|(_, one)| one).collect()
}

/// A point of a model with a custom effect: what it shares with a model at `from` is as it is there, the effect's own
/// parameters are where they start.
fn carried(problem: &ValveProblem<'_>, shared: usize, from: &[f64]) -> Vec<f64> {
    let mut start = problem.start();
    let nuisances = problem.nuisances.len();
    start[..shared].copy_from_slice(&from[..shared]);
    let own = start.len() - nuisances;
    start[own..].copy_from_slice(&from[from.len() - nuisances..]);
    start
}

/// Fits a custom effect on top of a model; what both have starts at `from`, a point of the model or of one with a custom
/// effect of its own.
fn tried<'a>(
    catalogue: &Catalogue<'a>,
    best: &Model<ValveProblem<'a>>,
    effect: &CustomEffect,
    level: Level,
    from: &[f64],
    options: &FitOptions,
) -> Option<Tried<'a>> {
    let space = best.problem.space.with_custom(effect);
    let shared = best.problem.space.coordinates.len();
    let problem = catalogue.subject.problem(space, level, catalogue.stop);
    let fit = fit(&problem, &carried(&problem, shared, from), options)?;
    Some(Tried { problem, fit })
}

/// Values and standard deviations of the last custom effect's parameters.
fn own(tried: &Tried<'_>) -> (Vec<f64>, Vec<f64>) {
    let space = &tried.problem.space;
    let Some(effect) = space.custom_at(&tried.fit.u).pop() else { return (Vec::new(), Vec::new()) };
    let first = space.coordinates.len() - effect.parameters().len();
    let certainty = Certainty::new(&tried.problem, &tried.fit);
    let values = effect.parameters().iter().map(|parameter| parameter.value).collect();
    let sigmas = (0..effect.parameters().len())
        .map(|index| {
            let coordinate = &space.coordinates[first + index];
            let variance = certainty.covariance()[(first + index, first + index)].max(0.0);
            (coordinate.value(1.0) - coordinate.value(0.0)).abs() * variance.sqrt()
        })
        .collect();
    (values, sigmas)
}

/// Sizes of the valve that tables and formulas are scaled with.
struct Scales {
    stroke_m: f64,
    fastest_m_per_s: f64,
    longest_s: f64,
    force_n: f64,
    flow_kg_per_s: f64,
}

impl Scales {
    fn new(setup: &Setup, space: &Space, u: &[f64]) -> Self {
        let p = space.base_at(u);
        let weight_n = p.moving_mass_kg * valve_model::params::STANDARD_GRAVITY_M_PER_S2;
        let spring_n = p.spring_stiffness_n_per_m * (p.stroke_m + p.preload_compression_m);
        let force_n = spring_n.max(weight_n);
        let zrt = p.compressibility * p.specific_gas_constant_j_per_kg_k * p.temperature_k;
        let flow_kg_per_s =
            CHOKED_FLOW * p.flow_coefficient * p.solenoid_orifice_area_m2 * p.supply_pressure_pa / zrt.sqrt();
        let longest_s = setup.recordings.iter().map(|run| run.run.end_s).fold(1.0, f64::max);
        Self {
            stroke_m: p.stroke_m,
            fastest_m_per_s: FASTEST * p.stroke_m / setup.travel_s,
            longest_s: LONGEST * longest_s,
            force_n,
            flow_kg_per_s,
        }
    }

    /// A typical size of what is added to a target.
    fn size(&self, target: CustomTarget) -> f64 {
        match target {
            CustomTarget::Force | CustomTarget::Friction => LARGEST_FORCE * self.force_n,
            CustomTarget::PipeFlow | CustomTarget::ChamberFlow => LARGEST_FLOW * self.flow_kg_per_s,
        }
    }

    /// The range of an axis.
    fn range(&self, variable: &str) -> (f64, f64) {
        match variable {
            "x" => (0.0, self.stroke_m),
            "v" => (-self.fastest_m_per_s, self.fastest_m_per_s),
            _ => (0.0, self.longest_s),
        }
    }
}

fn unit(target: CustomTarget) -> &'static str {
    match target {
        CustomTarget::Force | CustomTarget::Friction => "N",
        CustomTarget::PipeFlow | CustomTarget::ChamberFlow => "kg/s",
    }
}

fn lowest(target: CustomTarget, size: f64) -> f64 {
    // Friction cannot push.
    if target == CustomTarget::Friction { 0.0 } else { -size }
}

/// A table along an axis, all zero.
fn table(axis: Axis, scales: &Scales) -> Option<(Vec<f64>, CustomEffect)> {
    let (from, to) = scales.range(axis.variable);
    let spacing = (to - from) / (EFFORT.knots - 1) as f64;
    let knots: Vec<f64> = (0..EFFORT.knots).map(|i| from + spacing * i as f64).collect();
    let size = scales.size(axis.target);
    let names: Vec<String> = (0..EFFORT.knots).map(|i| format!("k{i}")).collect();
    let formula = format!("table({}, {from:e}, {to:e}, {})", axis.variable, names.join(", "));
    let parameters = (0..EFFORT.knots)
        .map(|i| CustomParameter {
            name: format!("k{i}"),
            value: 0.0,
            lower: lowest(axis.target, size),
            upper: size,
            unit: unit(axis.target).into(),
        })
        .collect();
    let effect = CustomEffect::new("unexplained", axis.target, &formula, parameters).ok()?;
    Some((knots, effect))
}

/// Formulas whose starting values follow the table.
fn shapes(axis: Axis, knots: &[f64], values: &[f64], scales: &Scales) -> Vec<CustomEffect> {
    let z = axis.variable;
    let size = scales.size(axis.target);
    let low = lowest(axis.target, size);
    let (from, to) = (knots[0], knots[knots.len() - 1]);
    let (width, spacing) = (to - from, knots[1] - knots[0]);
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let floor = sorted[sorted.len() / 3];
    let peak =
        (0..values.len()).max_by(|a, b| (values[*a] - floor).abs().total_cmp(&(values[*b] - floor).abs())).unwrap_or(0);
    let amount = |name: &str, value: f64| CustomParameter {
        name: name.into(),
        value: value.clamp(-size, size),
        lower: -size,
        upper: size,
        unit: unit(axis.target).into(),
    };
    let level = |value: f64| CustomParameter { lower: low, value: value.clamp(low, size), ..amount("level", value) };
    let axis_unit = match z {
        "x" => "m",
        "v" => "m/s",
        _ => "s",
    };
    let place = |name: &str, value: f64, lower: f64, upper: f64| CustomParameter {
        name: name.into(),
        value: value.clamp(lower, upper),
        lower,
        upper,
        unit: axis_unit.into(),
    };
    let centre = |value: f64| place("centre", value, from, to);
    let wide = |value: f64| place("width", value, NARROWEST * width, width);
    let (first, last) = (values[0], values[values.len() - 1]);
    let rise = values[peak] - floor;
    let bump = format!("level + height*exp(-(({z} - centre)/width)^2)");
    let step = format!("level + height/(1 + exp(-({z} - centre)/width))");
    let slope = (last - first) / width;
    let mut forms: Vec<(String, Vec<CustomParameter>)> = vec![
        ("level".into(), vec![level(values.iter().sum::<f64>() / values.len() as f64)]),
        (format!("level + height*({z} - ({from:e}))/{width:e}"), vec![level(first), amount("height", slope * width)]),
        (bump.clone(), vec![level(floor), amount("height", rise), centre(knots[peak]), wide(1.2 * spacing)]),
        (bump, vec![level(floor), amount("height", rise), centre(knots[peak]), wide(2.5 * spacing)]),
        (step.clone(), vec![level(first), amount("height", last - first), centre(from + 0.5 * width), wide(spacing)]),
        (step, vec![level(first), amount("height", last - first), centre(from + 0.3 * width), wide(0.5 * spacing)]),
        (
            format!("level + height*exp(-({z} - ({from:e}))/width)"),
            vec![level(last), amount("height", first - last), wide(2.0 * spacing)],
        ),
        (
            format!("level + height*exp(({z} - ({to:e}))/width)"),
            vec![level(first), amount("height", last - first), wide(2.0 * spacing)],
        ),
    ];
    let wave = format!("level + height*sin(2*3.141592653589793*({z} - centre)/width)");
    if z == "x" {
        // What is met on the way, such as a second spring or a bumper, pushes back in proportion to the way since then.
        for side in [1.0, -1.0] {
            let (met, rate) = bend(knots, values, side);
            let formula = if side > 0.0 { "rate*max(0, x - centre)" } else { "rate*max(0, centre - x)" };
            let rate = CustomParameter {
                value: rate.clamp(-size / spacing, size / spacing),
                lower: if low < 0.0 { -size / spacing } else { 0.0 },
                upper: size / spacing,
                unit: format!("{}/m", unit(axis.target)),
                name: "rate".into(),
            };
            forms.push((formula.into(), vec![rate.clone(), centre(met)]));
            forms.push((format!("level + {formula}"), vec![level(floor), rate, centre(met)]));
        }
    }
    for share in WAVES {
        forms.push((
            wave.clone(),
            vec![level(floor), amount("height", rise), centre(knots[peak] - 0.25 * share * width), wide(share * width)],
        ));
    }
    if z == "v" {
        let damping = CustomParameter {
            name: "damping".into(),
            value: DAMPING.0 * size / to.powi(2),
            lower: 0.0,
            upper: DAMPING.1 * size / to.powi(2),
            unit: String::new(),
        };
        forms.push(("damping*v^2".into(), vec![damping.clone()]));
        forms.push(("damping*v^2*max(0, sign(v))".into(), vec![damping.clone()]));
        forms.push(("damping*v^2*max(0, -sign(v))".into(), vec![damping]));
        forms.push(("level*max(0, -sign(v))".into(), vec![level(first)]));
        forms.push(("level*max(0, sign(v))".into(), vec![level(last)]));
    }
    forms
        .into_iter()
        .filter_map(|(formula, parameters)| CustomEffect::new("unexplained", axis.target, &formula, parameters).ok())
        .collect()
}

/// The knot where a line that is level on one side of it, and straight on the other (1 beyond it, -1 before it), comes closest to
/// values, and its slope there.
fn bend(knots: &[f64], values: &[f64], side: f64) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let inner = &knots[1..knots.len() - 1];
    let fits = inner.iter().map(|at| {
        let way: Vec<f64> = knots.iter().map(|knot| (side * (knot - at)).max(0.0)).collect();
        let middle = way.iter().sum::<f64>() / count;
        let (both, own) = way.iter().zip(values).fold((0.0, 0.0), |(both, own), (way, value)| {
            (both + (way - middle) * (value - mean), own + (way - middle).powi(2))
        });
        // What a slope takes of the variance of the values.
        (both * both / own, *at, both / own)
    });
    fits.max_by(|a, b| a.0.total_cmp(&b.0)).map_or((knots[0], 0.0), |(_, at, slope)| (at, slope))
}

#[cfg(test)]
mod tests {
    use super::bend;

    #[test]
    fn a_bend_is_found_where_it_is() {
        let knots: Vec<f64> = (0..13).map(f64::from).collect();
        let before: Vec<f64> = knots.iter().map(|x| 7.0 + 3.0 * (4.0 - x).max(0.0)).collect();
        let (at, rate) = bend(&knots, &before, -1.0);
        assert!((at - 4.0).abs() < 1e-12 && (rate - 3.0).abs() < 1e-12, "{at} {rate}");
        let beyond: Vec<f64> = knots.iter().map(|x| -2.0 * (x - 9.0).max(0.0)).collect();
        let (at, rate) = bend(&knots, &beyond, 1.0);
        assert!((at - 9.0).abs() < 1e-12 && (rate + 2.0).abs() < 1e-12, "{at} {rate}");
    }
}
