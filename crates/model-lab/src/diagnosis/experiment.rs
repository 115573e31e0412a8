//! The next experiment: the run on which two explanations differ most in units of noise (T-optimal discrimination).
//!
//! Each planned run is simulated with both fitted models. What the tolerated parameters could still
//! absorb, given what the data have said about them, is taken off (Atkinson and Fedorov, Biometrika
//! 62(1), 1975, with the posterior of the fit as prior).

use nalgebra::{DMatrix, DVector};
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{CommandEdge, Conditions, Prepared, Run, Start, Valve, simulate};

use crate::forward::{Predicted, record};
use crate::identification::Setup;
use crate::space::Space;

/// A planned run and how far it separates two explanations.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// What is special about it.
    pub purpose: String,
    /// The run.
    pub run: Run,
    /// Whether the chamber and pipe pressures should be recorded too.
    pub pressures: bool,
    /// Strokes under these conditions.
    pub replicates: usize,
    /// Expected difference of chi-squared between the two explanations.
    pub separation: f64,
}

/// Noise of a pressure channel that is to be added, Pa.
const ADDED_PRESSURE_NOISE_PA: f64 = 500.0;

/// Noise of a position channel that is to be added, m.
const ADDED_POSITION_NOISE_M: f64 = 1e-4;

/// What may be planned, and what it costs.
struct Plans {
    /// Supply pressures beyond those that were seen, gauge: a share of the lowest, and of the highest.
    supply: (f64, f64),
    /// The partial stroke is vented after this share of the closing time, well before the valve is shut.
    partial: f64,
    /// The short hold is this many partial strokes long: the valve has just shut.
    short_hold: f64,
    /// Area of the leak to atmosphere that is opened, share of the solenoid's, and that of the one from the supply in
    /// terms of it: both slow a stroke clearly and stall none.
    leak: (f64, f64),
    /// Strokes where one is replicated.
    replicates: usize,
    /// Cost of mounting pressure sensors, in strokes.
    sensors: f64,
}

const PLANS: Plans =
    Plans { supply: (0.85, 1.3), partial: 0.8, short_hold: 1.3, leak: (0.2, 0.5), replicates: 5, sensors: 5.0 };

/// Time between the samples that predictions are compared at, s: each stands for two of a usual recorder.
const SAMPLE_S: f64 = 2e-3;

/// Variance of a coordinate that is held, in units of its tolerance: none to speak of.
const HELD_VARIANCE: f64 = 1e-12;

/// Separation from which an experiment is expected to decide.
pub const DECISIVE: f64 = 20.0;

/// A fitted model: what an experiment is to tell from another.
#[derive(Debug, Clone, Copy)]
pub struct Hypothesis<'a> {
    /// Its parameters and effects.
    pub space: &'a Space,
    /// The optimum; the coordinates of the space come first.
    pub u: &'a [f64],
    /// Covariance of the coordinates.
    pub covariance: &'a DMatrix<f64>,
}

impl Hypothesis<'_> {
    fn valve(&self) -> Option<Valve> {
        self.space.valve(self.u)
    }

    /// Valves that the data leave open: one a standard deviation away along each axis of the covariance of the coordinates. To
    /// first order the squares of what they predict otherwise than the optimum add up to the variance of a prediction.
    pub fn spread(&self) -> Vec<Valve> {
        let count = self.space.coordinates.len();
        if self.covariance.nrows() < count {
            return Vec::new();
        }
        let axes = self.covariance.view((0, 0), (count, count)).into_owned().symmetric_eigen();
        let away = |axis: usize, sign: f64| {
            let size = sign * axes.eigenvalues[axis].max(0.0).sqrt();
            let moved = (0..count).map(|at| self.u[at] + size * axes.eigenvectors[(at, axis)]);
            self.space.valve(&moved.collect::<Vec<f64>>())
        };
        // A step that leads out of what a valve can be is taken the other way.
        (0..count).filter_map(|axis| away(axis, 1.0).or_else(|| away(axis, -1.0))).collect()
    }
}

