//! Made-up numbers in the shape of real ones.

use report::Figure;
use report::figures::{
    Candidate, EffectFigure, ExperimentFigure, LeaderboardFigure, MissingFigure, MissingPoint, OverlayFigure,
    OverlayRun, ParameterShift, ParametersFigure, Prediction, PrognosisFigure, PrognosisPoint, Quantity,
    SignatureFigure, StaircaseFigure, StaircaseStep, Standing, StripRow, StripsFigure, StudyFigure, StudyPoint,
    StudySeries, TableFigure, TablePoint, TraceFigure, UnexplainedFigure,
};

/// Every figure with its name.
pub fn all() -> Vec<(&'static str, Figure)> {
    vec![
        ("trace", trace()),
        ("table", table()),
        ("prognosis", prognosis()),
        ("study", study()),
        ("overlay", overlay()),
        ("strips", strips()),
        ("missing", missing()),
        ("unexplained", unexplained()),
        ("leaderboard", leaderboard()),
        ("staircase", staircase()),
        ("parameters", parameters()),
        ("experiment", experiment()),
        ("signature", signature()),
        ("effect", effect()),
    ]
}

/// Position of a made-up stroke: open at 0 s, closed at about 1 s, open again after 4 s.
fn position_mm(time_s: f64, late_s: f64) -> f64 {
    let ramp = |share: f64| share.clamp(0.0, 1.0);
    let closing = ramp((time_s - 0.35 - late_s) / 0.69);
    let opening = ramp((time_s - 4.9 - late_s) / 1.2);
    25.4 * (1.0 - closing * (2.0 - closing) + opening * opening)
}

fn times(end: f64) -> Vec<f64> {
    (0..=600).map(|index| f64::from(index) * end / 600.0).collect()
}

/// A repeatable sequence between -1 and 1.
fn wobble(index: usize) -> f64 {
    let mixed = (index as u64).wrapping_mul(6_364_136_223_846_793_005).rotate_left(17) % 2001;
    mixed as f64 / 1000.0 - 1.0
}

fn trace() -> Figure {
    let time_s = times(8.0);
    let closed = |time: f64| time < 4.0;
    let fill = |time: f64, tau: f64| {
        if closed(time) { 1.0 - (-time / tau).exp() } else { (-(time - 4.0) / tau).exp() }
    };
    TraceFigure {
        title: "A cycle at 75 psig".to_owned(),
        subtitle: "closes in 1.042 s, opens in 2.134 s".to_owned(),
        command_close: time_s.iter().map(|time| closed(*time)).collect(),
        position_mm: time_s.iter().map(|time| position_mm(*time, 0.0)).collect(),
        chamber_pressure_kpa: time_s.iter().map(|time| 101.3 + 517.0 * fill(*time, 0.9)).collect(),
        pipe_pressure_kpa: time_s.iter().map(|time| 101.3 + 517.0 * fill(*time, 0.6)).collect(),
        supply_pressure_kpa: Some(618.4),
        stroke_mm: 25.4,
        events: vec![(1.042, "closed after 1.042 s".to_owned()), (6.134, "open after 2.134 s".to_owned())],
        time_s,
    }
    .figure()
}

fn table() -> Figure {
    let points = (0..=40)
        .map(|index| {
            let area = f64::from(index) * 0.018;
            TablePoint {
                severity: area,
                close_time_s: Some(1.04 + 2.3 * area + 3.0 * area.powi(4)),
                open_time_s: (area < 0.68).then(|| 2.13 / (1.0 + 3.0 * area)),
            }
        })
        .collect();
    TableFigure {
        fault: "leak to atmosphere".to_owned(),
        quantity: Quantity::new("leak area", "mm²"),
        points,
        interpolated: Vec::new(),
        close_limit_s: Some(2.6),
        open_limit_s: None,
        severity_at_limit: Some(0.587),
    }
    .figure()
}

