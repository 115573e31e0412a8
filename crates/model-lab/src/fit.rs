//! Nonlinear least squares in a [`Space`]: Levenberg (1944) and Marquardt (1963) with priors and bounds.
//!
//! The Jacobian comes from finite differences that follow the misfit at hand, because choking, contact and
//! sticking switch; all its columns are simulated side by side, and so are several dampings of each step. A
//! few steps share a Jacobian.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use valve_model::Valve;

use crate::data::Dataset;
use crate::forward::residuals;
use crate::scatter::Scatter;
use crate::space::Space;

/// When a fit ends.
#[derive(Debug, Clone, Copy)]
pub struct FitOptions {
    /// Most Jacobians; each is good for a few steps.
    pub steps: usize,
    /// It has converged when a step promises less than this (in chi-squared).
    pub tolerance: f64,
    /// It is given up when the steps of one Jacobian gain less than this share of what is above the noise; no
    /// step is tried that promises less than a tenth of that.
    pub stall: f64,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { steps: 30, tolerance: 0.02, stall: 2e-3 }
    }
}

/// The result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The space it was made in.
    pub space: Space,
    /// The best point found.
    pub u: Vec<f64>,
    /// Weighted sum of squared residuals.
    pub chi2: f64,
    /// chi-squared and priors together: what is minimised.
    pub cost: f64,
    /// Covariance of the coordinates (priors included).
    pub covariance: DMatrix<f64>,
    /// The residuals at the best point, in units of the noise.
    pub residual: Vec<f64>,
    /// Columns of the Jacobian of the residuals near the best point.
    pub jacobian: Arc<Vec<Vec<f64>>>,
    /// What a full step from the best point promises to take off the cost, to first order.
    pub promised: f64,
    /// Whether it ended because no step helps any more.
    pub converged: bool,
}

impl Fit {
    /// The valve at the best point.
    pub fn valve(&self) -> Valve {
        self.space.valve(&self.u).unwrap_or_else(|| unreachable!("a fit only visits possible valves"))
    }

    /// One standard deviation of a coordinate.
    pub fn sigma(&self, coordinate: usize) -> f64 {
        self.covariance[(coordinate, coordinate)].max(0.0).sqrt()
    }

    /// Root mean square of the residuals in units of the noise, scatter of strokes taken out.
    pub fn normalised_rms(&self, scatter: &Scatter) -> f64 {
        normalised_rms(&self.residual, scatter)
    }
}

/// Root mean square of residuals in units of the noise, scatter of strokes taken out.
pub fn normalised_rms(residual: &[f64], scatter: &Scatter) -> f64 {
    let clean = scatter.without_scatter(residual);
    (clean.iter().map(|value| value * value).sum::<f64>() / clean.len().max(1) as f64).sqrt()
}

/// The prior part of the cost at a point.
pub fn prior_cost(space: &Space, u: &[f64]) -> f64 {
    space
        .coordinates
        .iter()
        .zip(u)
        .filter_map(|(coordinate, u)| coordinate.prior.map(|(mean, sigma)| ((u - mean) / sigma).powi(2)))
        .sum()
}

/// Factors on the damping that are tried side by side in every step.
const DAMPINGS: [f64; 3] = [0.05, 1.0, 50.0];

/// Steps taken with one Jacobian, kept up to date by what the steps show (Broyden 1965).
const STEPS_PER_JACOBIAN: usize = 4;

/// Share of the promised gain from which on a Jacobian is good for another step.
const TRUSTED: f64 = 0.25;

/// Share of what a fit is given up for that a step must promise.
const NO_STEP: f64 = 0.1;

/// Damping that hardly damps.
const LEAST_DAMPING: f64 = 1e-9;

/// How much further the last move is carried on, beside the next step: along a curved valley every step
/// is as short as the last one.
const CARRIED_ON: [f64; 2] = [2.0, 8.0];

/// A fit to be made.
#[derive(Debug, Clone)]
pub struct Task<'a> {
    /// The space.
    pub space: &'a Space,
    /// Where it starts; what is out of bounds is moved to them.
    pub start: Vec<f64>,
    /// The first columns of the Jacobian, if they are known from a point close by.
    pub known: Vec<Vec<f64>>,
    /// When it ends.
    pub options: FitOptions,
}

impl<'a> Task<'a> {
    /// A fit carried on.
    pub fn from(fit: &'a Fit, options: FitOptions) -> Self {
        Self { space: &fit.space, start: fit.u.clone(), known: Vec::new(), options }
    }
}

