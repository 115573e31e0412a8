//! How strokes scatter from one to the next, and what that does to every test.
//!
//! Each unit (a run, or a row of stroke times) has a few nuisance directions D: what its record would
//! change by if the solenoid answered a little later, or the preload, the flow or the supply were a
//! little off in this one stroke. Their variances come from the repeats of a campaign alone; with them
//! the residuals of a unit have the covariance 1 + D S D' in units of the sensor noise.

use nalgebra::{DMatrix, DVector, DVectorView};
use rayon::prelude::*;
use valve_model::{CommandEdge, ParameterId, Valve};

use crate::data::Dataset;
use crate::forward::residuals;
use crate::repeats::{Repeats, repeats};

/// What scatters from stroke to stroke.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The command to close takes effect later.
    CloseDelay,
    /// The command to open takes effect later.
    OpenDelay,
    /// A parameter is off in this stroke.
    Parameter(ParameterId),
    /// The supply pressure is off in this stroke.
    Supply,
}

/// All sources that are looked for, with the size of one unit of each: 1 ms, or a share of 0.3 %. Of the two
/// flows, which are much alike, only the one counts that the repeats like better.
pub const SOURCES: [(Source, f64); 6] = [
    (Source::CloseDelay, 1e-3),
    (Source::OpenDelay, 1e-3),
    (Source::Parameter(ParameterId::PreloadCompression), 3e-3),
    (Source::Parameter(ParameterId::SolenoidOrificeArea), 3e-3),
    (Source::Parameter(ParameterId::FlowCoefficient), 3e-3),
    (Source::Supply, 3e-3),
];

/// The scatter of a dataset from stroke to stroke.
#[derive(Debug, Clone)]
pub struct Scatter {
    units: Vec<UnitScatter>,
    common: Option<Common>,
    /// Variance of each source in its units squared; zero for all where repeats are missing or agree.
    pub variances: [f64; SOURCES.len()],
    /// Whether the campaign has repeats to tell it from.
    pub is_known: bool,
}

/// Delays that all strokes share: a scatter of delays never goes below zero, so that it has a mean,
/// which must not be taken for a slow solenoid or a clock.
#[derive(Debug, Clone)]
struct Common {
    /// W G: the shared directions, weighted by the scatter of the single strokes.
    weighted: Vec<Vec<f64>>,
    /// (S^-1 + G' W G)^-1.
    kernel: DMatrix<f64>,
}

/// The mean of a delay that cannot be negative, in units of its scatter (that of a half-normal
/// distribution is 1.3).
const SHARED_DELAY: f64 = 1.5;

/// What one stretch of rows adds to J'WJ and J'Wr, with the scatter of its stroke alone.
fn normal_part(columns: &[&[f64]], residual: &[f64], unit: Option<&UnitScatter>) -> (DMatrix<f64>, DVector<f64>) {
    let n = columns.len();
    let mut matrix = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            matrix[(i, j)] = product(columns[i], columns[j]);
        }
    }
    matrix.fill_upper_triangle_with_lower_triangle();
    let mut vector = DVector::from_fn(n, |i, _| product(columns[i], residual));
    if let Some((unit, kernel)) = unit.and_then(|unit| Some((unit, unit.kernel.as_ref()?))) {
        let along: Vec<DVector<f64>> = columns.iter().map(|column| unit.along(column)).collect();
        let projected = DMatrix::from_fn(kernel.nrows(), n, |row, column| along[column][row]);
        let weighted = (kernel * &projected).transpose();
        matrix -= &weighted * &projected;
        vector -= weighted * unit.along(residual);
    }
    (matrix, vector)
}

/// The nuisance directions of one stretch of the residual vector.
#[derive(Debug, Clone)]
struct UnitScatter {
    start: usize,
    end: usize,
    /// Residual per unit of each source, `end - start` by sources.
    directions: DMatrix<f64>,
    /// (S^-1 + D'D)^-1; absent without scatter.
    kernel: Option<DMatrix<f64>>,
}

impl Scatter {
    /// No scatter: the sensor noise is all there is.
    pub fn none() -> Self {
        Self { units: Vec::new(), common: None, variances: [0.0; SOURCES.len()], is_known: false }
    }