/// The planned run that separates two models best; `noise_m` is one standard deviation of a position.
pub fn best_experiment(
    setup: &Setup,
    one: &Hypothesis<'_>,
    other: &Hypothesis<'_>,
    noise_m: Option<f64>,
) -> Option<Experiment> {
    let noise = noise_m.unwrap_or(ADDED_POSITION_NOISE_M);
    let has_pressures = setup.recordings.iter().any(crate::identification::setup::Recording::has_pressures);
    let mut plans = plans(setup, &one.valve()?);
    for plan in &mut plans {
        plan.separation = separation(plan, one, other, noise, has_pressures) * plan.replicates as f64;
    }
    // A run that needs another sensor or more strokes must be worth it.
    let worth = |plan: &Experiment| {
        let cost = if plan.pressures && !has_pressures { PLANS.sensors } else { 1.0 } * plan.replicates as f64;
        plan.separation / cost
    };
    plans.into_iter().max_by(|a, b| worth(a).total_cmp(&worth(b)))
}

fn plans(setup: &Setup, valve: &Valve) -> Vec<Experiment> {
    let p = valve.parameters();
    let nominal = Conditions::nominal(p);
    let gauge = |conditions: &Conditions| conditions.supply_pressure_pa - p.ambient_pressure_pa;
    let seen: Vec<Conditions> = setup.recordings.iter().map(|unit| unit.run.conditions).collect();
    let lowest = seen.iter().map(gauge).fold(gauge(&nominal), f64::min);
    let highest = seen.iter().map(gauge).fold(gauge(&nominal), f64::max);
    let at = |gauge: f64| Conditions { supply_pressure_pa: p.ambient_pressure_pa + gauge, ..nominal };
    let (close, hold, rest) =
        if let Some(run) = setup.recordings.first().map(|unit| &unit.run).filter(|run| run.commands.len() > 1) {
            let edge = |close: bool| run.commands.iter().find(|edge| edge.closes() == close).map(|edge| edge.time_s);
            let (close, open) = (edge(true).unwrap_or(0.0), edge(false).unwrap_or(0.5 * run.end_s));
            (close, (open - close).abs(), run.end_s - open.max(close))
        } else {
            let cycle = setup.schedule;
            (cycle.close_at_s, cycle.open_at_s - cycle.close_at_s, cycle.end_s - cycle.open_at_s)
        };
    let stroke = |conditions: Conditions, hold: f64| Run {
        conditions,
        commands: vec![CommandEdge::new(close, true), CommandEdge::new(close + hold, false)],
        end_s: close + hold + rest,
        prescribed: None,
        start: Start::Rest,
    };
    let half_way = closing_time(valve, &stroke(nominal, hold)).map_or(0.5 * hold, |time| PLANS.partial * time);
    let plan = |purpose: &str, run: Run, pressures: bool, replicates: usize| Experiment {
        purpose: purpose.into(),
        run,
        pressures,
        replicates,
        separation: 0.0,
    };
    let leak = PLANS.leak.0 * p.solenoid_orifice_area_m2;
    vec![
        plan("a lower supply pressure", stroke(at(PLANS.supply.0 * lowest), hold), false, 1),
        plan("a higher supply pressure", stroke(at(PLANS.supply.1 * highest), hold), false, 1),
        plan("a partial stroke, vented before the valve is shut", stroke(nominal, half_way), false, 1),
        plan("a short hold", stroke(nominal, PLANS.short_hold * half_way), false, 1),
        plan(
            "a leak to atmosphere opened",
            stroke(Conditions { leak_to_atmosphere_m2: leak, ..nominal }, hold),
            false,
            1,
        ),
        plan(
            "a leak from the supply opened",
            stroke(Conditions { leak_from_supply_m2: PLANS.leak.1 * leak, ..nominal }, hold),
            false,
            1,
        ),
        plan("the pressures recorded too", stroke(nominal, hold), true, 1),
        plan("a partial stroke with the pressures recorded too", stroke(nominal, half_way), true, 1),
        plan("repeats under the usual conditions", stroke(nominal, hold), false, PLANS.replicates),
    ]
}

