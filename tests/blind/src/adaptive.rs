//! Adaptive steps of a stiffly stable Rosenbrock method, for valves that are slow, stiff or both.
//!
//! The method is RODAS3, of third order with an error estimate of second (A. Sandu, J. G. Verwer, J. G. Blom,
//! G. R. Carmichael, F. A. Potra, "Benchmarking stiff ODE solvers for atmospheric chemistry problems II:
//! Rosenbrock solvers", Atmos. Environ. 31, 1997), with a Jacobian from differences over the states in use.

use crate::rig::{Rates, Rig, State};

/// Number of states of a rig.
const STATES: usize = 13;
/// Shortest step that is still made smaller when its error is too large.
const LEAST_STEP_S: f64 = 1e-8;
/// Steps after which a valve is given up; the longest records take a tenth of that.
const MOST_STEPS: usize = 2_000_000;
/// Share of the method's own estimate of the next step that is taken.
const CAUTION: f64 = 0.85;

type Vector = [f64; STATES];

/// What one accepted step went through.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stretch {
    pub from_s: f64,
    pub to_s: f64,
    pub from: State,
    pub to: State,
}

impl Stretch {
    /// The position shown at a time within the stretch: a cubic through places and speeds.
    pub fn position(&self, t: f64, lag_s: f64) -> f64 {
        let speed = |s: &State| if lag_s > 0.0 { (s.x - s.seen) / lag_s } else { s.v };
        let place = |s: &State| if lag_s > 0.0 { s.seen } else { s.x };
        let h = self.to_s - self.from_s;
        let u = ((t - self.from_s) / h).clamp(0.0, 1.0);
        let (a, b) = (place(&self.from), place(&self.to));
        let (va, vb) = (h * speed(&self.from), h * speed(&self.to));
        let rise = b - a;
        a + u * (va + u * (3.0 * rise - 2.0 * va - vb + u * (va + vb - 2.0 * rise)))
    }

    /// A value at a time within the stretch, from its values at both ends.
    pub fn between(&self, t: f64, from: f64, to: f64) -> f64 {
        from + (to - from) * ((t - self.from_s) / (self.to_s - self.from_s)).clamp(0.0, 1.0)
    }
}

/// How accurate the steps are, and how long at most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Multiplies every tolerance; 1 keeps a stroke within a micrometre or two.
    pub factor: f64,
    /// Longest step.
    pub longest_s: f64,
}

fn pack(s: &State) -> Vector {
    [
        s.x,
        s.v,
        s.bristle,
        s.chamber_kg,
        s.pipe_kg,
        s.chamber_k,
        s.pipe_k,
        s.chamber_wall_k,
        s.pipe_wall_k,
        s.line_pa,
        s.silencer_pa,
        s.seen,
        s.rest_age,
    ]
}

fn unpack(y: &Vector) -> State {
    State {
        x: y[0],
        v: y[1],
        bristle: y[2],
        chamber_kg: y[3],
        pipe_kg: y[4],
        chamber_k: y[5],
        pipe_k: y[6],
        chamber_wall_k: y[7],
        pipe_wall_k: y[8],
        line_pa: y[9],
        silencer_pa: y[10],
        seen: y[11],
        rest_age: y[12],
    }
}

fn pack_rates(v: f64, r: &Rates) -> Vector {
    [
        v,
        r.v,
        r.bristle,
        r.chamber_kg,
        r.pipe_kg,
        r.chamber_k,
        r.pipe_k,
        r.chamber_wall_k,
        r.pipe_wall_k,
        r.line_pa,
        r.silencer_pa,
        r.seen,
        r.rest_age,
    ]
}

/// Spool between two corners: its place at a time and its speed.
#[derive(Debug, Clone, Copy)]
struct Spool {
    place: f64,
    at_s: f64,
    rate: f64,
}

impl Spool {
    fn at(self, t: f64) -> f64 {
        self.place + self.rate * (t - self.at_s)
    }
}

/// Work of one rig: which states are in use, their tolerances, and the step of the moment.
struct Stepper<'a> {
    rig: &'a Rig,
    active: Vec<usize>,
    spool: Spool,
    timed: bool,
    factor: f64,
}

