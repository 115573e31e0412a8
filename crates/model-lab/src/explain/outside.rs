//! When no effect of the catalogue explains the data: where the missing force or flow sits, and a
//! formula for it.
//!
//! A free-form table (straight lines between knots) along one axis at a time is fitted together with
//! the tolerated parameters. The table that predicts left-out conditions best names the place; short
//! formulas that start from its shape are then fitted, and the one that explains most for its number of
//! parameters becomes a ready custom effect.

use valve_model::custom::{CustomEffect, CustomParameter, CustomTarget, VARIABLE_NAMES, Variables};

use super::Watch;
use super::held_out::held_out_rms;
use super::impression::Impression;
use super::lack::lack_of_fit;
use super::view::{View, fits};
use crate::data::Dataset;
use crate::fit::{Fit, FitOptions, Task, fit, fit_all};
use crate::scatter::Scatter;
use crate::space::Space;

/// Knots of a table.
const KNOTS: usize = 13;

/// Penalty for each parameter of a formula (in chi-squared).
const PENALTY: f64 = 10.0;

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

/// What sits outside the catalogue.
#[derive(Debug, Clone)]
pub struct Outside {
    /// The axis that predicts left-out conditions best.
    pub axis: Axis,
    /// Knots of the table, SI.
    pub knots: Vec<f64>,
    /// Values of the table at the knots, N or kg/s.
    pub values: Vec<f64>,
    /// One standard deviation of each value.
    pub sigmas: Vec<f64>,
    /// Left-out error of the table, in units of the noise.
    pub table_held_out: Option<f64>,
    /// The formula as a custom effect.
    pub effect: CustomEffect,
    /// One standard deviation of each of its parameters.
    pub parameter_sigmas: Vec<f64>,
    /// Everything refitted with the formula.
    pub fit: Fit,
    /// Left-out error with the formula, in units of the noise.
    pub held_out: Option<f64>,
}