    /// Estimates the scatter from the repeats of a dataset, with the directions of a valve that fits it
    /// (expectation and maximisation over the deviations from each group's mean).
    pub fn estimate(data: &Dataset, valve: &Valve) -> Self {
        let layout = layout(data);
        let groups = repeats(data);
        if groups.is_empty() {
            return Self::none();
        }
        let directions = directions(data, valve);
        let base = &residuals(data, core::slice::from_ref(valve))[0];
        // Deviations from the group's mean lose one degree of freedom in each group.
        let mut samples: Vec<Sample> = Vec::new();
        for Repeats { units, places } in &groups {
            let rows: Vec<Vec<usize>> = units
                .iter()
                .zip(places)
                .map(|(unit, places)| places.iter().map(|place| layout[*unit].0 + place.nearest()).collect())
                .collect();
            let repeats = units.len() as f64;
            let mean: Vec<f64> =
                (0..rows[0].len()).map(|i| rows.iter().map(|rows| base[rows[i]]).sum::<f64>() / repeats).collect();
            let share = 1.0 - 1.0 / repeats;
            for rows in &rows {
                let d = matrix(&directions, rows);
                let deviation =
                    DVector::from_iterator(rows.len(), rows.iter().zip(&mean).map(|(row, m)| base[*row] - m));
                samples.push(Sample { gram: d.transpose() * &d, projection: d.transpose() * deviation, share });
            }
        }
        let [solenoid, all_orifices] =
            FLOWS.map(|flow| likeliest(&samples, FLOWS.iter().find(|other| **other != flow)));
        let (mut variances, _) = if all_orifices.1 > solenoid.1 { all_orifices } else { solenoid };
        // What is far below a hundredth of a unit is nothing.
        for variance in &mut variances {
            if *variance < 1e-3 {
                *variance = 0.0;
            }
        }
        Self::assemble(&layout, &directions, variances)
    }

    fn assemble(layout: &[(usize, usize)], directions: &[Vec<f64>], variances: [f64; SOURCES.len()]) -> Self {
        let active: Vec<usize> = (0..SOURCES.len()).filter(|source| variances[*source] > 0.0).collect();
        let units: Vec<UnitScatter> = layout
            .iter()
            .map(|(start, end)| {
                let directions =
                    DMatrix::from_fn(end - start, active.len(), |row, column| directions[active[column]][start + row]);
                let mut precision = directions.transpose() * &directions;
                for (column, source) in active.iter().enumerate() {
                    precision[(column, column)] += 1.0 / variances[*source];
                }
                let kernel = if active.is_empty() { None } else { precision.try_inverse() };
                UnitScatter { start: *start, end: *end, directions, kernel }
            })
            .collect();
        Self { units, common: None, variances, is_known: true }.with_common()
    }

    /// The sources that do scatter, by index into [`SOURCES`]: those of the directions of every unit.
    fn active(&self) -> Vec<usize> {
        (0..SOURCES.len()).filter(|source| self.variances[*source] > 0.0).collect()
    }

    /// With what the delays of all strokes have in common.
    fn with_common(mut self) -> Self {
        let active = self.active();
        let is_delay = |source: usize| matches!(SOURCES[source].0, Source::CloseDelay | Source::OpenDelay);
        let shared: Vec<usize> = (0..active.len()).filter(|column| is_delay(active[*column])).collect();
        if shared.is_empty() {
            return self;
        }
        let length = self.units.last().map_or(0, |unit| unit.end);
        let directions: Vec<Vec<f64>> = shared
            .iter()
            .map(|column| {
                let mut direction = vec![0.0; length];
                for unit in &self.units {
                    direction[unit.start..unit.end].copy_from_slice(unit.directions.column(*column).as_slice());
                }
                direction
            })
            .collect();
        let weighted: Vec<Vec<f64>> = directions.iter().map(|direction| self.weighted(direction)).collect();
        let mut precision =
            DMatrix::from_fn(shared.len(), shared.len(), |row, column| product(&directions[row], &weighted[column]));
        for (index, column) in shared.iter().enumerate() {
            precision[(index, index)] += 1.0 / (SHARED_DELAY * SHARED_DELAY * self.variances[active[*column]]);
        }
        self.common = precision.try_inverse().map(|kernel| Common { weighted, kernel });
        self
    }

