//! Strokes that differ though none was repeated: what is said of them, and how sure the rest then is.

mod drawn;
mod recorded;

use drawn::drawn;
use model_lab::calibrate::{CalibrateOptions, Calibration, Verdict};
use model_lab::data::RunData;
use model_lab::scatter::{Origin, SOURCES, Source};
use model_lab::{Dataset, Space};
use rayon::prelude::*;
use recorded::{Noise, campaign, recorded};
use valve_file::ValveFile;
use valve_model::{Conditions, Effect, EffectKind, ParameterId, Valve};

/// Campaigns for every size of scatter.
const CAMPAIGNS: u64 = 30;

/// Supply pressures of a campaign, Pa; the strokes with the leaks of [`LEAKS_M2`] are at the third one.
const SUPPLIES_PA: [f64; 5] = [4.8e5, 5.5e5, 6.18e5, 6.9e5, 7.6e5];

/// Leaks opened on purpose in the last two strokes, to the atmosphere and from the supply, m2.
const LEAKS_M2: [(f64, f64); 2] = [(1.5e-7, 0.0), (0.0, 5e-8)];

fn testbed() -> ValveFile {
    ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve")
}

/// The conditions of seven strokes: those at either end of the supply pressures first, then one with a leak.
const ORDER: [usize; 7] = [0, 4, 6, 2, 1, 3, 5];

/// Strokes, each under conditions of its own. Single strokes differ by `scatter` times 1 ms of delay to
/// close and 0.3 % of preload, flow and supply pressure (one standard deviation).
fn strokes(valve: &Valve, count: usize, scatter: f64, noise: &mut Noise) -> Dataset {
    let nominal = Conditions::nominal(valve.parameters());
    let sealed = SUPPLIES_PA.map(|supply_pressure_pa| Conditions { supply_pressure_pa, ..nominal });
    let leaking = LEAKS_M2.map(|(leak_to_atmosphere_m2, leak_from_supply_m2)| Conditions {
        supply_pressure_pa: SUPPLIES_PA[2],
        leak_to_atmosphere_m2,
        leak_from_supply_m2,
        ..nominal
    });
    let stroke = |believed: Conditions| -> RunData {
        let mut share = || 1.0 + 3e-3 * scatter * noise.normal();
        let mut parameters = valve.parameters().clone();
        for id in [ParameterId::PreloadCompression, ParameterId::FlowCoefficient] {
            parameters.set(id, parameters.get(id) * share());
        }
        let true_supply_pa = believed.supply_pressure_pa * share();
        let late_s = 1e-3 * scatter * noise.normal().abs();
        let differs = Valve::new(parameters, valve.switches(), valve.effects().to_vec(), Vec::new());
        let conditions = Conditions { supply_pressure_pa: true_supply_pa, ..believed };
        let mut run = recorded(&differs.expect("a possible valve"), conditions, 0.0, late_s, noise);
        run.run.conditions = believed;
        run
    };
    let conditions: Vec<Conditions> = sealed.into_iter().chain(leaking).collect();
    campaign(ORDER[..count].iter().map(|index| conditions[*index]).map(stroke).collect())
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn intervals_hold_however_much_strokes_differ() {
    let file = testbed();
    for (count, scatter) in [(7, 0.0), (7, 0.1), (7, 1.0), (3, 0.1)] {
        let counts: Vec<(usize, bool)> = (0..CAMPAIGNS)
            .into_par_iter()
            .map(|seed| {
                let mut noise = Noise(7000 + seed);
                let (valve, truth) = drawn(file.valve(), file.tolerances(), &mut noise);
                let data = strokes(&valve, count, scatter, &mut noise);
                let options = CalibrateOptions { hold_out: false, ..CalibrateOptions::default() };
                let found = Calibration::of(&Space::tolerated(&file), &data, file.valve(), options);
                let inside = found.parameters.iter().zip(&truth);
                let inside = inside
                    .filter(|(parameter, truth)| (parameter.interval_90.0..=parameter.interval_90.1).contains(truth));
                (inside.count(), found.verdict == Verdict::Explained)
            })
            .collect();
        let all = counts.len() * file.tolerances().len();
        let coverage = counts.iter().map(|(inside, _)| inside).sum::<usize>() as f64 / all as f64;
        let explained = counts.iter().filter(|(_, explained)| *explained).count() as u64;
        println!(
            "{count} strokes, scatter {scatter}: coverage {coverage:.3} over {all}, {explained} of {CAMPAIGNS} explained"
        );
        // Intervals of strokes that share a draw of parameters hold or fail together.
        assert!((0.82..=0.97).contains(&coverage), "{count} strokes, scatter {scatter}: coverage {coverage}");
        assert!(explained >= CAMPAIGNS - 1, "{count} strokes, scatter {scatter}: {explained} of {CAMPAIGNS} explained");
    }
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn the_size_of_supposed_scatter_is_near_its_own() {
    let file = testbed();
    let mut noise = Noise(3);
    let data = strokes(file.valve(), 7, 1.0, &mut noise);
    let found = Calibration::of(&Space::tolerated(&file), &data, file.valve(), CalibrateOptions::default());
    assert_eq!(found.scatter.origin, Origin::Supposed);
    assert!(found.repeatability.is_none(), "nothing was repeated");
    assert!(found.reasons[0].contains("repeat one three times"), "{:?}", found.reasons);
    let sizes = found.scatter.sizes();
    let size = |source: Source| sizes[SOURCES.iter().position(|(one, _)| *one == source).expect("is looked for")];
    assert!((0.3e-3..3e-3).contains(&size(Source::CloseDelay)), "{sizes:?}");
    assert!((1e-3..1e-2).contains(&size(Source::Parameter(ParameterId::PreloadCompression))), "{sizes:?}");
    assert!(size(Source::Supply) < 1e-2, "{sizes:?}");
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn missing_physics_is_not_called_scatter() {
    let file = testbed();
    let rubbing = Effect::new(EffectKind::DRY_FRICTION, &[Some(35.0), Some(60.0), None]).expect("a possible effect");
    let parameters = file.valve().parameters().clone();
    let valve = Valve::new(parameters, file.valve().switches(), vec![rubbing], Vec::new()).expect("a possible valve");
    for scatter in [0.0, 1.0] {
        let data = strokes(&valve, 7, scatter, &mut Noise(5));
        let options = CalibrateOptions { hold_out: false, ..CalibrateOptions::default() };
        let found = Calibration::of(&Space::tolerated(&file), &data, file.valve(), options);
        assert_eq!(found.verdict, Verdict::BeyondTolerance, "{:?}", found.reasons);
        assert_eq!(found.scatter.origin, Origin::Unknown, "{:?}", found.scatter.words());
    }
}
