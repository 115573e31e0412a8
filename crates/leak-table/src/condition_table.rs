//! Stroke times over severity, supply pressure and temperature.
//!
//! At each node of pressure and temperature the times are known at the same shares of the severity at
//! which the table ends there. Between the nodes they are polynomials of pressure and temperature
//! ([`lagrange`](crate::lagrange)), and so is the end. Over the severity they are then the monotone cubic of an
//! ordinary table: a worn valve is never told to stroke as a less worn one, whatever the conditions.

use std::ops::Range;

use crate::conditions::{Condition, ConditionRange, Conditions, ConditionsError};
use crate::curve::limited;
use crate::degradation::Degradation;
use crate::error::RowError;
use crate::lagrange::{Nodes, Weights};
use crate::manifest::{ConditionInfo, Limits};
use crate::stencil::Stencil;
use crate::stroke::{Monotone, Stroke};
use crate::timing::{SeverityAt, TimingCurve};

/// The most severities at one node.
pub const MOST_SHARES: usize = 64;
/// Places in each gap between two nodes at which the times must rise or fall as they do at the nodes.
const CHECKS_PER_GAP: usize = 4;

/// The stroke times at one node of pressure and temperature, over the severity.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeTimes {
    /// The last severity, at the share 1.
    pub end: f64,
    /// The closing time at each share, s.
    pub close_time_s: Vec<f64>,
    /// The opening time at each share, s.
    pub open_time_s: Vec<f64>,
}

/// A stroke time and how it changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeAndSlopes {
    /// The time, s.
    pub time_s: f64,
    /// By the severity, s per SI unit of it.
    pub by_severity: f64,
    /// By the supply pressure, s/Pa.
    pub by_supply_pressure: f64,
    /// By the temperature, s/K.
    pub by_temperature: f64,
}

/// Both stroke times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Times {
    /// The closing time.
    pub close: TimeAndSlopes,
    /// The opening time.
    pub open: TimeAndSlopes,
}

/// Both stroke times over the severity, at one set of conditions.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    close: TimingCurve,
    open: TimingCurve,
    stall: Option<f64>,
}

/// Stroke times of one degradation over its severity and the conditions of a cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct ConditionTable {
    degradation: Degradation,
    pressures: Nodes,
    temperatures: Nodes,
    shares: Vec<f64>,
    stencils: Vec<Stencil>,
    /// End of the severity at each node, temperatures within pressures.
    ends: Vec<f64>,
    /// Closing and opening time at each node and share.
    times_s: [Vec<f64>; 2],
    rising: [bool; 2],
    info: ConditionInfo,
}

/// A number and its derivatives by pressure and temperature.
type Dual = [f64; 3];

impl ConditionTable {
    /// From the nodes of pressure (Pa) and temperature (K), the shares of the end (from 0 to 1), and the times
    /// at each node, temperatures within pressures.
    ///
    /// # Errors
    /// If the numbers do not fit together, a time is no positive number, or one that the degradation moves
    /// is not strictly monotone at a node or between the nodes.
    pub fn new(
        degradation: &Degradation,
        pressures_pa: Vec<f64>,
        temperatures_k: Vec<f64>,
        shares: Vec<f64>,
        nodes: &[NodeTimes],
        info: ConditionInfo,
    ) -> Result<Self, RowError> {
        let counts = (pressures_pa.len(), temperatures_k.len(), nodes.len());
        let shape = || RowError::Grid { pressures: counts.0, temperatures: counts.1, nodes: counts.2 };
        let pressures = Nodes::new(pressures_pa).ok_or_else(shape)?;
        let temperatures = Nodes::new(temperatures_k).ok_or_else(shape)?;
        let knots = shares.len();
        let rises = shares.is_sorted_by(|a, b| a < b) && shares.first() == Some(&0.0) && shares.last() == Some(&1.0);
        let full = |node: &NodeTimes| node.close_time_s.len() == knots && node.open_time_s.len() == knots;
        if pressures.len() * temperatures.len() != nodes.len()
            || !rises
            || knots > MOST_SHARES
            || !nodes.iter().all(full)
        {
            return Err(shape());
        }
        for (index, node) in nodes.iter().enumerate() {
            if !(node.end > 0.0 && node.end.is_finite()) {
                let what = &degradation.severity;
                let row = index * knots + knots - 1;
                return Err(RowError::Severity {
                    row,
                    quantity: what.quantity.to_string(),
                    found: what.text(node.end),
                });
            }
        }
        let times_s = Stroke::ALL.map(|stroke| nodes.iter().flat_map(|node| node.times(stroke)).copied().collect());
        let mut table = Self {
            degradation: degradation.clone(),
            pressures,
            temperatures,
            stencils: Stencil::all(&shares),
            shares,
            ends: nodes.iter().map(|node| node.end).collect(),
            times_s,
            rising: [true; 2],
            info,
        };
        for stroke in Stroke::ALL {
            table.rising[stroke as usize] = table.check_nodes(stroke)?;
            table.check_between(stroke)?;
        }
        Ok(table)
    }

