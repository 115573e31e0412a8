//! Fits of the standard problems of Moré, Garbow and Hillstrom (ACM Transactions on Mathematical Software 7(1), 1981).
//!
//! Each is a sum of squares that is to be zero. The priors are so wide that they move nothing.

mod common;

use std::sync::atomic::{AtomicUsize, Ordering};

use common::{Functions, options, record, shared};
use identify::normal::Posterior;
use identify::{Coordinate, Fit, FitOptions, Problem, Record, Request, Scope, Stop, fit};

struct Case {
    name: &'static str,
    start: Vec<f64>,
    rows: usize,
    residual: fn(&[f64]) -> Vec<f64>,
    solution: Vec<f64>,
    /// Predictions that it may take.
    most: usize,
}

fn cases() -> Vec<Case> {
    vec![
        Case {
            name: "Rosenbrock",
            start: vec![-1.2, 1.0],
            rows: 2,
            residual: |x| vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]],
            solution: vec![1.0, 1.0],
            most: 200,
        },
        Case {
            name: "Freudenstein and Roth",
            start: vec![6.0, 3.0],
            rows: 2,
            residual: |x| {
                vec![
                    -13.0 + x[0] + ((5.0 - x[1]) * x[1] - 2.0) * x[1],
                    -29.0 + x[0] + ((x[1] + 1.0) * x[1] - 14.0) * x[1],
                ]
            },
            solution: vec![5.0, 4.0],
            most: 200,
        },
        Case {
            name: "Beale",
            start: vec![1.0, 1.0],
            rows: 3,
            residual: |x| {
                let of = |y: f64, power: i32| y - x[0] * (1.0 - x[1].powi(power));
                vec![of(1.5, 1), of(2.25, 2), of(2.625, 3)]
            },
            solution: vec![3.0, 0.5],
            most: 200,
        },
        Case {
            name: "helical valley",
            start: vec![-1.0, 0.0, 0.0],
            rows: 3,
            residual: |x| {
                let angle = x[1].atan2(x[0]) / std::f64::consts::TAU;
                vec![10.0 * (x[2] - 10.0 * angle), 10.0 * (x[0].hypot(x[1]) - 1.0), x[2]]
            },
            solution: vec![1.0, 0.0, 0.0],
            most: 300,
        },
        Case {
            name: "Wood",
            start: vec![-3.0, -1.0, -3.0, -1.0],
            rows: 6,
            residual: |x| {
                vec![
                    10.0 * (x[1] - x[0] * x[0]),
                    1.0 - x[0],
                    90.0_f64.sqrt() * (x[3] - x[2] * x[2]),
                    1.0 - x[2],
                    10.0_f64.sqrt() * (x[1] + x[3] - 2.0),
                    (x[1] - x[3]) / 10.0_f64.sqrt(),
                ]
            },
            solution: vec![1.0, 1.0, 1.0, 1.0],
            most: 800,
        },
    ]
}

#[test]
fn the_optimum_is_found_within_a_budget() {
    for case in cases() {
        let n = case.start.len();
        let residual = case.residual;
        let problem = Functions {
            coordinates: (0..n).map(|i| shared(&format!("x{i}"), 0.0, 1e3, 1e4)).collect(),
            records: vec![record(&vec![0.0; case.rows], 1e-3, false, 0)],
            of_records: vec![Box::new(residual)],
            asked: AtomicUsize::new(0),
        };
        let mut options = options();
        options.annealed_tolerance = 1e-9;
        let found = fit(&problem, &case.start, &options).expect("possible everywhere");
        let asked = problem.asked.load(Ordering::Relaxed);
        for (x, expected) in found.u.iter().zip(&case.solution) {
            assert!((x - expected).abs() < 1e-3, "{}: {:?} for {:?}", case.name, found.u, case.solution);
        }
        assert!(asked < case.most, "{}: {asked} predictions", case.name);
    }
}

