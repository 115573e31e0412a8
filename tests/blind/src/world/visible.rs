//! How much of a hidden effect can be seen: what it changes, and what is left of that when everything that is not
//! known exactly has taken its share.
//!
//! The second is linear least squares with priors: the tolerated parameters within their tolerances, zeros, gain,
//! delays and supply pressures within what instruments and fittings usually have. What is left, against the
//! errors that do not follow a parameter, is told in nats of log likelihood.

use crate::hidden::Hidden;
use crate::rig::Conditions;
use crate::valve::Valve;
use crate::world::play::{grid, plain_cycle, times_in};

/// Rows of a cycle that are compared.
const ROWS: usize = 240;
/// Rows within which a systematic error of the instrument is one and the same.
const CORRELATED_ROWS: f64 = 20.0;
/// One sigma of what may always be off: zero (of the stroke), gain, delay (of a closing), supply by run and throughout.
const PRIORS: [f64; 5] = [0.004, 0.01, 0.005, 0.01, 0.02];
/// Gain in log likelihood from which on an effect has to be named.
pub(crate) const PLAIN_NATS: f64 = 15.0;
/// Gain in log likelihood up to which two explanations are as good.
pub(crate) const TIE_NATS: f64 = 5.0;

/// What an effect changes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Visible {
    /// Root mean square change of the position while the valve moves.
    pub position_rms_m: f64,
    /// Root mean square change of the stroke times.
    pub time_rms_s: f64,
    /// What of the position's change is left after all else took its share.
    pub left_rms_m: f64,
    /// The same in nats of log likelihood.
    pub nats: f64,
}

/// Undisturbed strokes of a valve under a few conditions.
#[derive(Debug, Clone)]
pub(crate) struct Bench {
    pub conditions: Vec<Conditions>,
    pub open_at_s: f64,
    pub end_s: f64,
    pub close_s: f64,
    /// One sigma of independent errors of a row, and of errors that last.
    pub noise_m: f64,
    pub systematic_m: f64,
    pub tolerances: Vec<(usize, f64)>,
}

/// Positions over the bench's grid, one list a condition.
pub(crate) type Strokes = Vec<Vec<f64>>;

impl Bench {
    pub fn strokes(&self, valve: &Valve, hidden: &Hidden) -> Strokes {
        let grid: Vec<f64> = grid(self.end_s, ROWS).iter().map(|t| t - hidden.clock_offset_s).collect();
        let one =
            |set: &Conditions| plain_cycle(valve, hidden, set, self.open_at_s, self.end_s).watch(&grid, &[]).position_m;
        self.conditions.iter().map(one).collect()
    }

    /// Whether the valve closes and opens fully under all conditions, with time to spare.
    pub fn is_full(&self, strokes: &Strokes, stroke_m: f64) -> bool {
        let grid = grid(self.end_s, ROWS);
        strokes.iter().all(|places| {
            let shut = grid.iter().take_while(|t| **t <= 0.95 * self.open_at_s).count();
            places[..shut].iter().any(|x| *x <= 0.0) && places[ROWS - 4..].iter().all(|x| *x >= 0.999 * stroke_m)
        })
    }

    /// Root mean square difference of position while either moves, and of stroke times.
    pub fn change(&self, one: &Strokes, other: &Strokes, stroke_m: f64) -> (f64, f64) {
        let at = grid(self.end_s, ROWS);
        let (mut sum, mut count, mut times) = (0.0, 0.0, Vec::new());
        for (a, b) in one.iter().zip(other) {
            for row in 1..a.len() {
                let moves = |x: &[f64]| (x[row] - x[row - 1]).abs() > 1e-3 * stroke_m;
                if moves(a) || moves(b) {
                    sum += (a[row] - b[row]).powi(2);
                    count += 1.0;
                }
            }
            let (first, second) =
                (times_in(a, &at, self.open_at_s, stroke_m), times_in(b, &at, self.open_at_s, stroke_m));
            for pair in [(first.0, second.0), (first.1, second.1)] {
                if let (Some(s), Some(t)) = pair {
                    times.push((s - t).powi(2));
                }
            }
        }
        let mean = |sum: f64, count: f64| if count > 0.0 { (sum / count).sqrt() } else { 0.0 };
        (mean(sum, count), mean(times.iter().sum(), times.len() as f64))
    }

    /// Directions in which the strokes move with what is not known exactly, one sigma each.
    pub fn nuisances(&self, valve: &Valve, hidden: &Hidden, base: &Strokes) -> Vec<Strokes> {
        let stroke = valve.stroke_m;
        let mut list: Vec<Strokes> = self
            .tolerances
            .iter()
            .map(|(index, sigma)| {
                let mut moved = valve.clone();
                *moved.tolerated_mut(*index) *= 1.0 + 0.5 * sigma;
                scaled(&minus(&self.strokes(&moved, hidden), base), 2.0)
            })
            .collect();
        let higher = Self {
            conditions: self
                .conditions
                .iter()
                .map(|set| Conditions { supply_psig: 1.01 * set.supply_psig, ..set.clone() })
                .collect(),
            ..self.clone()
        };
        let by_supply = minus(&higher.strokes(valve, hidden), base);
        list.push(scaled(&by_supply, PRIORS[4] / 0.01));
        list.push(scaled(base, PRIORS[1]));
        let interval = self.end_s / ROWS as f64;
        let opens = grid(self.end_s, ROWS).iter().take_while(|t| **t < self.open_at_s).count();
        let slope = |x: &[f64], row: usize| (x[(row + 1).min(ROWS)] - x[row.saturating_sub(1)]) / (2.0 * interval);
        for (index, places) in base.iter().enumerate() {
            let alone = |rows: Vec<f64>| {
                let mut all: Strokes = base.iter().map(|x| vec![0.0; x.len()]).collect();
                all[index] = rows;
                all
            };
            list.push(alone(vec![PRIORS[0] * stroke; places.len()]));
            list.push(alone(scaled(&vec![by_supply[index].clone()], PRIORS[3] / 0.01).remove(0)));
            for closing in [true, false] {
                let shift = |row: usize| if (row < opens) == closing { slope(places, row) } else { 0.0 };
                list.push(alone((0..places.len()).map(|row| PRIORS[2] * self.close_s * shift(row)).collect()));
            }
        }
        list
    }