    /// What wears.
    pub fn degradation(&self) -> &Degradation {
        &self.degradation
    }

    /// The conditions that it covers.
    pub fn range(&self) -> ConditionRange {
        ConditionRange { supply_pressure_pa: self.pressures.range(), temperature_k: self.temperatures.range() }
    }

    /// The pressures of its nodes in Pa.
    pub fn pressures_pa(&self) -> &[f64] {
        self.pressures.at()
    }

    /// The temperatures of its nodes in K.
    pub fn temperatures_k(&self) -> &[f64] {
        self.temperatures.at()
    }

    /// The severities at which times are known, as shares of the end.
    pub fn shares(&self) -> &[f64] {
        &self.shares
    }

    /// What its builder knows about it.
    pub fn info(&self) -> &ConditionInfo {
        &self.info
    }

    /// The times at a node, in the order that [`new`](Self::new) took them.
    pub fn node(&self, index: usize) -> NodeTimes {
        let knots = self.shares.len();
        let times = |stroke: Stroke| self.times_s[stroke as usize][index * knots..(index + 1) * knots].to_vec();
        NodeTimes { end: self.ends[index], close_time_s: times(Stroke::Close), open_time_s: times(Stroke::Open) }
    }

    /// The number of nodes.
    pub fn node_count(&self) -> usize {
        self.ends.len()
    }

    /// The severity at which the table ends under these conditions.
    pub fn end(&self, conditions: &Conditions) -> Result<f64, ConditionsError> {
        Ok(self.place(conditions)?.sum(&self.ends)[0])
    }

    /// Both stroke times at a severity and how they change with it and with the conditions.
    ///
    /// Before 0 and beyond the end the times go on along straight lines of the severity, as
    /// [`TimingCurve::extrapolated_time_and_slope`] does.
    pub fn times(&self, severity: f64, conditions: &Conditions) -> Result<Times, ConditionsError> {
        let place = self.place(conditions)?;
        let end = place.sum(&self.ends);
        let share = severity / end[0];
        let last = self.shares.len() - 2;
        let piece = self.shares.partition_point(|knot| *knot <= share).saturating_sub(1).min(last);
        let time = |stroke| self.time(stroke, &place, piece, share, end);
        Ok(Times { close: time(Stroke::Close), open: time(Stroke::Open) })
    }

    /// The severity at a time of a stroke. For more than one, take a [`slice`](Self::slice).
    pub fn severity_at(
        &self,
        stroke: Stroke,
        time_s: f64,
        conditions: &Conditions,
    ) -> Result<SeverityAt, ConditionsError> {
        Ok(self.slice(conditions)?.curve(stroke).severity_at(time_s))
    }

    /// Both stroke times over the severity at one set of conditions.
    pub fn slice(&self, conditions: &Conditions) -> Result<Slice, ConditionsError> {
        let place = self.place(conditions)?;
        let end = place.sum(&self.ends)[0];
        let curve = |stroke: Stroke| {
            let knots = self.knots(stroke, &place, 0..self.shares.len());
            let mut times: Vec<f64> = knots[..self.shares.len()].iter().map(|knot| knot[0]).collect();
            // The nodes' rounding may make a time that stays go back by its last digit.
            for knot in 1..times.len() {
                times[knot] = self.onwards(stroke, times[knot - 1], times[knot]);
            }
            let severities = self.shares.iter().map(|share| share * end).collect();
            TimingCurve::new(severities, times, None, false).expect("shares rise, and times were just made monotone")
        };
        let stall = self.info.stall_share.map(|share| share * end);
        Ok(Slice { close: curve(Stroke::Close), open: curve(Stroke::Open), stall })
    }

