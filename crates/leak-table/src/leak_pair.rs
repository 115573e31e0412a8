//! Stroke times of a valve with leaks of both kinds at once.
//!
//! Either leak alone has an accurate table. The two together move a stroke as one of them does alone at some
//! *equivalent* severity, below zero where the other one has the upper hand. Over the two severities the
//! equivalent one is nearly a plane, also where a time rises steeply to where the stroke stalls. So a coarse grid
//! of simulated times is kept as equivalent severities, cubic in between, and goes on straight beyond
//! where both strokes are finished.

use std::ops::RangeInclusive;

use crate::error::RowError;
use crate::fault::Fault;
use crate::manifest::ConditionInfo;
use crate::stroke::Stroke;
use crate::table::SeverityTable;

/// Fewest and most places of a grid along one severity.
const PLACES: RangeInclusive<usize> = 4..=65;

/// The leak that each stroke slows down with, whose table is that of its equivalent severities.
const SLOWED_BY: [Fault; 2] = [Fault::Atmosphere, Fault::Supply];

/// Closing and opening time in s over a grid of the severities of both leaks.
#[derive(Clone, Debug, PartialEq)]
pub struct LeakPairTable {
    /// Severities of the leak to the atmosphere, then of that from the supply, m2: evenly from 0.
    areas_m2: [Vec<f64>; 2],
    /// Atmosphere by atmosphere; closing and opening time where both strokes are finished.
    times_s: Vec<Option<[f64; 2]>>,
    strokes: [Equivalents; 2],
    info: ConditionInfo,
}

/// The equivalent severities of one stroke over the grid.
#[derive(Clone, Debug, PartialEq)]
struct Equivalents {
    slowed_by: Fault,
    /// Severity of the other leak that undoes one of the slowing one near a sound valve.
    undoes: f64,
    /// At the places of the grid, m2.
    areas_m2: Vec<f64>,
}

/// What a stroke does with two leaks as it does with one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equivalent {
    /// The leak that alone does the same.
    pub fault: Fault,
    /// Its severity, m2.
    pub area_m2: f64,
    /// Its derivatives by the leaks to the atmosphere and from the supply.
    pub by: [f64; 2],
}

impl LeakPairTable {
    /// From times over a grid, atmosphere by atmosphere, none where a stroke is not finished, and the tables of the
    /// leaks alone: to the atmosphere, from the supply.
    ///
    /// # Errors
    /// If the severities do not rise evenly from 0, there are too few or too many, not every pair has its row, a
    /// time is not positive, or the sound valve has none.
    pub fn new(
        areas_m2: [Vec<f64>; 2],
        times_s: Vec<Option<[f64; 2]>>,
        tables: [&SeverityTable; 2],
        info: ConditionInfo,
    ) -> Result<Self, RowError> {
        let columns = areas_m2[1].len();
        let even = |areas: &[f64]| {
            let step = areas[areas.len() - 1] / (areas.len() - 1) as f64;
            step > 0.0 && areas.iter().enumerate().all(|(i, area)| (area - step * i as f64).abs() < 1e-5 * step)
        };
        let grid = areas_m2.iter().all(|areas| PLACES.contains(&areas.len()) && even(areas));
        let positive = times_s.iter().flatten().flatten().all(|time| time.is_finite() && *time > 0.0);
        if !grid || times_s.len() != areas_m2[0].len() * columns || !positive || times_s[0].is_none() {
            return Err(RowError::LeakGrid { rows: times_s.len() });
        }
        let strokes = Stroke::ALL.map(|stroke| Equivalents::new(stroke, &times_s, columns, tables));
        Ok(Self { areas_m2, times_s, strokes, info })
    }

    /// The severities of one leak in the grid, m2.
    pub fn areas_m2(&self, fault: Fault) -> &[f64] {
        &self.areas_m2[fault as usize]
    }

    /// Closing and opening time in s at the places of the grid, atmosphere by atmosphere; none where a stroke is
    /// not finished.
    pub fn times_s(&self) -> &[Option<[f64; 2]>] {
        &self.times_s
    }

    /// How accurate it is.
    pub fn info(&self) -> &ConditionInfo {
        &self.info
    }

    /// The same, known to be this accurate.
    #[must_use]
    pub fn with_info(self, info: ConditionInfo) -> Self {
        Self { info, ..self }
    }

    /// For each stroke the one leak that alone does the same as both. Beyond the grid it goes on straight. Times
    /// follow from the tables of the leaks alone, under whatever conditions.
    #[inline]
    pub fn equivalents(&self, areas_m2: [f64; 2]) -> [Equivalent; 2] {
        let slowing = self.slowing(areas_m2);
        let of = |stroke: usize| {
            let Equivalent { fault, area_m2, by } = slowing[stroke];
            if area_m2 >= 0.0 {
                return slowing[stroke];
            }
            let undoes = self.strokes[stroke].undoes;
            Equivalent { fault: fault.other(), area_m2: -undoes * area_m2, by: [-undoes * by[0], -undoes * by[1]] }
        };
        [of(0), of(1)]
    }