    fn row_sigma_m(&self) -> f64 {
        (self.noise_m.powi(2) + CORRELATED_ROWS * self.systematic_m.powi(2)).sqrt()
    }

    /// What of `change` is left after the nuisances within their priors and the free directions took their
    /// share: root mean square over all rows that moved, and half of chi squared.
    pub fn left(&self, change: &Strokes, nuisances: &[Strokes], free: &[Strokes]) -> (f64, f64) {
        let sigma = self.row_sigma_m();
        let flat = |strokes: &Strokes| strokes.iter().flatten().map(|x| x / sigma).collect::<Vec<f64>>();
        let target = flat(change);
        // A free direction has a prior a hundred times as wide as itself.
        let columns: Vec<Vec<f64>> =
            nuisances.iter().map(flat).chain(free.iter().map(|direction| flat(&scaled(direction, 100.0)))).collect();
        let shares = ridge(&columns, &target);
        let mut rest = target.clone();
        for (share, column) in shares.iter().zip(&columns) {
            for (value, part) in rest.iter_mut().zip(column) {
                *value -= share * part;
            }
        }
        let squares: f64 = rest.iter().map(|v| v * v).sum();
        let priors: f64 = shares.iter().map(|v| v * v).sum();
        let moved = target.iter().filter(|v| v.abs() * sigma > 1e-7).count().max(1) as f64;
        (sigma * (squares / moved).sqrt(), 0.5 * (squares + priors))
    }

    /// Whether an effect that changes `other` explains `change`, of `nats` by itself, as well.
    pub fn is_twin(
        &self,
        change: &Strokes,
        nats: f64,
        nuisances: &[Strokes],
        free: &[Strokes],
        other: &Strokes,
    ) -> bool {
        let mut all = free.to_vec();
        all.push(other.clone());
        self.left(change, nuisances, &all).1 < TIE_NATS.min(0.3 * nats)
    }
}

/// The difference of two lists of strokes.
pub(crate) fn minus(one: &Strokes, other: &Strokes) -> Strokes {
    one.iter().zip(other).map(|(a, b)| a.iter().zip(b).map(|(x, y)| x - y).collect()).collect()
}

fn scaled(strokes: &Strokes, factor: f64) -> Strokes {
    strokes.iter().map(|x| x.iter().map(|v| v * factor).collect()).collect()
}

/// Least squares with a unit prior on every share, by Cholesky's decomposition of the normal equations.
fn ridge(columns: &[Vec<f64>], target: &[f64]) -> Vec<f64> {
    let n = columns.len();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let mut lower = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            let mut sum = dot(&columns[i], &columns[j]) + if i == j { 1.0 } else { 0.0 };
            sum -= (0..j).map(|k| lower[i][k] * lower[j][k]).sum::<f64>();
            lower[i][j] = if i == j { sum.max(1e-12).sqrt() } else { sum / lower[j][j] };
        }
    }
    let mut shares: Vec<f64> = columns.iter().map(|column| dot(column, target)).collect();
    for i in 0..n {
        let known: f64 = (0..i).map(|k| lower[i][k] * shares[k]).sum();
        shares[i] = (shares[i] - known) / lower[i][i];
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| lower[k][i] * shares[k]).sum();
        shares[i] = (shares[i] - known) / lower[i][i];
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hidden::DryFriction;
    use crate::world::play::at;

    fn bench() -> Bench {
        Bench {
            conditions: vec![at(60.0), at(75.0), at(90.0)],
            open_at_s: 4.0,
            end_s: 8.5,
            close_s: 1.04,
            noise_m: 3e-5,
            systematic_m: 0.0,
            tolerances: crate::valve::TOLERANCES.iter().enumerate().map(|(i, (_, sigma))| (i, *sigma)).collect(),
        }
    }

    #[test]
    fn what_a_tolerance_explains_leaves_nothing_and_friction_leaves_plenty() {
        let (bench, valve, nothing) = (bench(), Valve::testbed(), Hidden::default());
        let base = bench.strokes(&valve, &nothing);
        assert!(bench.is_full(&base, valve.stroke_m));
        let nuisances = bench.nuisances(&valve, &nothing, &base);
        let mut stiffer = valve.clone();
        stiffer.spring_n_per_m *= 1.002;
        let by_spring = minus(&bench.strokes(&stiffer, &nothing), &base);
        assert!(bench.left(&by_spring, &nuisances, &[]).1 < 1.0);
        let dry = DryFriction { coulomb_n: 35.0, static_n: 35.0, stribeck_m_per_s: 0.01 };
        let rubbing = bench.strokes(&valve, &Hidden { dry_friction: Some(dry), ..Hidden::default() });
        let (position, time) = bench.change(&rubbing, &base, valve.stroke_m);
        let (left, nats) = bench.left(&minus(&rubbing, &base), &nuisances, &[]);
        assert!(nats > PLAIN_NATS && left < position && time > 1e-3, "{position} {time} {left} {nats}");
        // It is no riddle beside itself.
        let doubled = scaled(&minus(&rubbing, &base), 2.0);
        assert!(bench.is_twin(&minus(&rubbing, &base), nats, &nuisances, &[], &doubled));
    }
}