    /// The weight of each node under some conditions.
    pub(crate) fn node_weights(&self, conditions: &Conditions) -> Result<Vec<f64>, ConditionsError> {
        let InterpolationPoint { pressure, temperature, counts } = self.place(conditions)?;
        let mut weights = Vec::with_capacity(self.ends.len());
        for by_pressure in &pressure.value[..counts.0] {
            weights.extend(temperature.value[..counts.1].iter().map(|by_temperature| by_pressure * by_temperature));
        }
        Ok(weights)
    }

    /// The severity at which the table ends at each node.
    pub(crate) fn ends(&self) -> &[f64] {
        &self.ends
    }

    /// How the slope at each knot follows from the times around it.
    pub(crate) fn stencils(&self) -> &[Stencil] {
        &self.stencils
    }

    /// A stroke's times at each node and share.
    pub(crate) fn nodes_s(&self, stroke: Stroke) -> &[f64] {
        &self.times_s[stroke as usize]
    }

    /// Whether a stroke slows down with wear.
    pub(crate) fn rises(&self, stroke: Stroke) -> bool {
        self.rising[stroke as usize]
    }

    /// Whether a stroke's time must move with wear.
    pub(crate) fn moves(&self, stroke: Stroke) -> bool {
        self.degradation.moves.stroke(stroke).is_some()
    }

    fn place(&self, conditions: &Conditions) -> Result<InterpolationPoint, ConditionsError> {
        self.range().check(conditions)?;
        Ok(self.place_unchecked(conditions))
    }

    fn place_unchecked(&self, conditions: &Conditions) -> InterpolationPoint {
        InterpolationPoint {
            pressure: self.pressures.weights(conditions.supply_pressure_pa),
            temperature: self.temperatures.weights(conditions.temperature_k),
            counts: (self.pressures.len(), self.temperatures.len()),
        }
    }

    /// One stroke's times at some of the shares; the others are left at 0.
    #[inline]
    fn knots(&self, stroke: Stroke, place: &InterpolationPoint, used: Range<usize>) -> [Dual; MOST_SHARES] {
        let mut sums = [[0.0; MOST_SHARES]; 3];
        place.add(&self.times_s[stroke as usize], self.shares.len(), used.clone(), &mut sums);
        let mut knots = [[0.0; 3]; MOST_SHARES];
        for knot in used {
            knots[knot] = std::array::from_fn(|d| sums[d][knot]);
        }
        knots
    }

    /// The later of two times if the stroke slows down with wear, else the earlier.
    #[inline]
    pub(crate) fn onwards(&self, stroke: Stroke, before_s: f64, time_s: f64) -> f64 {
        if self.rising[stroke as usize] { before_s.max(time_s) } else { before_s.min(time_s) }
    }

    /// One stroke's time within a piece: what [`MonotoneCubic`](crate::MonotoneCubic) does, with derivatives.
    fn time(&self, stroke: Stroke, place: &InterpolationPoint, piece: usize, share: f64, end: Dual) -> TimeAndSlopes {
        let (left, right) = (&self.stencils[piece], &self.stencils[piece + 1]);
        let used = left.first.min(piece.saturating_sub(1))
            ..(right.first + right.count).max((piece + 3).min(self.shares.len()));
        // A time that need not move is made monotone from its start on; the others are.
        let moves = self.degradation.moves.stroke(stroke).is_some();
        let from = if moves { used.start } else { 0 };
        let mut knots = self.knots(stroke, place, from..used.end);
        if !moves {
            for knot in from + 1..used.end {
                if self.onwards(stroke, knots[knot - 1][0], knots[knot][0]) != knots[knot][0] {
                    knots[knot] = knots[knot - 1];
                }
            }
        }
        let slope = |knot: usize| self.slope(stroke, &knots, knot);
        let width = self.shares[piece + 1] - self.shares[piece];
        let (low, high) = (knots[piece], knots[piece + 1]);
        let (start, finish) = (slope(piece), slope(piece + 1));
        let mut time: Dual = [0.0; 3];
        let by_share;
        if share <= 0.0 {
            by_share = start[0];
            time = std::array::from_fn(|d| low[d] + start[d] * share);
        } else if share >= 1.0 {
            by_share = finish[0];
            time = std::array::from_fn(|d| high[d] + finish[d] * (share - 1.0));
        } else {
            let u = (share - self.shares[piece]) / width;
            let mut slope_u = 0.0;
            for d in 0..3 {
                let rise = high[d] - low[d];
                let (c1, end_slope) = (start[d] * width, finish[d] * width);
                let (c2, c3) = (3.0 * rise - 2.0 * c1 - end_slope, c1 + end_slope - 2.0 * rise);
                time[d] = low[d] + u * (c1 + u * (c2 + u * c3));
                if d == 0 {
                    slope_u = c1 + u * (2.0 * c2 + u * 3.0 * c3);
                }
            }
            by_share = slope_u / width;
        }
        // The share itself changes with the conditions, since the end does.
        let share_by = |d: usize| -share * end[d] / end[0];
        TimeAndSlopes {
            time_s: time[0],
            by_severity: by_share / end[0],
            by_supply_pressure: time[1] + by_share * share_by(1),
            by_temperature: time[2] + by_share * share_by(2),
        }
    }

