//! The solenoid: when its spool starts, and where it is.

use crate::hidden::Spool;

/// A switching of the command: true lets the supply in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// When the command changes.
    pub at_s: f64,
    /// Close (true) or open (false).
    pub close: bool,
}

/// Position of the spool over time, piecewise linear, 0 venting and 1 filling.
#[derive(Debug, Clone)]
pub(crate) struct Travel {
    /// Corners: time, place, and the place just after where the spool jumps.
    corners: Vec<(f64, f64)>,
}

impl Travel {
    /// The spool's way through all edges, which are in order of time; venting before the first.
    pub fn new(edges: &[Edge], spool: Spool) -> Self {
        let mut corners: Vec<(f64, f64)> = vec![(f64::NEG_INFINITY, 0.0)];
        for edge in edges {
            let (delay, goal) = if edge.close { (spool.energise_s, 1.0) } else { (spool.release_s, 0.0) };
            let start = edge.at_s + delay;
            let from = place(&corners, start);
            // An edge that acts cuts off whatever was still to come.
            while corners.last().is_some_and(|corner| corner.0 >= start) {
                corners.pop();
            }
            corners.push((start, from));
            let end = start + spool.travel_s * f64::abs(goal - from);
            corners.push((end, goal));
        }
        Self { corners }
    }

    /// The place at the time `t`, seen from later times where the spool jumps at `t`.
    pub fn at(&self, t: f64) -> f64 {
        place(&self.corners, t)
    }

    /// The first corner after `t`.
    pub fn next_corner(&self, t: f64) -> Option<f64> {
        self.corners.iter().map(|corner| corner.0).find(|&at| at > t)
    }
}

fn place(corners: &[(f64, f64)], t: f64) -> f64 {
    let Some(index) = corners.iter().rposition(|corner| corner.0 <= t) else {
        return 0.0;
    };
    let (t0, s0) = corners[index];
    match corners.get(index + 1) {
        Some(&(t1, s1)) if t0.is_finite() => s0 + (s1 - s0) * (t - t0) / (t1 - t0),
        _ => s0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_early_reversal_turns_the_spool_on_its_way() {
        let spool = Spool { energise_s: 0.02, release_s: 0.01, travel_s: 0.1 };
        let edges = [Edge { at_s: 0.0, close: true }, Edge { at_s: 0.06, close: false }];
        let travel = Travel::new(&edges, spool);
        assert_eq!(travel.at(0.02), 0.0);
        assert!((travel.at(0.045) - 0.25).abs() < 1e-12);
        assert!((travel.at(0.07) - 0.5).abs() < 1e-12);
        assert!((travel.at(0.095) - 0.25).abs() < 1e-12);
        assert_eq!(travel.at(0.5), 0.0);
    }

    #[test]
    fn without_delays_it_jumps_with_the_command() {
        let edges = [Edge { at_s: 0.0, close: true }, Edge { at_s: 4.0, close: false }];
        let travel = Travel::new(&edges, Spool::default());
        assert_eq!(travel.at(-1e-9), 0.0);
        assert_eq!(travel.at(0.0), 1.0);
        assert_eq!(travel.at(3.999), 1.0);
        assert_eq!(travel.at(4.0), 0.0);
    }
}
