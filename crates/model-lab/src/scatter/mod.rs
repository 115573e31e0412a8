//! How strokes scatter from one to the next, and what that does to every test.
//!
//! Each unit (a run, or a row of stroke times) has a few nuisance directions D: what its record would
//! change by if the solenoid answered a little later, or the preload, the flow or the supply were a
//! little off in this one stroke. With their variances S the residuals of a unit have the covariance
//! 1 + D S D' in units of the sensor noise. Variances come from the repeats of a campaign, whatever the
//! model; where nothing was repeated, they can only be supposed from what a model leaves.

mod directions;
mod of_repeats;
mod supposed;

use directions::layout;
use nalgebra::{DMatrix, DVector, DVectorView};
use rayon::prelude::*;
use valve_model::ParameterId;

use crate::data::Dataset;
use crate::fit::Fit;

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

impl Source {
    /// Its name, with the unit of its size where that is no share.
    pub fn name(self) -> &'static str {
        match self {
            Self::CloseDelay => "closing delay (s)",
            Self::OpenDelay => "opening delay (s)",
            Self::Parameter(id) => id.key(),
            Self::Supply => "supply pressure",
        }
    }
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

/// Flow through the solenoid alone, and through every orifice.
const FLOWS: [Source; 2] =
    [Source::Parameter(ParameterId::SolenoidOrificeArea), Source::Parameter(ParameterId::FlowCoefficient)];

/// A variance below this, in units squared, is none.
const LEAST_VARIANCE: f64 = 1e-3;

/// Rounds of expectation and maximisation.
const EM_ROUNDS: usize = 300;

/// Where the scatter of a dataset is known from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// It is not; the sensor noise is all there is.
    Unknown,
    /// From strokes that were repeated.
    Repeats,
    /// From what a model leaves of strokes of which none was repeated.
    Supposed,
}

impl Origin {
    /// Its name in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Repeats => "repeats",
            Self::Supposed => "supposed",
        }
    }
}

/// The scatter of a dataset from stroke to stroke.
#[derive(Debug, Clone)]
pub struct Scatter {
    units: Vec<UnitScatter>,
    common: Option<Common>,
    /// Variance of each source in its units squared; zero for all where repeats are missing or agree.
    pub variances: [f64; SOURCES.len()],
    /// Where they are known from.
    pub origin: Origin,
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
    /// No scatter that is known of: the sensor noise is all there is.
    pub fn unknown(data: &Dataset) -> Self {
        let stroke = |(start, end): (usize, usize)| UnitScatter {
            start,
            end,
            directions: DMatrix::zeros(end - start, 0),
            kernel: None,
        };
        Self { units: layout(data).into_iter().map(stroke).collect(), ..Self::none() }
    }

    /// The same where strokes are not told apart.
    pub fn none() -> Self {
        Self { units: Vec::new(), common: None, variances: [0.0; SOURCES.len()], origin: Origin::Unknown }
    }

    /// Whether strokes are taken to scatter at all.
    pub fn is_known(&self) -> bool {
        self.origin != Origin::Unknown
    }

    /// How many strokes are told apart.
    pub fn stroke_count(&self) -> usize {
        self.units.len()
    }

    /// Scatter known from some repeats.
    #[cfg(test)]
    pub(crate) fn of_strokes(count: usize) -> Self {
        let unit = UnitScatter { start: 0, end: 0, directions: DMatrix::zeros(0, 0), kernel: None };
        Self { units: vec![unit; count], origin: Origin::Repeats, ..Self::none() }
    }

    /// The scatter of the same origin as it is seen through a model that fits better.
    #[must_use]
    pub fn seen_through(&self, data: &Dataset, model: &Fit) -> Self {
        match self.origin {
            Origin::Unknown => Self::unknown(data),
            Origin::Repeats => Self::estimate(data, &model.valve()),
            Origin::Supposed => Self::supposed(data, model),
        }
    }

    /// The scatter with these variances in the units of [`SOURCES`] squared; what is far below one is none.
    fn assemble(
        layout: &[(usize, usize)],
        directions: &[Vec<f64>],
        variances: [f64; SOURCES.len()],
        origin: Origin,
    ) -> Self {
        let variances = variances.map(|variance| if variance < LEAST_VARIANCE { 0.0 } else { variance });
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
        Self { units, common: None, variances, origin }.with_common()
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
        Self { units, common: None, variances: self.variances, origin: self.origin }.with_common()
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

    /// The logarithm of the determinant of 1 + D S D': what the likelihood of any residuals pays for the scatter.
    pub fn ln_determinant(&self) -> f64 {
        let active = self.active();
        let widths: f64 = active.iter().map(|source| self.variances[*source].ln()).sum();
        let kernels = self.units.iter().filter_map(|unit| unit.kernel.as_ref()?.clone().cholesky());
        kernels.map(|kernel| widths - kernel.ln_determinant()).sum()
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
        let stretches: Vec<(usize, usize)> = if self.units.iter().all(|unit| unit.kernel.is_none()) {
            (0..residual.len()).step_by(STRETCH).map(|from| (from, residual.len().min(from + STRETCH))).collect()
        } else {
            self.units.iter().map(|unit| (unit.start, unit.end)).collect()
        };
        let parts: Vec<_> = stretches
            .par_iter()
            .enumerate()
            .map(|(index, (start, end))| {
                let rows: Vec<&[f64]> = columns.iter().map(|column| &column[*start..*end]).collect();
                normal_part(&rows, &residual[*start..*end], self.units.get(index).filter(|unit| unit.kernel.is_some()))
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

    /// J'WJ and J'Wr of every stroke alone; nothing where strokes are not told apart.
    pub fn by_stroke(&self, columns: &[Vec<f64>], residual: &[f64]) -> Vec<(DMatrix<f64>, DVector<f64>)> {
        let part = |unit: &UnitScatter| {
            let rows: Vec<&[f64]> = columns.iter().map(|column| &column[unit.start..unit.end]).collect();
            normal_part(&rows, &residual[unit.start..unit.end], Some(unit))
        };
        self.units.par_iter().map(part).collect()
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

    /// What scatters, and one standard deviation of it, s or a share.
    pub fn sources(&self) -> impl Iterator<Item = (Source, f64)> {
        SOURCES.iter().zip(self.sizes()).filter(|(_, size)| *size > 0.0).map(|((source, _), size)| (*source, size))
    }

    /// The same in words.
    pub fn words(&self) -> String {
        let words: Vec<String> = self
            .sources()
            .map(|(source, size)| match source {
                Source::CloseDelay => format!("{:.1} ms of delay to close", size * 1e3),
                Source::OpenDelay => format!("{:.1} ms of delay to open", size * 1e3),
                Source::Parameter(id) => format!("{:.2} % of {}", size * 1e2, id.key()),
                Source::Supply => format!("{:.2} % of supply pressure", size * 1e2),
            })
            .collect();
        if words.is_empty() { "nothing".to_owned() } else { words.join(", ") }
    }

    /// One standard deviation of each source, in the units of [`SOURCES`] times their size (s, or a share).
    pub fn sizes(&self) -> [f64; SOURCES.len()] {
        core::array::from_fn(|source| self.variances[source].sqrt() * SOURCES[source].1)
    }
}

/// Rows of a Jacobian that are multiplied at once.
const STRETCH: usize = 2048;

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