    /// The slope by the share at a knot, limited as a monotone cubic's is.
    #[inline]
    fn slope(&self, stroke: Stroke, knots: &[Dual; MOST_SHARES], knot: usize) -> Dual {
        let secant = |j: usize| -> Dual {
            let width = self.shares[j + 1] - self.shares[j];
            std::array::from_fn(|d| (knots[j + 1][d] - knots[j][d]) / width)
        };
        let flatter = match (knot.checked_sub(1), knot + 1 < self.shares.len()) {
            (Some(left), true) => {
                let (a, b) = (secant(left), secant(knot));
                if a[0].abs() <= b[0].abs() { a } else { b }
            }
            (Some(left), false) => secant(left),
            (None, _) => secant(0),
        };
        let raw: Dual = std::array::from_fn(|d| self.stencils[knot].sum(|j| knots[j][d]));
        let factor = limited(raw[0], flatter[0], self.rising[stroke as usize]);
        factor.map_or(raw, |factor| flatter.map(|part| factor * part))
    }

    /// Checks the times at every node; says whether they rise.
    fn check_nodes(&self, stroke: Stroke) -> Result<bool, RowError> {
        let knots = self.shares.len();
        let times = &self.times_s[stroke as usize];
        let strictly = self.degradation.moves.stroke(stroke).is_some();
        let change = |node: &[f64]| node[knots - 1] - node[0];
        let largest = times.chunks(knots).map(change).max_by(|a, b| a.abs().total_cmp(&b.abs()));
        let rising = largest.is_none_or(|change| change >= 0.0);
        for (node, times) in times.chunks(knots).enumerate() {
            for (knot, &found_s) in times.iter().enumerate() {
                let row = node * knots + knot;
                if !(found_s.is_finite() && found_s >= 0.0) {
                    return Err(RowError::Time { row, stroke, found_s });
                }
                let Some(&previous_s) = knot.checked_sub(1).map(|before| &times[before]) else { continue };
                let onwards = if rising { found_s - previous_s } else { previous_s - found_s };
                if onwards < 0.0 || (strictly && onwards == 0.0) {
                    return Err(RowError::NotMonotone { row, stroke, found_s, previous_s });
                }
            }
        }
        Ok(rising)
    }

    /// Checks that times which move are monotone between the nodes as well.
    fn check_between(&self, stroke: Stroke) -> Result<(), RowError> {
        if self.degradation.moves.stroke(stroke).is_none() {
            return Ok(());
        }
        let fine = |nodes: &Nodes| -> Vec<f64> {
            let places = |gap: &[f64]| {
                let (from, width) = (gap[0], gap[1] - gap[0]);
                (0..CHECKS_PER_GAP).map(move |i| from + width * i as f64 / CHECKS_PER_GAP as f64)
            };
            let inner = nodes.at().windows(2).flat_map(places).collect::<Vec<_>>();
            inner.into_iter().chain([nodes.range().1]).collect()
        };
        for supply_pressure_pa in fine(&self.pressures) {
            for temperature_k in fine(&self.temperatures) {
                let conditions = Conditions { supply_pressure_pa, temperature_k };
                let place = self.place_unchecked(&conditions);
                let knots = self.knots(stroke, &place, 0..self.shares.len());
                let times: Vec<f64> = knots[..self.shares.len()].iter().map(|knot| knot[0]).collect();
                let onwards =
                    |pair: &[f64]| if self.rising[stroke as usize] { pair[0] < pair[1] } else { pair[0] > pair[1] };
                if let Some(knot) = times.windows(2).position(|pair| !onwards(pair)) {
                    return Err(RowError::NotMonotoneBetween {
                        stroke,
                        share: self.shares[knot],
                        supply_pressure_pa,
                        temperature_k,
                    });
                }
            }
        }
        Ok(())
    }
}