    /// For each stroke the severity of the leak that slows it down which alone does the same as both; below zero where
    /// the other one has the upper hand.
    #[inline]
    pub fn slowing(&self, areas_m2: [f64; 2]) -> [Equivalent; 2] {
        let along = [Along::new(&self.areas_m2[0], areas_m2[0]), Along::new(&self.areas_m2[1], areas_m2[1])];
        let columns = self.areas_m2[1].len();
        let of = |stroke: usize| {
            let Equivalents { slowed_by, areas_m2: values, .. } = &self.strokes[stroke];
            let (mut area, mut by) = (0.0, [0.0; 2]);
            for i in 0..4 {
                let row = &values[(along[0].first + i) * columns + along[1].first..][..4];
                let (mut inner, mut slope) = (0.0, 0.0);
                for (value, (weight, by)) in row.iter().zip(along[1].weight.iter().zip(along[1].slope)) {
                    inner += weight * value;
                    slope += by * value;
                }
                area += along[0].weight[i] * inner;
                by[0] += along[0].slope[i] * inner;
                by[1] += along[0].weight[i] * slope;
            }
            area += by[0] * along[0].beyond + by[1] * along[1].beyond;
            Equivalent { fault: *slowed_by, area_m2: area, by }
        };
        [of(0), of(1)]
    }
}

impl Equivalents {
    fn new(stroke: Stroke, times_s: &[Option<[f64; 2]>], columns: usize, tables: [&SeverityTable; 2]) -> Self {
        let slowed_by = SLOWED_BY[stroke as usize];
        let curve = |fault: Fault| tables[fault as usize].curve(stroke);
        let slope = |fault: Fault| curve(fault).extrapolated_time_and_slope(0.0).1.abs();
        let undoes = slope(slowed_by) / slope(slowed_by.other());
        let equivalent = |times: &[f64; 2]| {
            let alone = |fault: Fault| curve(fault).extrapolated_severity(times[stroke as usize]);
            let own = alone(slowed_by);
            if own >= 0.0 { own } else { -alone(slowed_by.other()).max(0.0) / undoes }
        };
        let known = times_s.iter().map(|times| times.as_ref().map(equivalent)).collect();
        Self { slowed_by, undoes, areas_m2: filled(known, columns) }
    }
}

/// The four places of a grid around one, with their weights (Lagrange) and the derivatives of these.
struct Along {
    first: usize,
    weight: [f64; 4],
    slope: [f64; 4],
    /// How far beyond the grid the place is.
    beyond: f64,
}

impl Along {
    #[inline]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place in a list")]
    fn new(areas: &[f64], area: f64) -> Self {
        let last = areas.len() - 1;
        let inside = area.clamp(0.0, areas[last]);
        let by_step = last as f64 / areas[last];
        let place = inside * by_step;
        let first = (place as usize).saturating_sub(1).min(last - 3);
        let a = place - first as f64;
        let [b, c, d] = [a - 1.0, a - 2.0, a - 3.0];
        let weight = [-b * c * d / 6.0, 0.5 * a * c * d, -0.5 * a * b * d, a * b * c / 6.0];
        let slope = [
            -(c * d + b * d + b * c) / 6.0,
            0.5 * (c * d + a * d + a * c),
            -0.5 * (b * d + a * d + a * b),
            (b * c + a * c + a * b) / 6.0,
        ];
        Self { first, weight, slope: slope.map(|slope| slope * by_step), beyond: area - inside }
    }
}

/// Puts in what is missing, ring by ring: on parabolas through three known places.
fn filled(mut known: Vec<Option<f64>>, columns: usize) -> Vec<f64> {
    let rows = known.len() / columns;
    loop {
        let at = |row: usize, column: usize| known[row * columns + column];
        let mut next = known.clone();
        for row in 0..rows {
            for column in (0..columns).filter(|column| at(row, *column).is_none()) {
                let line = |up: usize, left: usize| {
                    let back = |steps: usize| at(row.checked_sub(steps * up)?, column.checked_sub(steps * left)?);
                    let (near, far) = (back(1)?, back(2)?);
                    Some(back(3).map_or(2.0 * near - far, |farthest| 3.0 * (near - far) + farthest))
                };
                let lines: Vec<f64> = [line(1, 0), line(0, 1), line(1, 1)].into_iter().flatten().collect();
                if !lines.is_empty() {
                    next[row * columns + column] = Some(lines.iter().sum::<f64>() / lines.len() as f64);
                }
            }
        }
        if next == known {
            return known.into_iter().map(|area| area.unwrap_or(0.0)).collect();
        }
        known = next;
    }
}