impl Stepper<'_> {
    fn rates(&self, t: f64, y: &Vector) -> Vector {
        pack_rates(y[1], &self.rig.rates(t, self.spool.at(t), &unpack(y)))
    }

    /// Absolute tolerances at a state.
    fn tolerance(&self, index: usize, y: &Vector) -> f64 {
        self.factor
            * match index {
                0 | 11 => 2e-8,
                1 => 2e-5 + 1e-3 * y[1].abs(),
                2 => 2e-9 + 1e-3 * y[2].abs(),
                3 | 4 | 9 | 10 => 1e-6 * y[index].abs(),
                5..=8 => 1e-3,
                _ => 1e-4,
            }
    }

    /// Change of a state over which its column of the Jacobian is taken.
    fn nudge(index: usize, y: &Vector) -> f64 {
        match index {
            0 | 11 => 1e-9,
            1 => 1e-8 + 1e-6 * y[1].abs(),
            2 => 1e-11 + 1e-6 * y[2].abs(),
            12 => 1e-6,
            _ => 1e-8 * y[index].abs(),
        }
    }

    /// The state after `h` and the error of it in tolerances; none where the equations cannot be solved.
    fn step(&self, t: f64, y: &Vector, f0: &Vector, h: f64) -> Option<(Vector, f64)> {
        let n = self.active.len();
        let mut matrix = [[0.0; STATES]; STATES];
        for (column, &index) in self.active.iter().enumerate() {
            let mut moved = *y;
            let nudge = Self::nudge(index, y);
            moved[index] += nudge;
            let step = moved[index] - y[index];
            let rates = self.rates(t, &moved);
            for (row, &other) in self.active.iter().enumerate() {
                matrix[row][column] = -(rates[other] - f0[other]) / step;
            }
            matrix[column][column] += 2.0 / h;
        }
        let pivots = factorise(&mut matrix, n)?;
        let mut in_time = [0.0; STATES];
        if self.timed {
            let shift = 1e-4 * h;
            let later = self.rates(t + shift, y);
            for &index in &self.active {
                in_time[index] = (later[index] - f0[index]) / shift;
            }
        }
        // The stages, in the form that needs no product with the Jacobian.
        let solve = |f: &Vector, mix: [f64; 3], k: &[Vector; 4], gamma: f64| {
            let mut right = [0.0; STATES];
            for (row, &index) in self.active.iter().enumerate() {
                let mixed = mix[0] * k[0][index] + mix[1] * k[1][index] + mix[2] * k[2][index];
                right[row] = f[index] + mixed / h + gamma * h * in_time[index];
            }
            back_substitute(&matrix, &pivots, n, &mut right);
            let mut full = [0.0; STATES];
            for (row, &index) in self.active.iter().enumerate() {
                full[index] = right[row];
            }
            full
        };
        let plus = |parts: [f64; 3], k: &[Vector; 4]| {
            let mut next = *y;
            for &index in &self.active {
                next[index] += parts[0] * k[0][index] + parts[1] * k[1][index] + parts[2] * k[2][index];
            }
            next
        };
        let mut k = [[0.0; STATES]; 4];
        k[0] = solve(f0, [0.0; 3], &k, 0.5);
        k[1] = solve(f0, [4.0, 0.0, 0.0], &k, 1.5);
        let f2 = self.rates(t + h, &plus([2.0, 0.0, 0.0], &k));
        k[2] = solve(&f2, [1.0, -1.0, 0.0], &k, 0.0);
        let f3 = self.rates(t + h, &plus([2.0, 0.0, 1.0], &k));
        k[3] = solve(&f3, [1.0, -1.0, -8.0 / 3.0], &k, 0.0);
        let mut next = plus([2.0, 0.0, 1.0], &k);
        let mut error: f64 = 0.0;
        for &index in &self.active {
            next[index] += k[3][index];
            error = error.max(k[3][index].abs() / self.tolerance(index, y));
        }
        // A maximum passes over what is no number.
        next.iter().all(|value| value.is_finite()).then_some((next, error))
    }
}

