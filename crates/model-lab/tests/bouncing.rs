//! A piston that bounces on its stops: what their damping is, only records of it tell, and a valve file keeps it.

mod recorded;

use identify::{Problem, Stop};
use model_lab::Dataset;
use model_lab::calibrate::Calibration;
use model_lab::compare::Comparison;
use model_lab::identification::{Nuisance, NuisanceSizes, Subject};
use recorded::{Noise, Off, campaign, commanded, stroke};
use valve_file::ValveFile;
use valve_model::ParameterId;

/// Supplies that close the valve fast enough to bounce, Pa.
const SUPPLIES_PA: [f64; 2] = [5.5e5, 7.5e5];

/// When it is told to close, true, and to open, and when the record ends, s.
const COMMANDS: [(f64, bool); 2] = [(0.1, true), (1.1, false)];
const END_S: f64 = 2.1;

fn testbed() -> ValveFile {
    ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve")
}

/// The valve of the testbed with large orifices and little that brakes it.
fn quick() -> ValveFile {
    let quick = [
        (ParameterId::ViscousFriction, 10.0),
        (ParameterId::MovingMass, 6.0),
        (ParameterId::SolenoidOrificeArea, 2e-5),
        (ParameterId::PortOrificeArea, 4e-5),
    ];
    testbed().with_parameters(&quick).expect("a possible valve")
}

#[test]
fn the_damping_of_stops_is_found_and_kept() {
    let file = quick();
    let mut noise = Noise(5);
    let valve = file.with_parameter(ParameterId::StopDamping, 500.0).expect("a possible valve").valve().clone();
    let runs = SUPPLIES_PA.map(|supply| commanded(&valve, supply, (&COMMANDS, END_S), &Off::default(), &mut noise));
    let campaign = campaign(runs.into());
    let calibration = Calibration::new(&file, &campaign, Stop::never()).expect("it strokes");
    let damping = calibration.beside.iter().find(|one| one.id == ParameterId::StopDamping).expect("found");
    assert!((damping.after / 500.0 - 1.0).abs() < 0.1, "{damping:?}");
    assert!(calibration.nuisances.iter().all(|other| other.what != "damping of the stops"));
    let adopted = calibration.adopted(&file, "bench").expect("a valid file");
    let error = |file: &ValveFile| {
        let subject = Subject::new(file, &campaign, &NuisanceSizes::default(), Stop::never());
        let data = Dataset::new(&campaign, file.schedule());
        Comparison::new(&subject, file.valve(), &data).expect("it strokes").overall.errors.normalised_rms
    };
    let [before, after] = [&file, &adopted].map(error);
    assert!(after < 0.1 * before, "{after} for {before}");
}

#[test]
fn a_damping_that_is_stated_may_be_less_down_to_none() {
    let runs = vec![stroke(testbed().valve(), SUPPLIES_PA[0], &Off::default(), &mut Noise(7))];
    let campaign = campaign(runs);
    for stated_n_s_per_m in [0.0, 500.0] {
        let file = testbed().with_parameter(ParameterId::StopDamping, stated_n_s_per_m).expect("a possible valve");
        let subject = Subject::new(&file, &campaign, &NuisanceSizes::default(), Stop::never());
        let model = subject.stated(Stop::never()).expect("it strokes");
        let place = model.problem.place_of(Nuisance::StopDamping).expect("is a nuisance");
        let mut least = vec![0.0; model.problem.coordinates().len()];
        least[place] = model.problem.coordinates()[place].lower;
        let down_n_s_per_m = model.problem.nuisance(&least, Nuisance::StopDamping);
        assert!((stated_n_s_per_m + down_n_s_per_m).abs() < 1e-9, "{down_n_s_per_m}");
    }
}

#[test]
fn stops_that_nothing_bounces_on_are_left_alone() {
    let file = testbed();
    let mut noise = Noise(6);
    let runs = SUPPLIES_PA.map(|supply| stroke(file.valve(), supply, &Off::default(), &mut noise));
    let calibration = Calibration::new(&file, &campaign(runs.into()), Stop::never()).expect("it strokes");
    assert!(calibration.beside.is_empty(), "{:?}", calibration.beside);
}