fn prognosis() -> Figure {
    let points = (0..=24_u32)
        .map(|index| {
            let cycle = f64::from(index);
            let spread = 14.0 / (1.0 + cycle);
            let error = spread * 0.5 * wobble(index as usize);
            let leak = 0.0235 * cycle + 0.01 * wobble(index as usize + 90);
            PrognosisPoint {
                cycle,
                readings: [0, 50].map(|shift| Some(leak + 0.02 * wobble(index as usize + shift))),
                severity: Some(leak),
                severity_bounds: Some([leak - 0.018, leak + 0.018]),
                rul_cycles: (index > 1).then_some(25.0 - cycle + error),
                rul_bounds_cycles: (index > 1)
                    .then_some([25.0 - cycle + error - spread, 25.0 - cycle + error + 1.3 * spread]),
                fault_probability: {
                    let known = 1.0 - (-cycle / 1.2).exp();
                    vec![1.0 - known, 0.98 * known, 0.02 * known]
                },
            }
        })
        .collect();
    PrognosisFigure {
        title: "Valve DV-1: leak to atmosphere, 1 cycle left".to_owned(),
        subtitle: "Bayesian estimate, timing noise 32 ms".to_owned(),
        points,
        quantity: Quantity::new("leak area", "mm²"),
        estimated: "estimated leak".to_owned(),
        severity_at_limit: Some(0.587),
        faults: ["none", "leak to atmosphere", "leak from the supply"].map(str::to_owned).into(),
        true_eol_cycle: Some(25.0),
        alpha: 0.1,
    }
    .figure()
}

fn study() -> Figure {
    let series = |name: &str, drop: f64| StudySeries {
        name: name.to_owned(),
        points: [0.0, 1e-4, 1e-3, 1e-2]
            .into_iter()
            .enumerate()
            .map(|(index, noise_variance_s2)| {
                let median = 1.0 - drop * index as f64;
                let half = 0.03 * index as f64;
                StudyPoint { noise_variance_s2, median, bounds: Some([median - half, (median + half).min(1.0)]) }
            })
            .collect(),
    };
    let all = || vec![series("bayes", 0.04), series("least squares", 0.1), series("paper", 0.2)];
    StudyFigure {
        title: "Relative accuracy of the remaining life".to_owned(),
        subtitle: "300 lives of 25 cycles each; median and 10 to 90 %".to_owned(),
        faults: vec![("leak to atmosphere".to_owned(), all()), ("leak from the supply".to_owned(), all())],
    }
    .figure()
}

fn overlay() -> Figure {
    let run = |name: &str, late: f64| {
        let time_s = times(7.0);
        OverlayRun {
            name: name.to_owned(),
            measured_mm: time_s
                .iter()
                .enumerate()
                .map(|(index, time)| position_mm(*time, late) + 0.05 * wobble(index))
                .collect(),
            simulated_mm: time_s.iter().map(|time| position_mm(*time, 0.0)).collect(),
            time_s,
        }
    };
    OverlayFigure {
        title: "The valve breaks away late".to_owned(),
        subtitle: "rms error 0.61 mm, 20 times the noise".to_owned(),
        runs: vec![run("run 1, 55 psig", 0.03), run("run 2, 75 psig", 0.05)],
        noise_mm: Some(0.03),
    }
    .figure()
}

fn strips() -> Figure {
    let rows = |size: f64| {
        (0..14)
            .map(|index| {
                let time_s = times(3.0);
                let kind = if index < 7 { "closing" } else { "opening" };
                StripRow {
                    name: format!("{kind} {} psig", 55 + 10 * (index % 5)),
                    residual_mm: time_s
                        .iter()
                        .enumerate()
                        .map(|(at, time)| {
                            size * (-(time - 1.0 - 0.05 * index as f64).powi(2) / 0.1).exp()
                                - 0.5 * size * (-(time - 1.8).powi(2) / 0.05).exp()
                                + 0.02 * wobble(at * 7 + index)
                        })
                        .collect(),
                    time_s,
                }
            })
            .collect()
    };
    StripsFigure {
        title: "What repeats from stroke to stroke".to_owned(),
        subtitle: "before and after dry friction was added".to_owned(),
        stages: vec![("calibrated".to_owned(), rows(0.8)), ("+ dry-friction".to_owned(), rows(0.05))],
    }
    .figure()
}

fn missing() -> Figure {
    let bins = |sign: f64| -> Vec<MissingPoint> {
        (1..25_u32)
            .map(|index| {
                let at = f64::from(index);
                MissingPoint {
                    at,
                    value: sign * 90.0 * (-(at - 15.0).powi(2) / 6.0).exp() + 3.0 * wobble(index as usize),
                    standard_error: 5.0,
                }
            })
            .collect()
    };
    MissingFigure {
        title: "A force of about 90 N is missing around 15 mm, against the motion".to_owned(),
        subtitle: "weak form over 100 ms".to_owned(),
        quantity: "missing force (N)".to_owned(),
        axes: vec![
            ("position (mm)".to_owned(), bins(1.0), bins(-1.0)),
            ("chamber pressure (kPa)".to_owned(), bins(0.3), bins(-0.2)),
        ],
    }
    .figure()
}