/// Fits a space to a dataset from a starting point; nothing if that is no possible valve.
pub fn fit(data: &Dataset, scatter: &Scatter, space: &Space, start: &[f64], options: FitOptions) -> Option<Fit> {
    fit_with(data, scatter, space, start, Vec::new(), options)
}

/// The same with the Jacobian of a point close by, or its first columns.
pub fn fit_with(
    data: &Dataset,
    scatter: &Scatter,
    space: &Space,
    start: &[f64],
    known: Vec<Vec<f64>>,
    options: FitOptions,
) -> Option<Fit> {
    fit_all(data, scatter, vec![Task { space, start: start.to_vec(), known, options }]).pop()?
}

/// Memory that what is simulated side by side may take, bytes; of large campaigns less is done at a time.
pub const MOST_MEMORY: usize = 128 << 20;

/// Residual vectors that a fit holds beside its Jacobian: what is simulated for it, and its updates.
const VECTORS_BESIDE: usize = 8;

/// Makes several fits to one dataset side by side: what all of them want simulated next is simulated together,
/// which fills the lanes. Each comes out as if it were made alone; nothing where a start is no possible valve.
pub fn fit_all(data: &Dataset, scatter: &Scatter, mut tasks: Vec<Task<'_>>) -> Vec<Option<Fit>> {
    let widest = tasks.iter().map(|task| task.start.len()).max().unwrap_or(0) + VECTORS_BESIDE;
    let each = widest * data.residual_count() * size_of::<f64>();
    let together = (MOST_MEMORY / each.max(1)).max(1);
    let mut fits = Vec::with_capacity(tasks.len());
    while !tasks.is_empty() {
        let later = tasks.split_off(together.min(tasks.len()));
        fits.extend(fit_together(data, scatter, tasks));
        tasks = later;
    }
    fits
}

fn fit_together(data: &Dataset, scatter: &Scatter, tasks: Vec<Task<'_>>) -> Vec<Option<Fit>> {
    let mut fittings: Vec<Option<Fitting<'_>>> = tasks.into_iter().map(|task| Fitting::new(scatter, task)).collect();
    loop {
        let mut active: Vec<&mut Fitting<'_>> =
            fittings.iter_mut().flatten().filter(|fitting| !fitting.wanted.is_empty()).collect();
        if active.is_empty() {
            break;
        }
        let valves: Vec<Valve> = active.iter_mut().flat_map(|fitting| fitting.wanted.drain(..)).collect();
        let mut simulated = residuals(data, &valves).into_iter();
        let answers: Vec<Vec<Vec<f64>>> =
            active.iter().map(|fitting| simulated.by_ref().take(fitting.asked.count()).collect()).collect();
        active.into_par_iter().zip(answers).for_each(|(fitting, answers)| fitting.take(answers));
    }
    fittings.into_par_iter().map(|fitting| fitting.map(Fitting::finished)).collect()
}

/// A fit that is being made.
struct Fitting<'a> {
    scatter: &'a Scatter,
    space: &'a Space,
    options: FitOptions,
    at: Point,
    columns: Vec<Vec<f64>>,
    damping: f64,
    converged: bool,
    last_move: Option<Vec<f64>>,
    /// Jacobians used up, steps taken with this one, and the cost where it was made.
    jacobians: usize,
    age: usize,
    cost_then: f64,
    /// What it waits for.
    asked: Asked,
    /// The valves to simulate for it.
    wanted: Vec<Valve>,
}

/// What a fit waits for.
enum Asked {
    /// It has ended.
    Nothing,
    /// The point it starts from and columns of the Jacobian there.
    Start(Columns),
    /// All columns of the Jacobian.
    Jacobian(Columns),
    /// Steps, with the normal matrix that they come from, the least that they must gain and what is above the
    /// noise.
    Trials { trials: Vec<Trial>, matrix: DMatrix<f64>, tolerance: f64, above_noise: f64 },
}

/// Columns of a Jacobian that are asked for.
struct Columns {
    /// The differences; nothing where a column is no possible valve.
    steps: Vec<Option<f64>>,
}

impl Asked {
    /// How many valves are simulated for it.
    fn count(&self) -> usize {
        match self {
            Self::Nothing => 0,
            Self::Start(columns) => 1 + columns.count(),
            Self::Jacobian(columns) => columns.count(),
            Self::Trials { trials, .. } => trials.len(),
        }
    }
}

