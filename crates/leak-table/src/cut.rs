//! Stroke times over the severity at one set of conditions, for a few looks.
//!
//! What a [`Slice`](crate::Slice) tells, without its inverse: only the knots around the severities that are asked for are
//! summed up over the nodes of the conditions, a few at a time for the processor's wide registers.

use std::cell::Cell;
use std::ops::Range;

use crate::condition_table::{ConditionTable, MOST_SHARES};
use crate::conditions::{Conditions, ConditionsError};
use crate::curve::limited;
use crate::stroke::Stroke;

/// Knots that are summed up together.
const TOGETHER: usize = 4;

/// Both stroke times of a degradation at one set of conditions.
#[derive(Debug)]
pub struct Cut<'t> {
    table: &'t ConditionTable,
    end: f64,
    /// Of each node of the conditions.
    weights: Vec<f64>,
    /// Closing times at the knots, then opening times; what is not known yet is 0.
    times_s: Vec<Cell<f64>>,
    /// Their derivatives by the share of the end alike; what is not known yet is not a number.
    slopes: Vec<Cell<f64>>,
    /// Which groups of knots are known, a bit each.
    known: [Cell<u32>; 2],
}

/// Every group of knots has its bit.
const _: () = assert!(MOST_SHARES.div_ceil(TOGETHER) <= u32::BITS as usize);

impl ConditionTable {
    /// Both stroke times over the severity at one set of conditions: quicker to make than a [`slice`](Self::slice), for a few
    /// looks.
    pub fn cut(&self, conditions: &Conditions) -> Result<Cut<'_>, ConditionsError> {
        let weights = self.node_weights(conditions)?;
        let end = weights.iter().zip(self.ends()).map(|(weight, end)| weight * end).sum();
        let knots = 2 * self.shares().len();
        Ok(Cut {
            table: self,
            end,
            weights,
            times_s: vec![Cell::new(0.0); knots],
            slopes: vec![Cell::new(f64::NAN); knots],
            known: [Cell::new(0), Cell::new(0)],
        })
    }
}

impl Cut<'_> {
    /// Closing and opening time in s at a severity, each with its derivative by it; beyond the ends along straight lines.
    #[inline]
    pub fn times_and_slopes(&self, severity: f64) -> [(f64, f64); 2] {
        let share = severity / self.end;
        let shares = self.table.shares();
        let piece = shares.partition_point(|knot| *knot <= share).saturating_sub(1).min(shares.len() - 2);
        Stroke::ALL.map(|stroke| {
            let (time, by_share) = self.time(stroke, piece, share);
            (time, by_share / self.end)
        })
    }

    /// A stroke's time and its derivative by the share of the end: what [`MonotoneCubic`](crate::MonotoneCubic) does.
    #[inline]
    fn time(&self, stroke: Stroke, piece: usize, share: f64) -> (f64, f64) {
        let shares = self.table.shares();
        let [start, finish] = [piece, piece + 1].map(|knot| self.slope(stroke, knot));
        let at = stroke as usize * shares.len() + piece;
        let (low, high) = (self.times_s[at].get(), self.times_s[at + 1].get());
        if share <= 0.0 {
            return (low + start * share, start);
        }
        if share >= 1.0 {
            return (high + finish * (share - 1.0), finish);
        }
        let width = shares[piece + 1] - shares[piece];
        let (rise, c1, end_slope) = (high - low, start * width, finish * width);
        let (c2, c3) = (3.0 * rise - 2.0 * c1 - end_slope, c1 + end_slope - 2.0 * rise);
        let u = (share - shares[piece]) / width;
        (low + u * (c1 + u * (c2 + u * c3)), (c1 + u * (2.0 * c2 + u * 3.0 * c3)) / width)
    }

    /// The derivative by the share of the end at a knot, limited as a monotone cubic's is. The times beside it are known then.
    #[inline]
    fn slope(&self, stroke: Stroke, knot: usize) -> f64 {
        let kept = &self.slopes[stroke as usize * self.table.shares().len() + knot];
        if kept.get().is_nan() {
            kept.set(self.new_slope(stroke, knot));
        }
        kept.get()
    }

    fn new_slope(&self, stroke: Stroke, knot: usize) -> f64 {
        let shares = self.table.shares();
        let stencil = &self.table.stencils()[knot];
        let used = stencil.first.min(knot.saturating_sub(1))
            ..(stencil.first + stencil.count).max((knot + 2).min(shares.len()));
        let times = self.known(stroke, used);
        let secant = |j: usize| (times[j + 1].get() - times[j].get()) / (shares[j + 1] - shares[j]);
        let flatter = match (knot.checked_sub(1), knot + 1 < shares.len()) {
            (Some(left), true) => {
                let (a, b) = (secant(left), secant(knot));
                if a.abs() <= b.abs() { a } else { b }
            }
            (Some(left), false) => secant(left),
            (None, _) => secant(0),
        };
        let raw = stencil.sum(|j| times[j].get());
        limited(raw, flatter, self.table.rises(stroke)).map_or(raw, |factor| factor * flatter)
    }

    /// A stroke's times, known at some of the knots.
    #[inline]
    fn known(&self, stroke: Stroke, used: Range<usize>) -> &[Cell<f64>] {
        let knots = self.table.shares().len();
        let times = &self.times_s[stroke as usize * knots..][..knots];
        let known = &self.known[stroke as usize];
        let wanted = used.start / TOGETHER..used.end.div_ceil(TOGETHER);
        if wanted.clone().all(|group| known.get() >> group & 1 == 1) {
            return times;
        }
        if !self.table.moves(stroke) {
            // The nodes' rounding may make a time that stays go back by its last digit.
            for group in 0..knots.div_ceil(TOGETHER) {
                self.sum(stroke, group, times);
            }
            for knot in 1..knots {
                times[knot].set(self.table.onwards(stroke, times[knot - 1].get(), times[knot].get()));
            }
            known.set(u32::MAX);
            return times;
        }
        for group in wanted.filter(|group| known.get() >> group & 1 == 0) {
            self.sum(stroke, group, times);
            known.set(known.get() | 1 << group);
        }
        times
    }

    /// Sums up the times of a group of knots over the nodes.
    #[inline]
    fn sum(&self, stroke: Stroke, group: usize, times: &[Cell<f64>]) {
        let first = (group * TOGETHER).min(times.len().saturating_sub(TOGETHER));
        let mut sums = [0.0; TOGETHER];
        for (weight, node) in self.weights.iter().zip(self.table.nodes_s(stroke).chunks_exact(times.len())) {
            for (sum, number) in sums.iter_mut().zip(&node[first..]) {
                *sum += weight * number;
            }
        }
        for (time, sum) in times[first..].iter().zip(sums) {
            time.set(sum);
        }
    }
}