/// Gauss elimination with row pivots, in place; none when singular.
fn factorise(a: &mut [[f64; STATES]; STATES], n: usize) -> Option<[usize; STATES]> {
    let mut pivots = [0; STATES];
    for column in 0..n {
        let best = (column..n).max_by(|&i, &j| a[i][column].abs().total_cmp(&a[j][column].abs()))?;
        if a[best][column] == 0.0 || !a[best][column].is_finite() {
            return None;
        }
        pivots[column] = best;
        a.swap(column, best);
        for row in column + 1..n {
            let share = a[row][column] / a[column][column];
            a[row][column] = share;
            if share != 0.0 {
                let (above, below) = a.split_at_mut(row);
                let pairs = below[0].iter_mut().zip(&above[column]).take(n);
                pairs.skip(column + 1).for_each(|(value, pivot)| *value -= share * pivot);
            }
        }
    }
    Some(pivots)
}

fn back_substitute(a: &[[f64; STATES]; STATES], pivots: &[usize; STATES], n: usize, b: &mut Vector) {
    for (row, &pivot) in pivots.iter().enumerate().take(n) {
        b.swap(row, pivot);
    }
    for row in 0..n {
        b[row] -= (0..row).map(|column| a[row][column] * b[column]).sum::<f64>();
    }
    for row in (0..n).rev() {
        b[row] = (b[row] - (row + 1..n).map(|column| a[row][column] * b[column]).sum::<f64>()) / a[row][row];
    }
}

impl Rig {
    /// Indices of the states that change at all.
    fn active(&self) -> Vec<usize> {
        let (hidden, mut list) = (&self.hidden, vec![0, 1, 3, 4]);
        let heated = hidden.wall_conductance_w_per_k.is_some();
        let ages = |effect: &crate::hidden::Outside| matches!(effect, crate::hidden::Outside::DwellFriction { .. });
        let optional = [
            (2, self.bristle.is_some()),
            (5, heated),
            (6, heated),
            (7, heated && hidden.laws.wall_time_s.is_some()),
            (8, heated && hidden.laws.wall_time_s.is_some()),
            (9, hidden.supply_droop.is_some()),
            (10, hidden.laws.silencer.is_some()),
            (11, hidden.sensor_lag_s > 0.0),
            (12, hidden.outside.iter().any(ages)),
        ];
        list.extend(optional.iter().filter(|(_, used)| *used).map(|(index, _)| *index));
        list
    }