impl NodeTimes {
    /// The times of one stroke.
    pub fn times(&self, stroke: Stroke) -> &[f64] {
        match stroke {
            Stroke::Close => &self.close_time_s,
            Stroke::Open => &self.open_time_s,
        }
    }
}

impl Times {
    /// The time of one stroke.
    pub fn stroke(&self, stroke: Stroke) -> &TimeAndSlopes {
        match stroke {
            Stroke::Close => &self.close,
            Stroke::Open => &self.open,
        }
    }
}

impl Slice {
    /// The time of one stroke over the severity.
    pub fn curve(&self, stroke: Stroke) -> &TimingCurve {
        match stroke {
            Stroke::Close => &self.close,
            Stroke::Open => &self.open,
        }
    }

    /// The severity from which on a stroke is not finished within the cycle, where that is known.
    pub fn stall_severity(&self) -> Option<f64> {
        self.stall
    }

    /// The severity at which life ends: the smallest at which a stroke takes longer than its limit, 0 if one does
    /// while the valve is sound. If none does inside the table, it is where the straight lines beyond the end
    /// reach a limit or a stroke is no longer finished, whatever comes first.
    pub fn limit_severity(&self, limits: &Limits) -> f64 {
        self.crossing(limits).unwrap_or_else(|| {
            let beyond = |stroke: Stroke| {
                let curve = self.curve(stroke);
                let rises = curve.direction() == Some(Monotone::Rising);
                rises
                    .then(|| curve.extrapolated_severity(limits.within_s(stroke)))
                    .filter(|severity| severity.is_finite())
            };
            let lines = Stroke::ALL.into_iter().filter_map(beyond);
            lines.chain(self.stall).reduce(f64::min).unwrap_or_else(|| self.close.range().1)
        })
    }

    /// The smallest severity inside the table at which a stroke takes longer than its limit.
    pub fn crossing(&self, limits: &Limits) -> Option<f64> {
        let crossing = |stroke: Stroke| {
            let (curve, limit_s) = (self.curve(stroke), limits.within_s(stroke));
            let (sound_s, _) = curve.end_times_s();
            if sound_s > limit_s {
                return Some(0.0);
            }
            match curve.severity_at(limit_s) {
                SeverityAt::Within(severity) if curve.direction() == Some(Monotone::Rising) => Some(severity),
                _ => None,
            }
        };
        Stroke::ALL.into_iter().filter_map(crossing).reduce(f64::min)
    }
}

/// Conditions as weights of the nodes.
struct InterpolationPoint {
    pressure: Weights,
    temperature: Weights,
    counts: (usize, usize),
}

impl InterpolationPoint {
    /// Adds up some of the `stride` numbers that each node has, with derivatives by pressure and temperature.
    #[inline]
    fn add(&self, numbers: &[f64], stride: usize, used: Range<usize>, sums: &mut [[f64; MOST_SHARES]; 3]) {
        let (pressures, temperatures) = self.counts;
        let mut nodes = numbers.chunks_exact(stride);
        for i in 0..pressures {
            for k in 0..temperatures {
                let Some(node) = nodes.next() else { return };
                let (pressure, temperature) = (self.pressure.value[i], self.temperature.value[k]);
                let weights = [
                    pressure * temperature,
                    self.pressure.derivative[i] * temperature,
                    pressure * self.temperature.derivative[k],
                ];
                for (sums, weight) in sums.iter_mut().zip(weights) {
                    for (sum, number) in sums[used.clone()].iter_mut().zip(&node[used.clone()]) {
                        *sum += weight * number;
                    }
                }
            }
        }
    }

    /// The sum over the nodes of a number that each has, with its derivatives.
    #[inline]
    fn sum(&self, numbers: &[f64]) -> Dual {
        let mut sums = [[0.0; MOST_SHARES]; 3];
        self.add(numbers, 1, 0..1, &mut sums);
        sums.map(|sum| sum[0])
    }
}

impl ConditionRange {
    /// Whether a table over this range varies with anything.
    #[must_use]
    pub fn varies_at_all(&self) -> bool {
        Condition::ALL.into_iter().any(|condition| self.varies(condition))
    }
}
