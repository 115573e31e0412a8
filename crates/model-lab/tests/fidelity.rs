//! Fits simulate as exactly as the recorder can see.

mod recorded;

use identify::Stop;
use identify::problem::predict_all;
use identify::select::Level;
use model_lab::identification::{NuisanceSizes, Setup, Subject};
use recorded::{Noise, Off, campaign, stroke};
use valve_file::ValveFile;

/// The same strokes from a sensor of some noise.
fn subject(noise_m: f64) -> Subject {
    let file = ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve");
    let mut noise = Noise(5);
    let runs = [4.8e5, 6.4e5].map(|supply_pa| stroke(file.valve(), supply_pa, &Off::default(), &mut noise));
    let mut campaign = campaign(runs.into());
    campaign.sensors.position_noise_m = Some(noise_m);
    Subject::new(&file, &campaign, &NuisanceSizes::default(), Stop::never())
}

/// The longest step of any record, s.
fn step_s(setup: &Setup) -> f64 {
    setup.recordings.iter().map(|unit| unit.fidelity.step_s).fold(0.0, f64::max)
}

/// Steps that one may span on a stop in any record.
fn most_span(setup: &Setup) -> u32 {
    setup.recordings.iter().map(|unit| unit.fidelity.most_span).fold(1, u32::max)
}

/// Noise of the noisiest row of positions, m.
fn noisiest_m(setup: &Setup) -> f64 {
    let rows = setup.records.iter().flat_map(identify::Record::rows);
    rows.map(|row| row.sigma).fold(0.0, f64::max)
}

#[test]
fn a_quiet_sensor_is_simulated_more_exactly_and_what_is_cut_short_is_noise() {
    let (loud, quiet) = (subject(2e-4), subject(1e-8));
    for level in [Level::Low, Level::High] {
        let [of_loud, of_quiet] = [&loud, &quiet].map(|subject| subject.setup(level));
        assert!(step_s(of_quiet) < step_s(of_loud), "{level:?}: {} s", step_s(of_quiet));
        // What a millisecond's steps cut short is nothing to a loud sensor, and more than the noise of a quiet one.
        let stated = |setup: &Setup| setup.noise_m.expect("positions");
        assert!(noisiest_m(of_loud) < 1.1 * stated(of_loud), "{level:?}: {}", noisiest_m(of_loud));
        if level == Level::Low {
            assert!(noisiest_m(of_quiet) > 2.0 * stated(of_quiet), "{}", noisiest_m(of_quiet));
        }
    }
    // On the way less is enough, where a sensor is loud.
    assert!(step_s(loud.setup(Level::Low)) > step_s(loud.setup(Level::High)));
    // On the way steps on a stop span several where that costs little. What decides takes every one: in which block a piston
    // begins to rest jumps with every parameter.
    let spans = |level| [&loud, &quiet].map(|subject| most_span(subject.setup(level)));
    let [of_loud, of_quiet] = spans(Level::Low);
    assert!(of_loud > 1 && of_quiet == 1, "{of_loud}, {of_quiet}");
    assert_eq!(spans(Level::High), [1, 1]);
}

#[test]
fn what_decides_is_off_by_less_than_would_move_a_value() {
    // A sensor for which the usual step is too long by far, and a finer one does.
    let subject = subject(2e-7);
    let off = |step: f64| {
        let mut setup = subject.setup(Level::High).clone();
        for recording in &mut setup.recordings {
            recording.fidelity.step_s *= step;
        }
        let problem = subject.problem(subject.space.clone(), Level::High, Stop::never()).on(&setup);
        predict_all(&problem, &[problem.start()]).remove(0).expect("a valve that can be simulated")
    };
    let (as_it_is, finer) = (off(1.0), off(0.25));
    let records = subject.setup(Level::High).records.iter().zip(as_it_is.iter().zip(&finer));
    let nats: f64 = records
        .flat_map(|(record, (one, other))| record.rows().zip(one.iter().zip(other)))
        .map(|(row, (one, other))| 0.5 * ((one - other) / row.sigma).powi(2))
        .sum();
    assert!(step_s(subject.setup(Level::High)) < 1e-3, "{} s", step_s(subject.setup(Level::High)));
    assert!(nats < 0.1, "{nats} nats");
}