#[test]
fn a_bound_holds_what_would_leave_it() {
    // The optimum within x0 <= 0.5 of Rosenbrock's valley lies on the bound.
    let mut coordinates: Vec<_> = (0..2).map(|i| shared(&format!("x{i}"), 0.0, 1e3, 1e4)).collect();
    coordinates[0].upper = 0.5;
    let problem = Functions {
        coordinates,
        records: vec![record(&[0.0, 0.0], 1e-3, false, 0)],
        of_records: vec![Box::new(|x| vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]])],
        asked: AtomicUsize::new(0),
    };
    let found = fit(&problem, &[-1.2, 1.0], &options()).expect("possible");
    assert!(found.held[0] && found.u[0] == 0.5, "{:?}", found.u);
    assert!((found.u[1] - 0.25).abs() < 1e-3, "{:?}", found.u);
}

#[test]
fn a_model_that_is_rough_and_wrong_does_not_keep_a_fit_going() {
    // A valley that something missing fills with error, rippled finely along a way down: steps keep little of their promise.
    let count = 60;
    let missing = |row: usize| if (row / 10).is_multiple_of(2) { 3.0 } else { -3.0 };
    let ripple = |x: f64, row: usize| 2.0 * (40.0 * x + row as f64).sin();
    let problem = Functions {
        coordinates: (0..3).map(|i| shared(&format!("x{i}"), 0.0, 10.0, 50.0)).collect(),
        records: vec![record(&vec![0.0; count], 0.05, false, 0)],
        of_records: vec![Box::new(move |x| {
            let of_row = |row: usize| {
                let t = row as f64 / count as f64;
                let curve = x[0] * (1.0 - (-4.0 * t * x[1].exp()).exp()) + x[2] * t * t - 2.0 * t.sqrt();
                missing(row) + curve + ripple(x[0], row) + ripple(x[2], 7 * row)
            };
            (0..count).map(of_row).collect()
        })],
        asked: AtomicUsize::new(0),
    };
    let found =
        fit(&problem, &[0.0, 0.5, 0.0], &FitOptions { tolerance: 2.0, ..options() }).expect("possible everywhere");
    let asked = problem.asked.load(Ordering::Relaxed);
    assert!(found.converged, "{} nats are still promised", found.predicted_gain);
    // Until its steps promise little it takes 620.
    assert!(asked < 450, "{asked} predictions");
}

/// A line that somebody asks to stop after so many predictions: those that follow are not made.
struct Stopped {
    line: Functions,
    after: usize,
    stop: Stop,
}

impl Problem for Stopped {
    fn coordinates(&self) -> &[Coordinate] {
        self.line.coordinates()
    }

    fn records(&self) -> &[Record] {
        self.line.records()
    }

    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
        let one = |request: &Request| {
            if self.line.asked.load(Ordering::Relaxed) >= self.after {
                self.stop.ask();
            }
            if self.stop.is_asked() { None } else { self.line.predict(points, &[*request]).remove(0) }
        };
        requests.iter().map(one).collect()
    }

    fn stop(&self) -> &Stop {
        &self.stop
    }
}

#[test]
fn a_fit_that_is_stopped_among_its_derivatives_has_none_that_are_wrong() {
    let stopped = |after: usize| Stopped {
        line: Functions {
            coordinates: (0..2).map(|i| shared(&format!("x{i}"), 0.0, 10.0, 50.0)).collect(),
            records: vec![record(&[1.0, 2.0, 3.0], 0.1, false, 0)],
            of_records: vec![Box::new(|x| (0..3).map(|t| x[0].sinh() + x[1] * f64::from(t)).collect())],
            asked: AtomicUsize::new(0),
        },
        after,
        stop: Stop::new(),
    };
    let (mut ended, mut none) = (0, 0);
    for after in 0..30 {
        let problem = stopped(after);
        let Some(found) = fit(&problem, &[0.0, 0.0], &options()) else {
            none += 1;
            continue;
        };
        ended += 1;
        // Both coordinates move rows of the record.
        let moves = |column: &Vec<f64>| column.iter().any(|slope| *slope != 0.0);
        assert!(found.linear.columns[0].iter().all(|(_, column)| moves(column)), "stopped after {after}");
    }
    assert!(ended > 0 && none > 2, "{ended} ended, {none} did not");
}