impl Columns {
    /// Columns of the Jacobian at a point, and the valves they need.
    fn new(space: &Space, u: &[f64], steps: &[f64], which: Range<usize>) -> (Self, Vec<Valve>) {
        let mut valves = Vec::with_capacity(which.len());
        let steps = which
            .map(|index| {
                let mut point = u.to_vec();
                point[index] += steps[index];
                valves.push(space.valve(&point)?);
                Some(steps[index])
            })
            .collect();
        (Self { steps }, valves)
    }

    fn count(&self) -> usize {
        self.steps.iter().flatten().count()
    }

    /// The columns, from what was simulated and the residuals at the point.
    fn filled(&self, simulated: Vec<Vec<f64>>, residual: &[f64]) -> Vec<Vec<f64>> {
        let mut simulated = simulated.into_iter();
        let mut columns: Vec<(Option<f64>, Vec<f64>)> = self
            .steps
            .iter()
            .map(|step| match step.and_then(|step| Some((step, simulated.next()?))) {
                Some((step, column)) => (Some(step), column),
                None => (None, vec![0.0; residual.len()]),
            })
            .collect();
        columns.par_iter_mut().for_each(|(step, column)| {
            if let Some(step) = step {
                let inverse = 1.0 / *step;
                for (value, at) in column.iter_mut().zip(residual) {
                    *value = (*value - at) * inverse;
                }
            }
        });
        columns.into_iter().map(|(_, column)| column).collect()
    }
}

impl<'a> Fitting<'a> {
    fn new(scatter: &'a Scatter, task: Task<'a>) -> Option<Self> {
        let Task { space, start, known, options } = task;
        let u = space.clamped(&start);
        let mut wanted = vec![space.valve(&u)?];
        let (columns, valves) = Columns::new(space, &u, &first_differences(space, &u), known.len()..u.len());
        wanted.extend(valves);
        Some(Self {
            scatter,
            space,
            options,
            at: Point { u, residual: Vec::new(), chi2: 0.0, cost: 0.0 },
            columns: known,
            damping: 1e-3,
            converged: false,
            last_move: None,
            jacobians: 0,
            age: 0,
            cost_then: 0.0,
            asked: Asked::Start(columns),
            wanted,
        })
    }

    /// Takes what it asked for, and asks for what it needs next, if anything.
    fn take(&mut self, mut simulated: Vec<Vec<f64>>) {
        match core::mem::replace(&mut self.asked, Asked::Nothing) {
            Asked::Nothing => {}
            Asked::Start(columns) => {
                let residual = simulated.remove(0);
                self.columns.extend(columns.filled(simulated, &residual));
                self.at = Point::with(self.scatter, self.space, core::mem::take(&mut self.at.u), residual);
                self.cost_then = self.at.cost;
                self.try_steps();
            }
            Asked::Jacobian(columns) => {
                self.columns = columns.filled(simulated, &self.at.residual);
                self.try_steps();
            }
            Asked::Trials { trials, matrix, tolerance, above_noise } => {
                let best = best_of(self.scatter, self.space, trials, simulated);
                self.step(best, &matrix, tolerance, above_noise);
            }
        }
    }

    /// Asks for the next steps, if any is worth it.
    fn try_steps(&mut self) {
        if self.jacobians >= self.options.steps {
            return;
        }
        let above_noise = self.at.cost - 1.2 * self.at.residual.len() as f64;
        let tolerance = self.options.tolerance.max(NO_STEP * self.options.stall * above_noise);
        let (matrix, gradient) = self.normal_equations();
        let trials =
            trials(self.space, &self.at.u, &matrix, &gradient, self.damping, self.last_move.as_deref(), tolerance);
        if trials.is_empty() {
            self.step(None, &matrix, tolerance, above_noise);
        } else {
            self.wanted = trials.iter().map(|trial| trial.valve.clone()).collect();
            self.asked = Asked::Trials { trials, matrix, tolerance, above_noise };
        }
    }

