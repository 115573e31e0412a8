//! A first impression: runs that lie far apart, seen as they are in the whole campaign.

mod recorded;

use model_lab::explain::impression::Impression;
use model_lab::fit::{FitOptions, fit};
use model_lab::forward::residuals;
use model_lab::{Dataset, Scatter, Space};
use recorded::{Noise, campaign, recorded};
use valve_file::ValveFile;
use valve_model::Conditions;

fn testbed() -> ValveFile {
    ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve")
}

/// Three strokes at each of four supply pressures and with a leak, their solenoid late by 0 to 4 ms.
fn repeated(file: &ValveFile) -> Dataset {
    let valve = file.valve();
    let nominal = Conditions::nominal(valve.parameters());
    let mut conditions: Vec<Conditions> = [5.6e5, 5.2e5, 6.0e5, 6.6e5]
        .iter()
        .map(|supply| Conditions { supply_pressure_pa: *supply, ..nominal })
        .collect();
    conditions.push(Conditions { leak_to_atmosphere_m2: 1.5e-7, ..nominal });
    let mut noise = Noise(7);
    let strokes = conditions.iter().flat_map(|conditions| [0.0, 4e-3, 1e-3].map(|late_s| (*conditions, late_s)));
    campaign(strokes.map(|(conditions, late_s)| recorded(valve, conditions, 0.0, late_s, &mut noise)).collect())
}

#[test]
fn it_holds_runs_under_conditions_that_lie_far_apart() {
    let file = testbed();
    let rough = repeated(&file).rough();
    let seen = Impression::of(&rough, &Scatter::none());
    let conditions: Vec<Conditions> = seen.data.runs.iter().map(|run| run.run.conditions).collect();
    assert_eq!(conditions.len(), 3);
    let has = |wanted: &dyn Fn(&Conditions) -> bool| conditions.iter().filter(|one| wanted(one)).count();
    assert_eq!(has(&|one| one.supply_pressure_pa == 5.2e5), 1, "the lowest supply pressure: {conditions:?}");
    assert_eq!(has(&|one| one.supply_pressure_pa == 6.6e5), 1, "the highest supply pressure: {conditions:?}");
    assert_eq!(has(&|one| one.leak_to_atmosphere_m2 > 0.0), 1, "the leak: {conditions:?}");

    let alike = rough.only(|unit| unit < 3);
    assert_eq!(Impression::of(&alike, &Scatter::none()).data.runs.len(), 1, "repeats add nothing to start from");
}

#[test]
fn it_shows_a_fit_as_the_whole_campaign_does() {
    let file = testbed();
    let data = repeated(&file);
    let scatter = Scatter::estimate(&data, file.valve());
    assert!(scatter.largest_delay_s() > 5e-4, "the solenoid was late by 0 to 4 ms: {:?}", scatter.sizes());
    let rough = data.rough();
    let space = Space::tolerated(&file);
    let whole = fit(&rough, &scatter, &space, &space.start(), FitOptions { steps: 1, ..FitOptions::default() });
    let whole = whole.expect("the valve can be simulated");

    let seen = Impression::of(&rough, &scatter);
    let shown = seen.shown(&rough, &whole);
    assert_eq!(shown.residual, residuals(&seen.data, &[whole.valve()]).remove(0));
    assert_eq!(shown.jacobian.len(), space.coordinates.len());
    assert!(shown.jacobian.iter().all(|column| column.len() == shown.residual.len()));
    let part = seen.scatter.dot(&shown.residual, &shown.residual);
    assert!(part < scatter.dot(&whole.residual, &whole.residual), "a part leaves less than the whole");

    let all = scatter.only(&rough, |_| true);
    let (one, other) = (&whole.residual, &whole.jacobian[0]);
    let difference = all.dot(one, other) - scatter.dot(one, other);
    assert!(difference.abs() < 1e-9 * scatter.dot(one, one), "all of a scatter is the scatter: {difference}");
}