/// Rows that pin a product of two coordinates and nothing else, a thousand times more sharply than beforehand, and that are a
/// little rough, as what is simulated step by step is.
fn product() -> Functions {
    let rows = |x: &[f64]| {
        let product = (1.0 + 0.3 * x[0]) * (1.0 + 0.3 * x[1]);
        let rough = |t: f64| 3e-3 * (700.0 * x[0] - 900.0 * x[1] + t).sin();
        (0..60).map(|t| 150.0 * product + rough(f64::from(t))).collect::<Vec<f64>>()
    };
    Functions {
        coordinates: (0..2).map(|i| shared(&format!("x{i}"), 0.0, 1.0, 3.0)).collect(),
        records: vec![record(&rows(&[0.0, 0.0]), 1.0, false, 0)],
        of_records: vec![Box::new(rows)],
        asked: AtomicUsize::new(0),
    }
}

#[test]
fn what_only_a_product_is_known_of_stays_as_unsure_as_it_was() {
    let problem = product();
    let found = |options: &FitOptions| -> Vec<Fit> {
        [[2.0, -1.25], [-1.25, 2.0]].iter().filter_map(|start| fit(&problem, start, options)).collect()
    };
    let sigma = |fit: &Fit| {
        let normal = fit.linear.normal(&problem, &fit.noise);
        Posterior::new(problem.coordinates(), &fit.u, &normal).covariance(&fit.held)[(0, 0)].sqrt()
    };
    // Differences along single coordinates take roughness for knowledge.
    let plain = found(&options());
    assert!(plain.iter().all(|fit| sigma(fit) < 0.3), "{:?}", plain.iter().map(sigma).collect::<Vec<_>>());
    let exact = found(&FitOptions { tolerance: 0.01, ..options() }.exact());
    assert_eq!(exact.len(), 2);
    for fit in &exact {
        assert!((sigma(fit) / std::f64::consts::FRAC_1_SQRT_2 - 1.0).abs() < 0.1, "{}", sigma(fit));
        assert!(fit.u.iter().all(|u| u.abs() < 0.25), "{:?}", fit.u);
    }
    let apart = (exact[0].log_evidence - exact[1].log_evidence).abs();
    assert!(apart < 0.2, "{apart} nats");
}

#[test]
fn derivatives_of_a_told_fit_hold_along_directions_that_are_not_measured() {
    // Sharper than what is measured along, and far softer than either coordinate alone.
    const SIGMA: f64 = 0.016;
    let rows = |x: &[f64]| {
        let product = (1.0 + 0.3 * x[0]) * (1.0 + 0.3 * x[1]);
        let apart = (x[0] - x[1]) / (SIGMA * 40_f64.sqrt());
        let rough = |t: f64| 6e-3 * (700.0 * x[0] - 900.0 * x[1] + t).sin();
        let row = |t: u32| if t < 60 { 150.0 * product } else { apart } + rough(f64::from(t));
        (0..80).map(row).collect::<Vec<f64>>()
    };
    let problem = Functions {
        coordinates: (0..2).map(|i| Coordinate::standard(format!("x{i}"), Scope::Shared, 3.0)).collect(),
        records: vec![record(&rows(&[0.0, 0.0]), 1.0, false, 0)],
        of_records: vec![Box::new(rows)],
        asked: AtomicUsize::new(0),
    };
    let wrong = |options: &FitOptions| {
        let fit = fit(&problem, &[0.5, -0.3], options).expect("possible everywhere");
        let by = SIGMA * std::f64::consts::FRAC_1_SQRT_2;
        let ends = [1.0, -1.0].map(|sign| vec![fit.u[0] + sign * by, fit.u[1] - sign * by]);
        let off = |end: &Vec<f64>| -> Vec<f64> {
            let foreseen = fit.linear.foreseen(end).remove(0);
            let observed = problem.records[0].rows().zip(rows(end)).map(|(row, predicted)| row.observed - predicted);
            observed.zip(foreseen).map(|(really, foreseen)| really - foreseen).collect()
        };
        let (ahead, back) = (off(&ends[0]), off(&ends[1]));
        ahead.iter().zip(&back).map(|(ahead, back)| (0.5 * (ahead - back)).powi(2)).sum::<f64>().sqrt()
    };
    let (plain, told) = (wrong(&options()), wrong(&FitOptions { tolerance: 0.01, ..options() }.exact()));
    assert!(plain > 0.2 && told < 0.1, "{plain} and {told} deviations");
}