    /// The scatter of a campaign with only some of its units (runs, then groups of stroke times).
    #[must_use]
    pub fn only(&self, data: &Dataset, keep: impl Fn(usize) -> bool) -> Self {
        let rows = data.timing_groups.iter().enumerate();
        let groups = rows.flat_map(|(group, rows)| rows.rows.iter().map(move |_| data.runs.len() + group));
        let owners = (0..data.runs.len()).chain(groups);
        let mut units = Vec::new();
        let mut start = 0;
        for (unit, _) in self.units.iter().zip(owners).filter(|(_, owner)| keep(*owner)) {
            let end = start + unit.end - unit.start;
            units.push(UnitScatter { start, end, ..unit.clone() });
            start = end;
        }
        Self { units, common: None, variances: self.variances, is_known: self.is_known }.with_common()
    }

    /// W v with the scatter of the single strokes alone.
    fn weighted(&self, vector: &[f64]) -> Vec<f64> {
        let mut result = vector.to_vec();
        for unit in &self.units {
            let Some(amount) = unit.project(vector).and_then(|p| unit.weigh(&p)) else { continue };
            let part = &unit.directions * amount;
            for (value, part) in result[unit.start..unit.end].iter_mut().zip(part.iter()) {
                *value -= part;
            }
        }
        result
    }

    fn common_projection(&self, vector: &[f64]) -> Option<(DVector<f64>, &DMatrix<f64>)> {
        let common = self.common.as_ref()?;
        let products = common.weighted.iter().map(|column| product(column, vector));
        Some((DVector::from_iterator(common.weighted.len(), products), &common.kernel))
    }

    /// The weighted sum of products of two residual vectors: a' (1 + D S D')^-1 b.
    pub fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        let plain = product(a, b);
        let is_square = core::ptr::eq(a, b);
        let taken: f64 = self
            .units
            .iter()
            .filter_map(|unit| {
                let right = unit.project(b)?;
                let left = if is_square { right.clone() } else { unit.project(a)? };
                Some(left.dot(&unit.weigh(&right)?))
            })
            .sum();
        let shared = match (self.common_projection(a), self.common_projection(b)) {
            (Some((a, kernel)), Some((b, _))) => a.dot(&(kernel * b)),
            _ => 0.0,
        };
        plain - taken - shared
    }

    /// The weighted sum of squares of each unit of a dataset, without what all units share.
    pub fn dot_by_unit(&self, data: &Dataset, residual: &[f64]) -> Vec<f64> {
        layout(data)
            .into_iter()
            .enumerate()
            .map(|(index, (start, end))| {
                let plain = product(&residual[start..end], &residual[start..end]);
                let unit = self.units.get(index);
                let taken = unit.and_then(|unit| {
                    let projection = unit.project(residual)?;
                    Some(projection.dot(&unit.weigh(&projection)?))
                });
                plain - taken.unwrap_or(0.0)
            })
            .collect()
    }

    /// J'WJ and J'Wr for the columns of J.
    pub fn normal_equations(&self, columns: &[Vec<f64>], residual: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        let n = columns.len();
        // By stretches of rows that stay in the cache until every pair of columns has used them.
        let stretches: Vec<(usize, usize)> = if self.units.is_empty() {
            (0..residual.len()).step_by(STRETCH).map(|from| (from, residual.len().min(from + STRETCH))).collect()
        } else {
            self.units.iter().map(|unit| (unit.start, unit.end)).collect()
        };
        let parts: Vec<_> = stretches
            .par_iter()
            .enumerate()
            .map(|(index, (start, end))| {
                let rows: Vec<&[f64]> = columns.iter().map(|column| &column[*start..*end]).collect();
                normal_part(&rows, &residual[*start..*end], self.units.get(index))
            })
            .collect();
        let mut matrix = DMatrix::zeros(n, n);
        let mut vector = DVector::zeros(n);
        for (part, gradient) in parts {
            matrix += part;
            vector += gradient;
        }
        let shared: Vec<_> = columns.iter().filter_map(|column| self.common_projection(column)).collect();
        if let Some((target, _)) = self.common_projection(residual) {
            for i in 0..n {
                let weighted = shared[i].1 * &shared[i].0;
                for j in 0..n {
                    matrix[(i, j)] -= weighted.dot(&shared[j].0);
                }
                vector[i] -= weighted.dot(&target);
            }
        }
        (matrix, vector)
    }

    /// The residuals with the most likely scatter of each stroke taken out.
    pub fn without_scatter(&self, residual: &[f64]) -> Vec<f64> {
        let clean = self.weighted(residual);
        let (Some((projection, kernel)), Some(common)) = (self.common_projection(residual), &self.common) else {
            return clean;
        };
        let amount = kernel * projection;
        clean
            .iter()
            .enumerate()
            .map(|(i, value)| value - common.weighted.iter().zip(amount.iter()).map(|(w, a)| w[i] * a).sum::<f64>())
            .collect()
    }

    /// How far each source was off in each stroke, most likely, in the units of [`SOURCES`] times their
    /// size (s, or a share); empty where there is no scatter.
    pub fn strokes(&self, residual: &[f64]) -> Vec<[f64; SOURCES.len()]> {
        let active = self.active();
        self.units
            .iter()
            .map(|unit| {
                let mut off = [0.0; SOURCES.len()];
                if let Some(amount) = unit.project(residual).and_then(|p| unit.weigh(&p)) {
                    // A residual is data minus model: the data are off the other way.
                    for (value, source) in amount.iter().zip(&active) {
                        off[*source] = -value * SOURCES[*source].1;
                    }
                }
                off
            })
            .collect()
    }

    /// One standard deviation of the delay that differs most from stroke to stroke, s.
    pub fn largest_delay_s(&self) -> f64 {
        let delays = SOURCES.iter().zip(self.sizes());
        let delays = delays.filter(|((source, _), _)| matches!(source, Source::CloseDelay | Source::OpenDelay));
        delays.map(|(_, size)| size).fold(0.0, f64::max)
    }

    /// One standard deviation of each source, in the units of [`SOURCES`] times their size (s, or a share).
    pub fn sizes(&self) -> [f64; SOURCES.len()] {
        core::array::from_fn(|source| self.variances[source].sqrt() * SOURCES[source].1)
    }
}