fn unexplained() -> Figure {
    let bump = |at: f64| 10.0 + 90.0 * (-((at - 15.0) / 1.8_f64).powi(2)).exp();
    let places = |count: u32| (0..=count).map(move |index| 25.4 * f64::from(index) / f64::from(count));
    UnexplainedFigure {
        title: "No effect of the catalogue explains it".to_owned(),
        subtitle: "what is missing, fitted without a law, and a formula".to_owned(),
        axis: "position (mm)".to_owned(),
        quantity: "missing friction (N)".to_owned(),
        table: places(12).map(|at| MissingPoint { at, value: bump(at), standard_error: 3.0 }).collect(),
        formula: places(400).map(|at| [at, bump(at)]).collect(),
    }
    .figure()
}

fn leaderboard() -> Figure {
    let candidate = |name: &str, fitted: f64, held_out: Option<f64>, standing| Candidate {
        name: name.to_owned(),
        fitted,
        held_out,
        standing,
        text: format!("{:.3} mm", 0.011 * fitted),
    };
    LeaderboardFigure {
        title: "Dry friction explains what is left".to_owned(),
        subtitle: "F_c = 40.2 ± 0.4 N; seal-friction cannot be excluded by these data".to_owned(),
        candidates: vec![
            candidate("sensor-lag", 4.1, None, Standing::Rejected),
            candidate("dry-friction", 0.98, Some(1.02), Standing::Recommended),
            candidate("seal-friction", 1.01, Some(1.06), Standing::Alike),
            candidate("back-pressure", 6.3, None, Standing::Rejected),
            candidate("vent-restriction", 7.2, None, Standing::Rejected),
            candidate("progressive-spring", 7.3, Some(8.9), Standing::Rejected),
        ],
        without: Some(7.4),
    }
    .figure()
}

fn staircase() -> Figure {
    let step = |name: &str, fitted: f64, held_out: f64| StaircaseStep {
        name: name.to_owned(),
        fitted,
        held_out: Some(held_out),
    };
    StaircaseFigure {
        title: "The error falls from 63 to 1.01 times the noise".to_owned(),
        subtitle: "rms over 7 runs; held out: whole supply pressures".to_owned(),
        steps: vec![
            step("datasheet", 63.0, 63.0),
            step("calibrated", 7.4, 9.8),
            step("+ dry-friction", 1.9, 2.2),
            step("+ supply-droop", 1.01, 1.04),
        ],
    }
    .figure()
}

fn parameters() -> Figure {
    let shift = |name: &str, calibrated: f64, repaired: f64| ParameterShift {
        name: name.to_owned(),
        calibrated,
        calibrated_error: 0.3,
        repaired: Some((repaired, 0.35)),
    };
    ParametersFigure {
        title: "Calibration alone drove the preload out; the effect brings it back".to_owned(),
        subtitle: "bars: 5 to 95 %".to_owned(),
        parameters: vec![
            shift("actuator.viscous_friction", 1.8, 0.4),
            shift("actuator.dead_volume", -2.2, -0.1),
            shift("spring.stiffness", 0.9, 0.3),
            shift("spring.preload_compression", 4.1, 0.8),
            shift("pneumatics.solenoid_orifice_area", -1.1, -0.6),
        ],
    }
    .figure()
}

fn experiment() -> Figure {
    let time_s = times(3.0);
    let predict = |name: &str, late: f64| Prediction {
        name: name.to_owned(),
        position_mm: time_s.iter().map(|time| position_mm(*time, late)).collect(),
    };
    ExperimentFigure {
        title: "Next: vent before the end of the stroke".to_owned(),
        subtitle: "separates solenoid-lag from sensor-lag by 19 sigma".to_owned(),
        predictions: vec![predict("solenoid-lag", 0.0), predict("sensor-lag", 0.02)],
        time_s: time_s.clone(),
        noise_mm: 0.03,
    }
    .figure()
}

fn signature() -> Figure {
    let line = |offset: f64| (0..=25).map(|x| [f64::from(x), 185.0 + 5.1 * f64::from(x) + offset]).collect();
    SignatureFigure {
        title: "Valve signature at 75 psig".to_owned(),
        subtitle: "bench set 185 to 315 kPa, spring 15.9 kN/m, friction band 26 kPa (81 N)".to_owned(),
        closing: line(13.0),
        opening: line(-13.0),
        spring: line(0.0),
    }
    .figure()
}

fn effect() -> Figure {
    let stroke = |late: f64| times(8.0).into_iter().map(|time| [time, position_mm(time, late)]).collect();
    EffectFigure {
        title: "dry-friction".to_owned(),
        subtitle: "coulomb_force = 40 N".to_owned(),
        without: stroke(0.0),
        with: stroke(0.08),
    }
    .figure()
}