#[test]
fn a_coordinate_bounded_to_one_value_stays_there_and_the_others_find_their_best_beside_it() {
    let mut problem = product();
    // The data would have it lower, and the prior as well.
    (problem.coordinates[0].lower, problem.coordinates[0].upper) = (1.5, 1.5);
    let found = fit(&problem, &[1.5, 1.0], &options()).expect("possible everywhere");
    let beside = (1.0 / (1.0 + 0.3 * 1.5) - 1.0) / 0.3;
    assert!(found.held[0] && (found.u[1] - beside).abs() < 0.01, "{:?} for {beside}", found.u);
    assert!(found.predicted_gain >= 0.0, "{}", found.predicted_gain);
}

#[test]
fn so_does_what_only_products_with_what_each_record_has_of_its_own_are_known_of() {
    // A gauge that every record's own supply and load make up for, and each of these for the other.
    const RECORDS: usize = 4;
    let rows = |record: usize| {
        move |x: &[f64]| -> Vec<f64> {
            let own = &x[1 + 2 * record..];
            let product = (1.0 + 0.3 * x[0]) * (1.0 + 0.3 * own[0]) * (1.0 + 0.3 * own[1]);
            let rough = |t: f64| 3e-3 * (700.0 * x[0] - 900.0 * own[0] + 800.0 * own[1] + t).sin();
            (0..60).map(|t| 150.0 * product + rough(f64::from(t))).collect()
        }
    };
    let mut coordinates = vec![shared("common", 0.0, 1.0, 3.0)];
    coordinates.extend(
        (0..2 * RECORDS)
            .map(|own| Coordinate { scope: Scope::Record(own / 2), ..shared(&format!("own {own}"), 0.0, 1.0, 3.0) }),
    );
    let observed = |one: usize| record(&rows(one)(&[0.0; 1 + 2 * RECORDS]), 1.0, false, 0);
    let problem = Functions {
        coordinates,
        records: (0..RECORDS).map(observed).collect(),
        of_records: (0..RECORDS).map(|one| Box::new(rows(one)) as _).collect(),
        asked: AtomicUsize::new(0),
    };
    let mut start = vec![0.9];
    start.extend([0.9, -1.5].repeat(RECORDS));
    let found = fit(&problem, &start, &FitOptions { tolerance: 0.01, ..options() }.exact()).expect("possible");
    let normal = found.linear.normal(&problem, &found.noise);
    let covariance = Posterior::new(problem.coordinates(), &found.u, &normal).covariance(&found.held);
    // Along the floor of the valley half of what the common one moves is made up for by each of a record's own.
    let common = (1.0 + 0.5 * RECORDS as f64).sqrt().recip();
    let sigma = covariance[(0, 0)].sqrt();
    assert!((sigma / common - 1.0).abs() < 0.1, "{sigma} for {common}");
    let own = covariance[(1, 1)].sqrt();
    assert!(own > 0.7, "{own}");
    assert!(found.u.iter().all(|u| u.abs() < 0.3), "{:?}", found.u);
}
