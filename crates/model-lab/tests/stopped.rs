//! A wish to stop is heeded inside whatever is simulated.

mod recorded;

use std::sync::Mutex;

use campaign::Campaign;
use identify::select::Level;
use identify::{Problem, Request, Stop};
use model_lab::diagnosis::{DiagnoseOptions, Progress, Verdict, explain};
use model_lab::identification::{NuisanceSizes, Subject};
use recorded::{Noise, Off, campaign, stroke};
use valve_file::ValveFile;
use valve_model::Valve;

fn testbed() -> ValveFile {
    ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve")
}

/// Strokes of another valve than the file's, so that there is something to look for.
fn strokes(file: &ValveFile) -> Campaign {
    let sound = file.valve();
    let mut parameters = sound.parameters().clone();
    parameters.flow_coefficient *= 1.3;
    let valve = Valve::new(parameters, sound.switches(), Vec::new(), Vec::new()).expect("a valid valve");
    let mut noise = Noise(11);
    campaign([4.8e5, 6.4e5].map(|supply_pa| stroke(&valve, supply_pa, &Off::default(), &mut noise)).into())
}

#[test]
fn nothing_is_simulated_once_somebody_asked_to_stop() {
    let file = testbed();
    let subject = Subject::new(&file, &strokes(&file), &NuisanceSizes::default(), Stop::never());
    let stop = Stop::new();
    let problem = subject.problem(subject.space.clone(), Level::Low, &stop);
    let requests: Vec<Request> = (0..problem.records().len()).map(|record| Request { point: 0, record }).collect();
    assert!(problem.predict(&[problem.start()], &requests).iter().all(Option::is_some));
    stop.ask();
    assert!(problem.predict(&[problem.start()], &requests).iter().all(Option::is_none));
}

#[test]
fn a_search_that_is_stopped_early_knows_nothing() {
    let file = testbed();
    let stop = Stop::new();
    stop.ask();
    assert!(explain(&file, &strokes(&file), &DiagnoseOptions::default(), &|_| (), &stop).is_none());
}

#[test]
fn a_search_that_is_stopped_on_its_way_says_what_it_knows() {
    let file = testbed();
    let (stop, fitted) = (Stop::new(), Mutex::new(Vec::new()));
    let tell = |progress: Progress| {
        if let Progress::Tried { kinds, .. } = progress {
            fitted.lock().expect("nobody panicked").push(kinds);
            stop.ask();
        }
    };
    // On one thread no other fit is under way.
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let found = alone.install(|| explain(&file, &strokes(&file), &DiagnoseOptions::default(), &tell, &stop));
    let found = found.expect("it was calibrated");
    assert!(found.interrupted && found.recommended.is_empty(), "{found:?}");
    assert_eq!(found.verdict, Verdict::NotEnoughData);
    let mut fitted = fitted.into_inner().expect("nobody panicked");
    fitted.dedup();
    assert_eq!(fitted.len(), 1, "no other set is fitted after a stop: {fitted:?}");
}