    /// Goes to the best of the steps tried, if it is better than where it is.
    fn step(&mut self, best: Option<(Trial, Point)>, matrix: &DMatrix<f64>, tolerance: f64, above_noise: f64) {
        let none_promised = best.is_none();
        let gain = best.as_ref().map_or(0.0, |(_, point)| self.at.cost - point.cost);
        let mut renew = self.age + 1 >= STEPS_PER_JACOBIAN;
        if let Some((trial, point)) = best.filter(|_| gain > 0.0) {
            self.damping = trial.damping.clamp(LEAST_DAMPING, 1e6);
            let moved: Vec<f64> = point.u.iter().zip(&self.at.u).map(|(to, from)| to - from).collect();
            let change: Vec<f64> = point.residual.iter().zip(&self.at.residual).map(|(to, from)| to - from).collect();
            renew |= gain < TRUSTED * trial.promised || gain < tolerance;
            if !renew {
                update(&mut self.columns, matrix, &moved, &change);
            }
            self.at = point;
            self.last_move = Some(moved);
        } else if self.age == 0 {
            if none_promised || self.damping > 1e6 {
                self.converged = true;
                return;
            }
            self.damping *= 1e3;
            self.jacobians += 1;
            return self.try_steps();
        } else {
            renew = true;
        }
        self.age += 1;
        if renew {
            self.converged = self.age == 1 && gain < tolerance;
            let gained = self.cost_then - self.at.cost;
            self.jacobians += 1;
            if self.converged || gained < self.options.stall * above_noise {
                return;
            }
            (self.age, self.cost_then) = (0, self.at.cost);
            if self.jacobians < self.options.steps {
                let differences = differences(self.space, &self.at.u, matrix, &self.at.residual);
                let all = 0..self.at.u.len();
                let (columns, valves) = Columns::new(self.space, &self.at.u, &differences, all);
                self.asked = Asked::Jacobian(columns);
                self.wanted = valves;
                return;
            }
        }
        self.try_steps();
    }

    /// The normal matrix and the gradient, with priors.
    fn normal_equations(&self) -> (DMatrix<f64>, DVector<f64>) {
        self.space.with_priors(&self.at.u, self.scatter.normal_equations(&self.columns, &self.at.residual))
    }

    fn finished(self) -> Fit {
        let (matrix, gradient) = self.normal_equations();
        let promised = damped_step(self.space, &self.at.u, &matrix, &gradient, LEAST_DAMPING)
            .map_or(0.0, |(_, promised)| promised.max(0.0));
        let covariance = inverse(&matrix);
        let Point { u, residual, chi2, cost } = self.at;
        let (space, jacobian, converged) = (self.space.clone(), Arc::new(self.columns), self.converged);
        Fit { space, u, chi2, cost, covariance, residual, jacobian, promised, converged }
    }
}

/// A point of a space that was simulated.
struct Point {
    u: Vec<f64>,
    residual: Vec<f64>,
    chi2: f64,
    cost: f64,
}

impl Point {
    fn with(scatter: &Scatter, space: &Space, u: Vec<f64>, residual: Vec<f64>) -> Self {
        let chi2 = scatter.dot(&residual, &residual);
        let cost = chi2 + prior_cost(space, &u);
        Self { u, residual, chi2, cost }
    }
}

/// A point to try next.
struct Trial {
    u: Vec<f64>,
    valve: Valve,
    damping: f64,
    promised: f64,
}

/// Steps of several dampings that promise enough, and the best of them with the last move carried on.
fn trials(
    space: &Space,
    u: &[f64],
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
    last_move: Option<&[f64]>,
    tolerance: f64,
) -> Vec<Trial> {
    let to = |step: &[f64], damping: f64, promised: f64| {
        let moved: Vec<f64> = u.iter().zip(step).map(|(u, step)| u + step).collect();
        let u = space.clamped(&moved);
        let valve = space.valve(&u)?;
        Some(Trial { u, valve, damping, promised })
    };
    let mut trials = Vec::new();
    for factor in DAMPINGS {
        let Some((step, promised)) = damped_step(space, u, matrix, gradient, damping * factor) else { continue };
        if promised <= tolerance {
            continue;
        }
        trials.extend(to(step.as_slice(), damping * factor, promised));
        if let (Some(last), true) = (last_move, factor == 1.0) {
            trials.extend(CARRIED_ON.iter().filter_map(|times| {
                let further: Vec<f64> = step.iter().zip(last).map(|(step, last)| step + times * last).collect();
                to(&further, damping * factor, promised)
            }));
        }
    }
    trials
}

/// The trial of the lowest cost.
fn best_of(scatter: &Scatter, space: &Space, trials: Vec<Trial>, simulated: Vec<Vec<f64>>) -> Option<(Trial, Point)> {
    let tried = trials.into_par_iter().zip(simulated).map(|(trial, residual)| {
        let point = Point::with(scatter, space, trial.u.clone(), residual);
        (trial, point)
    });
    let tried: Vec<(Trial, Point)> = tried.collect();
    tried.into_iter().min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))
}

