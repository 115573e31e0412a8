//! Fewer points of a trace that keep its corners (Douglas and Peucker 1973, the largest error first).

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A deviation below this share of a column's range is not seen, even where a picture is zoomed into.
const UNSEEN: f64 = 2e-4;

/// A stretch between two points that are kept, and the point within it that straight lines miss most.
#[derive(Debug, PartialEq)]
struct Stretch {
    error: f64,
    from: usize,
    worst: usize,
    to: usize,
}

impl Eq for Stretch {}

impl Ord for Stretch {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error).then(other.from.cmp(&self.from))
    }
}

impl PartialOrd for Stretch {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The places of at most `count` points, rising, first and last among them: straight lines between them follow all columns
/// as closely as so few points can, each column in shares of its range. What is not a number is left out of a column.
pub fn corners(x: &[f64], columns: &[&[f64]], count: usize) -> Vec<usize> {
    let Some(last) = x.len().checked_sub(1) else { return Vec::new() };
    let scaled: Vec<(&[f64], f64)> =
        columns.iter().filter_map(|column| Some((*column, 1.0 / range(column)?))).collect();
    let stretch = |from: usize, to: usize| {
        let mut found = Stretch { error: UNSEEN, from, worst: from, to };
        for (column, scale) in &scaled {
            let (start, end) = (column[from], column[to]);
            let slope = (end - start) / (x[to] - x[from]);
            for place in from + 1..to {
                let value = column[place];
                // A gap begins or ends here: it is told from a line whatever its size.
                let error = if value.is_finite() && start.is_finite() && end.is_finite() {
                    (value - start - slope * (x[place] - x[from])).abs() * scale
                } else if value.is_finite() != column[place - 1].is_finite() {
                    1.0
                } else {
                    continue;
                };
                if error > found.error {
                    (found.error, found.worst) = (error, place);
                }
            }
        }
        (found.worst > from).then_some(found)
    };
    let mut kept = vec![0];
    if last > 0 {
        kept.push(last);
    }
    let mut open: BinaryHeap<Stretch> = stretch(0, last).into_iter().collect();
    while kept.len() < count {
        let Some(Stretch { from, worst, to, .. }) = open.pop() else { break };
        kept.push(worst);
        open.extend(stretch(from, worst));
        open.extend(stretch(worst, to));
    }
    kept.sort_unstable();
    kept
}

/// The range of a column's numbers; nothing where there are none or they are all the same.
fn range(column: &[f64]) -> Option<f64> {
    let finite = || column.iter().copied().filter(|value| value.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
    if high > low {
        return Some(high - low);
    }
    // One value and gaps: the gaps are seen.
    (high == low && column.iter().any(|value| !value.is_finite())).then_some(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_and_single_points_stay() {
        let x: Vec<f64> = (0..1000).map(f64::from).collect();
        let ramp: Vec<f64> = x.iter().map(|x| x.min(300.0)).collect();
        let mut spike = vec![0.0; 1000];
        spike[777] = 5.0;
        let kept = corners(&x, &[&ramp, &spike], 50);
        assert_eq!(kept, [0, 300, 776, 777, 778, 999]);
        assert!(corners(&x, &[&ramp, &spike], 4).len() == 4);
    }

    #[test]
    fn what_is_drawn_is_off_by_no_more_than_the_largest_point_left_out() {
        let x: Vec<f64> = (0..4000).map(|i| 1e-3 * f64::from(i)).collect();
        let y: Vec<f64> = x.iter().map(|t| (-t).exp() * (20.0 * t).sin()).collect();
        let kept = corners(&x, &[&y], 200);
        let worst = kept.windows(2).flat_map(|pair| pair[0]..pair[1]).fold(0.0, |worst: f64, at| {
            let next = kept[kept.partition_point(|place| *place <= at)];
            let before = kept[kept.partition_point(|place| *place <= at) - 1];
            let line = y[before] + (y[next] - y[before]) * (x[at] - x[before]) / (x[next] - x[before]);
            worst.max((y[at] - line).abs())
        });
        assert!(worst < 4e-3 && kept.len() <= 200, "{worst} with {}", kept.len());
        // Every twentieth point misses more.
        let even = (0..3980).fold(0.0, |worst: f64, at| {
            let (before, next) = (at / 20 * 20, at / 20 * 20 + 20);
            let line = y[before] + (y[next] - y[before]) * (x[at] - x[before]) / (x[next] - x[before]);
            worst.max((y[at] - line).abs())
        });
        assert!(worst < even, "{worst} for {even}");
    }

    #[test]
    fn gaps_stay_gaps() {
        let x: Vec<f64> = (0..100).map(f64::from).collect();
        let mut y = vec![1.0; 100];
        y[40..60].fill(f64::NAN);
        let kept = corners(&x, &[&y], 20);
        assert!(kept.contains(&40) && kept.contains(&60), "{kept:?}");
        assert_eq!(corners(&[1.0], &[&[2.0]], 10), [0]);
        assert!(corners(&[], &[&[]], 10).is_empty());
    }
}