fn closing_time(valve: &Valve, run: &Run) -> Option<f64> {
    let mut time = None;
    simulate(&[Prepared::new(valve, run, DEFAULT_STEP_S)], false, |_, nodes, _| {
        time = valve_model::stroke::strokes(valve, &run.commands, nodes).first().and_then(|stroke| stroke.time_s);
    });
    time
}

/// Records of a run under several valves, in units of the noise.
fn predictions(plan: &Experiment, valves: &[Valve], noise: f64, pressures: bool) -> Vec<Vec<f64>> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a run has far fewer samples")]
    let count = (plan.run.end_s / SAMPLE_S) as usize;
    let times: Vec<f64> = (0..count).map(|i| i as f64 * SAMPLE_S).collect();
    let runs: Vec<Prepared> = valves.iter().map(|valve| Prepared::new(valve, &plan.run, DEFAULT_STEP_S)).collect();
    let mut all = vec![Vec::new(); valves.len()];
    let mut predicted = Predicted::default();
    // Samples a millisecond apart, of which every second one stands for two.
    let weight = core::f64::consts::SQRT_2;
    simulate(&runs, pressures, |index, nodes, _| {
        record(&valves[index], nodes, &times, &mut predicted);
        all[index].extend(predicted.position_m.iter().map(|x| weight * x / noise));
        if pressures {
            let channels = predicted.chamber_pressure_pa.iter().chain(&predicted.pipe_pressure_pa);
            all[index].extend(channels.map(|p| weight * p / ADDED_PRESSURE_NOISE_PA));
        }
    });
    all
}

fn separation(plan: &Experiment, one: &Hypothesis<'_>, other: &Hypothesis<'_>, noise: f64, has_pressures: bool) -> f64 {
    let (Some(valve), Some(rival)) = (one.valve(), other.valve()) else { return 0.0 };
    let steps: Vec<f64> = one.space.coordinates.iter().zip(one.u).map(|(c, u)| c.step_at(*u)).collect();
    let mut valves = vec![valve.clone(), rival];
    for (index, step) in steps.iter().enumerate() {
        let mut u = one.u.to_vec();
        u[index] += step;
        valves.push(one.space.valve(&u).unwrap_or_else(|| valve.clone()));
    }
    let records = predictions(plan, &valves, noise, plan.pressures || has_pressures);
    let difference: Vec<f64> = records[1].iter().zip(&records[0]).map(|(b, a)| b - a).collect();
    let columns: Vec<Vec<f64>> = records[2..]
        .iter()
        .zip(&steps)
        .map(|(moved, step)| moved.iter().zip(&records[0]).map(|(b, a)| (b - a) / step).collect())
        .collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let count = columns.len();
    let known = one.covariance.view((0, 0), (count, count)).into_owned();
    let Some(mut information) = regular(known).try_inverse() else { return 0.0 };
    for i in 0..columns.len() {
        for j in 0..columns.len() {
            information[(i, j)] += dot(&columns[i], &columns[j]);
        }
    }
    let projection = DVector::from_iterator(columns.len(), columns.iter().map(|column| dot(column, &difference)));
    let absorbed = information.cholesky().map_or(0.0, |factor| projection.dot(&factor.solve(&projection)));
    (dot(&difference, &difference) - absorbed).max(0.0)
}

/// A covariance whose held coordinates, which have none, get a very small one.
fn regular(mut covariance: DMatrix<f64>) -> DMatrix<f64> {
    for index in 0..covariance.nrows() {
        if covariance[(index, index)] <= 0.0 {
            covariance[(index, index)] = HELD_VARIANCE;
        }
    }
    covariance
}