impl Outside {
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

/// Finds where what is missing sits, on top of a fit of the catalogue.
pub fn outside(view: &View, calibrated: &Fit, watch: &Watch<'_>) -> Option<Outside> {
    let (data, scatter) = (&view.rough, &view.scatter);
    let base = &view.roughly(calibrated);
    let scales = Scales::new(data, base);
    if watch.is_stopped() {
        return None;
    }
    // Left-out conditions decide between the two tables that explain most.
    let mut judged: Vec<_> = tables(&view.impression, base, &scales)
        .into_iter()
        .filter_map(|(axis, knots, fitted)| {
            let fitted = fit(data, scatter, &fitted.space, &fitted.u, table_options(3))?;
            let held_out = if watch.is_stopped() { None } else { held_out_rms(data, scatter, &fitted) };
            Some((axis, knots, fitted, held_out))
        })
        .collect();
    judged.sort_by(|a, b| a.3.unwrap_or(f64::MAX).total_cmp(&b.3.unwrap_or(f64::MAX)));
    let mut best: Option<Outside> = None;
    for (axis, knots, fitted, table_held_out) in judged {
        let custom = fitted.space.custom_at(&fitted.u);
        let values: Vec<f64> = custom[custom.len() - 1].parameters().iter().map(|parameter| parameter.value).collect();
        let first = base.u.len();
        let sigmas = (0..values.len())
            .map(|index| {
                let c = &fitted.space.coordinates[first + index];
                (c.value(1.0) - c.value(0.0)).abs() * fitted.sigma(first + index)
            })
            .collect();
        let bar = best.as_ref().map_or(f64::INFINITY, |best| best.fit.cost + PENALTY * 2.0);
        let start = &fitted.u[..first];
        let Some((fit, effect)) = formula(view, base, axis, (&knots, &values), start, &scales, bar, watch) else {
            continue;
        };
        let fit = view.finely(&fit);
        let effect = fit.space.custom_at(&fit.u).pop().unwrap_or(effect);
        let parameter_sigmas = (0..effect.parameters().len())
            .map(|index| {
                let c = &fit.space.coordinates[first + index];
                (c.value(1.0) - c.value(0.0)).abs() * fit.sigma(first + index)
            })
            .collect();
        let held_out = held_out_rms(&view.fine, scatter, &fit);
        let lack = lack_of_fit(&view.fine, &scatter.without_scatter(&fit.residual));
        best = Some(Outside { axis, knots, values, sigmas, table_held_out, effect, parameter_sigmas, fit, held_out });
        if lack < fits(scatter) {
            break;
        }
    }
    best
}

/// A table along an axis: its knots, and everything fitted with it.
type Table = (Axis, Vec<f64>, Fit);

fn table_options(steps: usize) -> FitOptions {
    FitOptions { steps, tolerance: 1.0, stall: 0.02 }
}

/// The tables that explain most of a first impression. All have as many knots.
fn tables(first: &Impression, base: &Fit, scales: &Scales) -> Vec<Table> {
    let Impression { data, scatter, .. } = first;
    let empty: Vec<(Axis, Vec<f64>, Space)> = AXES
        .iter()
        .filter_map(|axis| {
            let (knots, effect) = table(*axis, scales)?;
            Some((*axis, knots, base.space.with_custom(&effect)))
        })
        .collect();
    let tasks = empty.iter().map(|(_, _, space)| Task {
        space,
        start: extended(base, &space.start()),
        known: Vec::new(),
        options: table_options(2),
    });
    let fits = fit_all(data, scatter, tasks.collect());
    let mut tables: Vec<Table> =
        empty.iter().zip(fits).filter_map(|((axis, knots, _), fit)| Some((*axis, knots.clone(), fit?))).collect();
    keep_best(&mut tables, BETTER);
    let further = tables.iter().map(|(_, _, fit)| Task::from(fit, table_options(4)));
    let further = fit_all(data, scatter, further.collect());
    for (table, fit) in tables.iter_mut().zip(further) {
        table.2 = fit.unwrap_or_else(|| table.2.clone());
    }
    keep_best(&mut tables, BEST);
    tables
}

/// Keeps the tables that explain most.
fn keep_best(tables: &mut Vec<Table>, count: usize) {
    tables.sort_by(|a, b| a.2.cost.total_cmp(&b.2.cost));
    tables.truncate(count);
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
    fn new(data: &Dataset, base: &Fit) -> Self {
        let p = base.space.base_at(&base.u);
        let force_n = p.spring_stiffness_n_per_m * (p.stroke_m + p.preload_compression_m);
        let zrt = p.compressibility * p.specific_gas_constant_j_per_kg_k * p.temperature_k;
        let flow_kg_per_s = 0.685 * p.flow_coefficient * p.solenoid_orifice_area_m2 * p.supply_pressure_pa / zrt.sqrt();
        let longest_s = data.runs.iter().map(|run| run.run.end_s).fold(1.0, f64::max);
        Self {
            stroke_m: p.stroke_m,
            fastest_m_per_s: 4.0 * p.stroke_m,
            longest_s: 0.6 * longest_s,
            force_n,
            flow_kg_per_s,
        }
    }

    /// A typical size of what is added to a target.
    fn size(&self, target: CustomTarget) -> f64 {
        match target {
            CustomTarget::Force | CustomTarget::Friction => 0.2 * self.force_n,
            CustomTarget::PipeFlow | CustomTarget::ChamberFlow => 0.3 * self.flow_kg_per_s,
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

fn extended(base: &Fit, start: &[f64]) -> Vec<f64> {
    base.u.iter().copied().chain(start[base.u.len()..].iter().copied()).collect()
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
    let spacing = (to - from) / (KNOTS - 1) as f64;
    let knots: Vec<f64> = (0..KNOTS).map(|i| from + spacing * i as f64).collect();
    let size = scales.size(axis.target);
    let names: Vec<String> = (0..KNOTS).map(|i| format!("k{i}")).collect();
    let formula = format!("table({}, {from:e}, {to:e}, {})", axis.variable, names.join(", "));
    let parameters = (0..KNOTS)
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

/// The formula that explains most for its number of parameters, if its cost is below `bar`; the other
/// parameters start where the table left them.
#[expect(clippy::too_many_arguments, reason = "one step of the search above")]
fn formula(
    view: &View,
    base: &Fit,
    axis: Axis,
    (knots, values): (&[f64], &[f64]),
    start: &[f64],
    scales: &Scales,
    bar: f64,
    watch: &Watch<'_>,
) -> Option<(Fit, CustomEffect)> {
    let score = |fit: &Fit| fit.cost + PENALTY * (fit.u.len() - base.u.len()) as f64;
    let starts = shapes(axis, knots, values, scales).into_iter().map(|effect| {
        let space = base.space.with_custom(&effect);
        let own = space.start();
        let u: Vec<f64> = start.iter().chain(&own[start.len()..]).copied().collect();
        (space, u)
    });
    // All of them a little, the better ones further, the best ones to the end with all the data.
    let few = &view.impression;
    let mut at: Vec<(Space, Vec<f64>)> = starts.collect();
    for (steps, remain) in [(2, BETTER), (6, BEST)] {
        if watch.is_stopped() {
            return None;
        }
        let mut fits = fitted(&few.data, &few.scatter, &at, steps);
        fits.sort_by(|a, b| score(a).total_cmp(&score(b)));
        // What is left to explain on a few of the runs is the least of what is left on all.
        fits.retain(|first| first.cost < bar);
        // Starts of one formula that came to the same.
        let formula = |fit: &Fit| fit.space.custom_at(&fit.u).pop().map(|effect| effect.formula().source().to_owned());
        fits.dedup_by(|b, a| b.cost < SAME * a.cost && formula(a) == formula(b));
        at = fits.into_iter().take(remain).map(|fit| (fit.space, fit.u)).collect();
    }
    let finished = fitted(&view.rough, &view.scatter, &at, 12).into_iter();
    let best = finished.filter(|fit| fit.cost < bar).min_by(|a, b| score(a).total_cmp(&score(b)))?;
    let effect = best.space.custom_at(&best.u).pop()?;
    Some((best, effect))
}

/// Formulas fitted from where they are.
fn fitted(data: &Dataset, scatter: &Scatter, at: &[(Space, Vec<f64>)], steps: usize) -> Vec<Fit> {
    let options = FitOptions { steps, tolerance: 0.3, stall: 0.005 };
    let tasks = at.iter().map(|(space, u)| Task { space, start: u.clone(), known: Vec::new(), options });
    fit_all(data, scatter, tasks.collect()).into_iter().flatten().collect()
}

/// Times the cost of a fit up to which another of the same formula is taken for the same.
const SAME: f64 = 1.02;

/// How many tables, and formulas, go on after a first look, and to the end.
const BETTER: usize = 4;
const BEST: usize = 2;

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
    let wide = |value: f64| place("width", value, 0.02 * width, width);
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
    for share in [0.2, 0.35, 0.6] {
        forms.push((
            wave.clone(),
            vec![level(floor), amount("height", rise), centre(knots[peak] - 0.25 * share * width), wide(share * width)],
        ));
    }
    if z == "v" {
        let damping = CustomParameter {
            name: "damping".into(),
            value: 0.1 * size / to.powi(2),
            lower: 0.0,
            upper: 20.0 * size / to.powi(2),
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