/// Flow through the solenoid alone, and through every orifice.
const FLOWS: [Source; 2] =
    [Source::Parameter(ParameterId::SolenoidOrificeArea), Source::Parameter(ParameterId::FlowCoefficient)];

/// Rows of a Jacobian that are multiplied at once.
const STRETCH: usize = 2048;

/// Rounds of expectation and maximisation.
const EM_ROUNDS: usize = 300;

/// One stroke of a group of repeats, as it differs from their mean.
struct Sample {
    /// D'D.
    gram: DMatrix<f64>,
    /// D' times the deviation.
    projection: DVector<f64>,
    /// Share of the variance that a deviation from the mean has.
    share: f64,
}

/// The most likely variances of all sources but one, by expectation and maximisation (Dempster, Laird and
/// Rubin 1977), and the logarithm of their likelihood up to a constant.
fn likeliest(samples: &[Sample], without: Option<&Source>) -> ([f64; SOURCES.len()], f64) {
    let used: Vec<usize> = (0..SOURCES.len()).filter(|source| Some(&SOURCES[*source].0) != without).collect();
    let n = used.len();
    let part = |sample: &Sample| {
        let gram = DMatrix::from_fn(n, n, |i, j| sample.gram[(used[i], used[j])] / sample.share);
        (gram, DVector::from_fn(n, |i, _| sample.projection[used[i]] / sample.share))
    };
    let parts: Vec<(DMatrix<f64>, DVector<f64>, f64)> = samples
        .iter()
        .map(|sample| {
            let (gram, projection) = part(sample);
            (gram, projection, sample.share)
        })
        .collect();
    let freedom: f64 = samples.iter().map(|sample| sample.share).sum();
    let mut variances = vec![1.0; n];
    // A deviation from the mean scatters less by its share, and so does its sensor noise.
    let precision = |gram: &DMatrix<f64>, variances: &[f64], share: f64| {
        let mut precision = gram.clone();
        for (index, variance) in variances.iter().enumerate() {
            precision[(index, index)] += 1.0 / (variance * share).max(1e-12);
        }
        precision
    };
    for _ in 0..EM_ROUNDS {
        let mut sums = vec![0.0; n];
        for (gram, projection, share) in &parts {
            let Some(covariance) = precision(gram, &variances, *share).try_inverse() else { continue };
            let mean = &covariance * projection;
            for (index, sum) in sums.iter_mut().enumerate() {
                *sum += mean[index] * mean[index] + covariance[(index, index)];
            }
        }
        variances = sums.iter().map(|sum| sum / freedom).collect();
    }
    let likelihood = parts
        .iter()
        .filter_map(|(gram, projection, share)| {
            let cholesky = precision(gram, &variances, *share).cholesky()?;
            let explained = projection.dot(&cholesky.solve(projection));
            let widths: f64 = variances.iter().map(|variance| (variance * share).max(1e-12).ln()).sum();
            Some(0.5 * (explained - cholesky.ln_determinant() - widths))
        })
        .sum();
    let mut all = [0.0; SOURCES.len()];
    for (index, variance) in used.into_iter().zip(variances) {
        all[index] = variance;
    }
    (all, likelihood)
}

