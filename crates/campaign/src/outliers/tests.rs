//! What is taken out of a record, and what is left alone.

use super::*;

/// Nearly normal numbers from a linear congruential generator (Knuth's MMIX constants).
fn normal(seed: &mut u64) -> f64 {
    let mut uniform = || {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

/// A recording of a valve of 26 mm that is told to close at 0.5 s and to open at 2.5 s, in mm.
struct Recorder {
    step_s: f64,
    noise_mm: f64,
    step_mm: f64,
    stroke_s: f64,
    /// Height and frequency of a ringing after the stop.
    ringing: (f64, f64),
}

impl Recorder {
    const USUAL: Self = Self { step_s: 1e-3, noise_mm: 0.03, step_mm: 0.005, stroke_s: 0.3, ringing: (0.0, 0.0) };

    fn clean(&self, time_s: f64) -> f64 {
        let part = |since_s: f64| (since_s / self.stroke_s).clamp(0.0, 1.0).powi(2);
        let since_stop_s = time_s - 0.7 - self.stroke_s;
        let ring = if since_stop_s > 0.0 && time_s < 2.5 {
            let (height, frequency) = self.ringing;
            height * (-since_stop_s / 0.1).exp() * (std::f64::consts::TAU * frequency * since_stop_s).sin()
        } else {
            0.0
        };
        26.0 * (1.0 - part(time_s - 0.7) + part(time_s - 2.8)) + ring
    }

    fn record(&self, seed: u64) -> (Vec<f64>, Vec<f64>) {
        let mut seed = seed;
        let rows = std::iter::successors(Some(0.0), |row| Some(row + 1.0));
        let time_s: Vec<f64> = rows.map(|row| row * self.step_s).take_while(|time_s| *time_s < 3.9999).collect();
        let values = time_s.iter().map(|time| {
            let value = self.clean(*time) + self.noise_mm * normal(&mut seed);
            (value / self.step_mm).round() * self.step_mm
        });
        let values = values.collect();
        (time_s, values)
    }
}

const EDGES: [f64; 2] = [0.5, 2.5];

fn recorders() -> Vec<Recorder> {
    let mut all = Vec::new();
    for step_s in [1e-4, 1e-3, 5e-3, 2e-2, 0.1] {
        for (noise_mm, step_mm) in [(0.03, 0.005), (0.0, 1e-6), (0.03, 0.2), (0.01, 0.5), (0.1, 1e-9)] {
            for stroke_s in [0.02, 0.3, 1.0] {
                for ringing in [(0.0, 0.0), (0.5, 55.0), (2.0, 20.0)] {
                    all.push(Recorder { step_s, noise_mm, step_mm, stroke_s, ringing });
                }
            }
        }
    }
    all
}

#[test]
fn nothing_is_taken_from_a_clean_record_however_it_was_recorded() {
    for (seed, recorder) in recorders().iter().enumerate() {
        let (time_s, values) = recorder.record(seed as u64);
        let found = find(&time_s, &values, &EDGES);
        let Recorder { step_s, noise_mm, step_mm, stroke_s, ringing } = recorder;
        assert_eq!(found, Found::default(), "{step_s} s, {noise_mm} mm, {step_mm} mm, {stroke_s} s, {ringing:?}");
    }
}

#[test]
fn outliers_are_found_wherever_they_are_and_nothing_else_is() {
    let (time_s, clean) = Recorder::USUAL.record(5);
    // At rest, in fast motion, at the corner of the stop, next to each other, at both ends of the record.
    for (rows, value) in [
        (vec![300], 0.0),
        (vec![850], 26.0),
        (vec![999], 15.0),
        (vec![1001], 26.0),
        (vec![300, 301], 0.0),
        (vec![400, 401, 402], 52.0),
        (vec![500, 502], -30.0),
        (vec![0], 0.0),
        (vec![0, 1], 52.0),
        (vec![3999], 0.0),
        (vec![2000, 2900, 3500], 13.0),
        ((1500..1530).collect(), 32.767),
    ] {
        let mut values = clean.clone();
        for row in &rows {
            values[*row] = value;
        }
        assert_eq!(find(&time_s, &values, &EDGES).rows, rows, "{value}");
    }
}

#[test]
fn random_spikes_leave_hardly_any_large_one_behind() {
    for step_s in [1e-3, 1e-2] {
        let recorder = Recorder { step_s, ..Recorder::USUAL };
        let (mut bad, mut missed, mut wrong) = (0, 0, 0);
        for run in 0..20u64 {
            let (time_s, mut values) = recorder.record(run);
            let mut seed = run + 77;
            let mut spiked = Vec::new();
            for (row, value) in values.iter_mut().enumerate() {
                if normal(&mut seed) > 2.5 {
                    *value += 6.0 * normal(&mut seed);
                    spiked.push(row);
                }
            }
            let found = find(&time_s, &values, &EDGES).rows;
            let large = |row: &usize| (values[*row] - recorder.clean(time_s[*row])).abs() > 2.0;
            bad += spiked.iter().filter(|row| large(row)).count();
            missed += spiked.iter().filter(|row| large(row) && !found.contains(row)).count();
            wrong += found.iter().filter(|row| !spiked.contains(row)).count();
        }
        assert!(bad > 10 && missed * 50 <= bad && wrong == 0, "{missed} of {bad} missed, {wrong} wrong at {step_s} s");
    }
}

#[test]
fn a_short_stroke_on_a_slow_recorder_is_no_outlier() {
    let time_s: Vec<f64> = (0..60).map(|row| f64::from(row) * 0.1).collect();
    for pulse in [vec![20.0], vec![22.0, 18.0], vec![20.0, 8.0, 17.0]] {
        let mut values: Vec<f64> = (0..60).map(|row| 26.0 + 0.02 * f64::from(row % 3)).collect();
        for (row, value) in pulse.iter().enumerate() {
            values[30 + row] = *value;
        }
        assert_eq!(find(&time_s, &values, &[2.8, 2.95]), Found::default());
        // The same without a command is none.
        assert_eq!(find(&time_s, &values, &[]).rows.len(), pulse.len());
    }
}

#[test]
fn a_record_full_of_jumps_is_left_as_it_is() {
    let (time_s, mut values) = Recorder::USUAL.record(1);
    for row in (0..4000).step_by(12) {
        values[row] = 0.5 * f64::from(u32::try_from(row % 100).unwrap());
    }
    let found = find(&time_s, &values, &EDGES);
    assert!(found.rows.is_empty() && found.too_many > 200, "{found:?}");
}

#[test]
fn records_too_short_or_dead_hold_none() {
    for values in [vec![], vec![1.0; 5], vec![f64::NAN; 50], vec![3.0; 50]] {
        let time_s: Vec<f64> = (0..values.len()).map(|row| row as f64).collect();
        assert_eq!(find(&time_s, &values, &[]), Found::default());
    }
}

#[test]
fn a_sensor_that_is_stuck_on_the_way_is_found_and_one_that_is_in_order_is_not() {
    let (mut looked_at, mut found) = (0, 0);
    for (case, recorder) in recorders().into_iter().enumerate() {
        let (time_s, values) = recorder.record(case as u64 + 77);
        assert_eq!(stuck(&time_s, &values), [], "case {case}");
        // Stuck from a third of the way on for a third of it, where noise shows between rows.
        let (from_s, to_s) = (0.7 + 0.4 * recorder.stroke_s, 0.7 + 0.8 * recorder.stroke_s);
        let (from, to) = (time_s.partition_point(|t| *t < from_s), time_s.partition_point(|t| *t < to_s));
        if recorder.step_mm > recorder.noise_mm || to - from < 20 {
            continue;
        }
        let mut held = values.clone();
        held[from..to].fill(values[from]);
        looked_at += 1;
        found += usize::from(stuck(&time_s, &held).iter().eq([&(from + 1..to)]));
    }
    assert!(looked_at > 20 && found == looked_at, "{found} of {looked_at}");
}

#[test]
fn a_sensor_that_is_stuck_for_long_is_found_however_far_the_valve_has_come_meanwhile() {
    let (mut looked_at, mut missed) = (0, Vec::new());
    for (step_s, noise_mm, step_mm) in
        [(1e-3, 0.03, 0.005), (1e-3, 0.004, 0.005), (2e-3, 0.01, 0.005), (5e-3, 0.03, 0.005), (1e-3, 0.1, 1e-9)]
    {
        for stroke_s in [0.3, 0.6, 1.0] {
            let recorder = Recorder { step_s, noise_mm, step_mm, stroke_s, ..Recorder::USUAL };
            let (time_s, values) = recorder.record(11);
            // Soon after the piston began to move, or late: then it rests at a stop before the sensor is back.
            for (part, held_s) in [(0.2, 0.25), (0.2, 0.45), (0.4, 0.45), (0.4, 0.8), (0.7, 0.45), (0.7, 0.6)] {
                let from_s = 0.7 + part * stroke_s;
                let from = time_s.partition_point(|t| *t < from_s);
                let to = time_s.partition_point(|t| *t < from_s + held_s);
                let mut held = values.clone();
                held[from..to].fill(values[from]);
                looked_at += 1;
                if !stuck(&time_s, &held).iter().eq([&(from + 1..to)]) {
                    missed.push((step_s, noise_mm, stroke_s, part, held_s, stuck(&time_s, &held)));
                }
            }
        }
    }
    assert!(missed.is_empty(), "{} of {looked_at}: {missed:?}", missed.len());
}

#[test]
fn a_valve_that_sticks_and_slips_is_not_called_a_stuck_sensor() {
    for step_s in [1e-3, 1e-2, 0.1] {
        for (noise_mm, step_mm) in [(0.0, 1e-6), (0.01, 0.1), (0.03, 0.005), (0.01, 0.5)] {
            // It creeps on for half a second, sticks, and slips by 4 mm within 20 ms.
            for stick_s in [0.5, 2.0] {
                let period_s = 0.5 + stick_s;
                let clean = |time_s: f64| {
                    let since_s = (time_s - 1.0).max(0.0);
                    let (slips, within_s) = ((since_s / period_s).floor(), since_s % period_s);
                    let slip = 4.0 * (1.0 - (1.0 - within_s / 0.02).clamp(0.0, 1.0).powi(2));
                    26.0 - (5.0 * slips + (slip + 2.0 * within_s.min(0.5)).min(5.0)).min(25.0) * f64::from(time_s > 1.0)
                };
                let mut seed = 9;
                let rows = std::iter::successors(Some(0.0), |row| Some(row + 1.0));
                let time_s: Vec<f64> = rows.map(|row| row * step_s).take_while(|time| *time < 14.0).collect();
                let reading =
                    |time_s: &f64| ((clean(*time_s) + noise_mm * normal(&mut seed)) / step_mm).round() * step_mm;
                let values: Vec<f64> = time_s.iter().map(reading).collect();
                assert_eq!(stuck(&time_s, &values), [], "{step_s} s, {noise_mm} mm in steps of {step_mm}, {stick_s} s");
            }
        }
    }
}

#[test]
fn two_outliers_close_to_an_end_do_not_hide_each_other() {
    let mut seed = 5;
    let time_s: Vec<f64> = (0..400).map(|row| f64::from(row) * 0.01).collect();
    let values: Vec<f64> = time_s.iter().map(|time| 0.1 * (time - 3.0).max(0.0) + 5e-5 * normal(&mut seed)).collect();
    for (one, other) in [(395, 398), (1, 4), (394, 397), (2, 5)] {
        let mut spiked = values.clone();
        spiked[one] += 0.13;
        spiked[other] += 0.03;
        assert_eq!(find(&time_s, &spiked, &[3.0]).rows, [one, other], "{one} and {other}");
    }
}