    /// Goes on to the time `until_s` in steps as long as `accuracy` allows; `each` sees every one. False where the
    /// equations cannot be followed that far: a valve that nobody could build.
    #[must_use]
    pub fn advance_adaptively(
        &mut self,
        until_s: f64,
        accuracy: Accuracy,
        mut each: impl FnMut(&Self, &Stretch),
    ) -> bool {
        let active = self.active();
        let mut length = 1e-5_f64.min(accuracy.longest_s);
        let mut steps = 0;
        while self.time_s < until_s - 1e-12 {
            let stop = match self.travel.next_corner(self.time_s + 1e-12) {
                Some(corner) if corner < until_s => corner,
                _ => until_s,
            };
            let from = self.time_s;
            // Seen from inside the stretch, so that jumps at its ends do not matter.
            let (near, far) = (from + 0.25 * (stop - from), from + 0.75 * (stop - from));
            let rate = (self.travel.at(far) - self.travel.at(near)) / (far - near);
            let spool = Spool { place: self.travel.at(near), at_s: near, rate };
            length = length.min(1e-4);
            let (mut t, mut y) = (from, pack(&self.state));
            while t < stop - 1e-12 {
                let h = if t + 1.1 * length >= stop { stop - t } else { length };
                let stepper = Stepper {
                    rig: self,
                    active: active.clone(),
                    spool,
                    timed: rate != 0.0 || self.is_timed(),
                    factor: accuracy.factor,
                };
                let f0 = stepper.rates(t, &y);
                let (next, error) = match stepper.step(t, &y, &f0, h) {
                    Some(done) => done,
                    None if h > LEAST_STEP_S => {
                        length = 0.25 * h;
                        continue;
                    }
                    None => return false,
                };
                steps += 1;
                if steps > MOST_STEPS {
                    return false;
                }
                let grow = (CAUTION * error.max(1e-6).powf(-1.0 / 3.0)).clamp(0.2, 4.0);
                length = (h * grow).min(accuracy.longest_s);
                if error > 1.0 && h > LEAST_STEP_S {
                    continue;
                }
                let mut to = unpack(&next);
                if self.hidden.sensor_lag_s == 0.0 {
                    to.seen = to.x;
                }
                let stretch = Stretch { from_s: t, to_s: t + h, from: unpack(&y), to };
                each(self, &stretch);
                t += h;
                y = pack(&to);
            }
            self.state = unpack(&y);
            self.time_s = stop;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hidden::{Bristles, DryFriction, Hidden, Laws, Spool as Delays};
    use crate::rig::Conditions;
    use crate::spool::Edge;
    use crate::valve::Valve;

    const FULL: Accuracy = Accuracy { factor: 1.0, longest_s: 5e-3 };

    /// Position every millisecond over one cycle of 6 s.
    fn stroke(hidden: &Hidden, accuracy: Accuracy) -> Vec<f64> {
        let edges = [Edge { at_s: 0.0, close: true }, Edge { at_s: 3.0, close: false }];
        let set = Conditions { supply_psig: 75.0, leak_to_atmosphere_m2: 0.0, leak_from_supply_m2: 0.0 };
        let mut rig = Rig::new(&Valve::testbed(), hidden, &set, &edges, -0.01);
        let mut places = Vec::new();
        let done = rig.advance_adaptively(6.0, accuracy, |rig, stretch| {
            while places.len() as f64 * 1e-3 <= stretch.to_s {
                places.push(stretch.position(places.len() as f64 * 1e-3, rig.hidden.sensor_lag_s));
            }
        });
        assert!(done && places.len() > 5990);
        places
    }

    /// The same in fixed steps.
    fn fixed(hidden: &Hidden) -> Vec<f64> {
        let edges = [Edge { at_s: 0.0, close: true }, Edge { at_s: 3.0, close: false }];
        let set = Conditions { supply_psig: 75.0, leak_to_atmosphere_m2: 0.0, leak_from_supply_m2: 0.0 };
        let mut rig = Rig::new(&Valve::testbed(), hidden, &set, &edges, -0.01);
        (0..6000)
            .map(|row| {
                rig.advance(f64::from(row) * 1e-3, |_, _| true);
                rig.state.seen
            })
            .collect()
    }

    fn rms(a: &[f64], b: &[f64]) -> f64 {
        let n = a.len().min(b.len());
        ((0..n).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>() / n as f64).sqrt()
    }

    fn hard() -> [Hidden; 4] {
        let dry = Some(DryFriction { coulomb_n: 50.0, static_n: 80.0, stribeck_m_per_s: 0.01 });
        [
            Hidden::default(),
            Hidden { bristles: Bristles::Of(5e4), dry_friction: dry, sensor_lag_s: 0.02, ..Hidden::default() },
            Hidden {
                bristles: Bristles::Of(2e6),
                dry_friction: dry,
                laws: Laws { friction_asymmetry: 0.3, friction_slope: 0.4, perry_share: 1.0, ..Laws::default() },
                ..Hidden::default()
            },
            Hidden {
                wall_conductance_w_per_k: Some(0.2),
                supply_droop: Some((5e7, 20e-6)),
                solenoid: Delays { energise_s: 0.0213, release_s: 0.017_77, travel_s: 0.033_33 },
                closing_cushion: (4000.0, 5e-3),
                laws: Laws {
                    stop_damping_s_per_m: 5.0,
                    wall_time_s: Some(100.0),
                    silencer: Some((0.6e-6, 5e-6)),
                    ..Laws::default()
                },
                ..Hidden::default()
            },
        ]
    }

    #[test]
    fn tighter_tolerances_change_a_stroke_by_less_than_two_micrometres() {
        for hidden in hard() {
            let finer = Accuracy { factor: 0.1, longest_s: 1e-3 };
            let off = rms(&stroke(&hidden, FULL), &stroke(&hidden, finer));
            assert!(off < 2e-6, "{off:e} m: {hidden:?}");
        }
    }

    #[test]
    fn both_ways_of_stepping_agree() {
        for hidden in hard() {
            let off = rms(&stroke(&hidden, FULL), &fixed(&hidden));
            assert!(off < 2e-6, "{off:e} m: {hidden:?}");
        }
    }
}
