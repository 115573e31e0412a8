//! Fits simulate as exactly as the recorder can see.

mod recorded;

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
    Subject::new(&file, &campaign, &NuisanceSizes::default())
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
        assert!(noisiest_m(of_quiet) > 2.0 * stated(of_quiet), "{level:?}: {}", noisiest_m(of_quiet));
    }
    // On the way less is enough, where a sensor is loud.
    assert!(step_s(loud.setup(Level::Low)) > step_s(loud.setup(Level::High)));
    // Steps on a stop span several where a fit does not see it: what they cut short may be an effect's by its look.
    let spans = [&loud, &quiet].map(|subject| most_span(subject.setup(Level::High)));
    assert_eq!(spans[1], 1);
    assert!(spans[0] > 1, "{spans:?}");
}