impl UnitScatter {
    fn project(&self, vector: &[f64]) -> Option<DVector<f64>> {
        self.kernel.as_ref()?;
        Some(self.along(&vector[self.start..self.end]))
    }

    /// Its rows of a vector along each direction.
    fn along(&self, rows: &[f64]) -> DVector<f64> {
        let rows = view(rows);
        let products = self.directions.column_iter().map(|direction| direction.dot(&rows));
        DVector::from_iterator(self.directions.ncols(), products)
    }

    fn weigh(&self, projected: &DVector<f64>) -> Option<DVector<f64>> {
        Some(self.kernel.as_ref()? * projected)
    }
}

fn view(values: &[f64]) -> DVectorView<'_, f64> {
    DVectorView::from_slice(values, values.len())
}

/// The sum of products of two vectors.
fn product(a: &[f64], b: &[f64]) -> f64 {
    view(a).dot(&view(b))
}

/// Start and end of each unit in the residual vector: runs, then single rows of stroke times.
fn layout(data: &Dataset) -> Vec<(usize, usize)> {
    let mut bounds = Vec::new();
    let mut start = 0;
    for run in &data.runs {
        bounds.push((start, start + run.block_count()));
        start += run.block_count();
    }
    for group in &data.timing_groups {
        for _ in &group.rows {
            bounds.push((start, start + 2));
            start += 2;
        }
    }
    bounds
}

/// Residual per unit of each source, over the whole residual vector.
fn directions(data: &Dataset, valve: &Valve) -> Vec<Vec<f64>> {
    let base = residuals(data, core::slice::from_ref(valve)).remove(0);
    SOURCES
        .iter()
        .map(|(source, size)| {
            let changed = match source {
                Source::CloseDelay | Source::OpenDelay => {
                    let close = *source == Source::CloseDelay;
                    let mut shifted = data.clone();
                    for run in &mut shifted.runs {
                        let edges: Vec<CommandEdge> =
                            run.run.commands.iter().map(|edge| later(edge, close, *size)).collect();
                        run.run.commands = edges;
                    }
                    let mut moved = residuals(&shifted, core::slice::from_ref(valve)).remove(0);
                    shift_timings(data, &mut moved, close, *size);
                    moved
                }
                Source::Parameter(id) => {
                    let mut parameters = valve.parameters().clone();
                    parameters.set(*id, parameters.get(*id) * (1.0 + size));
                    let changed =
                        Valve::new(parameters, valve.switches(), valve.effects().to_vec(), valve.custom().to_vec());
                    match changed {
                        Ok(changed) => residuals(data, &[changed]).remove(0),
                        Err(_) => base.clone(),
                    }
                }
                Source::Supply => {
                    let mut raised = data.clone();
                    for run in &mut raised.runs {
                        run.run.conditions.supply_pressure_pa *= 1.0 + size;
                    }
                    for group in &mut raised.timing_groups {
                        group.conditions.supply_pressure_pa *= 1.0 + size;
                    }
                    residuals(&raised, core::slice::from_ref(valve)).remove(0)
                }
            };
            changed.iter().zip(&base).map(|(changed, base)| changed - base).collect()
        })
        .collect()
}

fn later(edge: &CommandEdge, close: bool, by_s: f64) -> CommandEdge {
    let time_s = if edge.close == close { edge.time_s + by_s } else { edge.time_s };
    CommandEdge { time_s, ..*edge }
}

/// A delay lengthens the stroke times of its direction by just that.
fn shift_timings(data: &Dataset, residual: &mut [f64], close: bool, by_s: f64) {
    let first = residual.len() - 2 * data.timing_rows.len();
    let offset = usize::from(!close);
    for pair in residual[first..].chunks_mut(2) {
        pair[offset] -= by_s / data.timing_noise_s;
    }
}

/// Some rows of the directions.
fn matrix(directions: &[Vec<f64>], rows: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), directions.len(), |row, column| directions[column][rows[row]])
}