/// Broyden's update of the Jacobian, with coordinates weighed by how much the residuals feel them.
fn update(columns: &mut [Vec<f64>], matrix: &DMatrix<f64>, moved: &[f64], change: &[f64]) {
    let weight = |index: usize| matrix[(index, index)] * moved[index];
    let length: f64 = (0..moved.len()).map(|index| weight(index) * moved[index]).sum();
    if length <= 0.0 {
        return;
    }
    let mut missed = change.to_vec();
    for (column, moved) in columns.iter().zip(moved) {
        for (missed, slope) in missed.iter_mut().zip(column) {
            *missed -= slope * moved;
        }
    }
    columns.par_iter_mut().enumerate().for_each(|(index, column)| {
        let share = weight(index) / length;
        for (slope, missed) in column.iter_mut().zip(&missed) {
            *slope += missed * share;
        }
    });
}

/// The differences of the first Jacobian: a visible share of each coordinate's width.
pub fn first_differences(space: &Space, u: &[f64]) -> Vec<f64> {
    space.coordinates.iter().zip(u).map(|(coordinate, u)| coordinate.step_at(*u)).collect()
}

/// Smallest share of the first difference that a later one is.
const FINEST: f64 = 0.02;

/// The differences of the next Jacobian: what the data can tell at the misfit at hand. Wider ones straddle
/// the corners of the strokes and of the cost near the optimum, narrower ones those of single steps.
fn differences(space: &Space, u: &[f64], matrix: &DMatrix<f64>, residual: &[f64]) -> Vec<f64> {
    let square: f64 = residual.iter().map(|value| value * value).sum::<f64>() / residual.len().max(1) as f64;
    let told = 2.0 * square.sqrt().max(1.0);
    first_differences(space, u)
        .iter()
        .enumerate()
        .map(|(index, first)| {
            let share = told / matrix[(index, index)].max(1e-12).sqrt() / first.abs();
            first * share.clamp(FINEST, 1.0)
        })
        .collect()
}

/// The damped Gauss-Newton step (priors are in the matrix and the gradient); a coordinate at a bound that pushes outwards stays.
/// Returns the step and the fall of the cost that it promises.
fn damped_step(
    space: &Space,
    u: &[f64],
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
) -> Option<(DVector<f64>, f64)> {
    let n = u.len();
    let b = -gradient;
    let mut free: Vec<bool> = vec![true; n];
    for _ in 0..=n {
        let mut system = matrix.clone();
        let mut right = b.clone();
        for index in 0..n {
            system[(index, index)] += damping * matrix[(index, index)].max(1e-6);
            if !free[index] {
                for other in 0..n {
                    system[(index, other)] = 0.0;
                    system[(other, index)] = 0.0;
                }
                system[(index, index)] = 1.0;
                right[index] = 0.0;
            }
        }
        let step = system.cholesky()?.solve(&right);
        let blocked = (0..n).find(|index| {
            let coordinate = &space.coordinates[*index];
            let target = u[*index] + step[*index];
            free[*index]
                && ((u[*index] <= coordinate.lower && target < coordinate.lower)
                    || (u[*index] >= coordinate.upper && target > coordinate.upper))
        });
        let Some(index) = blocked else {
            let promised = 2.0 * b.dot(&step) - (step.transpose() * matrix * &step)[(0, 0)];
            return Some((step, promised));
        };
        free[index] = false;
    }
    None
}

/// The inverse of a symmetric matrix that may be nearly singular.
pub fn inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    // A valve without tolerances has nothing to fit; the decomposition refuses an empty matrix.
    if matrix.is_empty() {
        return matrix.clone();
    }
    let eigen = matrix.clone().symmetric_eigen();
    let largest = eigen.eigenvalues.amax().max(1e-300);
    let inverted = eigen.eigenvalues.map(|value| if value > 1e-14 * largest { 1.0 / value } else { 1e14 / largest });
    &eigen.eigenvectors * DMatrix::from_diagonal(&inverted) * eigen.eigenvectors.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_valve_without_tolerances_has_an_empty_covariance() {
        let (matrix, gradient) = Scatter::none().normal_equations(&[], &[1.0, -2.0]);
        assert_eq!((matrix.shape(), gradient.len()), ((0, 0), 0));
        assert_eq!(inverse(&matrix).shape(), (0, 0));
    }
}
