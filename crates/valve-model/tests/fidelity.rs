//! What a shorter computation gives up.

mod common;

use common::{at, close_at, effect, open_at, run_of, testbed, valve_of};
use valve_model::{EffectKind, Fidelity, Orientation, Prepared, Trajectory, simulate};

/// The nodes of two strokes of a valve with tiny orifices, which takes some forty seconds for each.
fn slow(effects: &[(EffectKind, &[f64])], fidelity: Fidelity) -> Trajectory {
    let mut parameters = testbed();
    (parameters.solenoid_orifice_area_m2, parameters.port_orifice_area_m2) = (0.01e-6, 0.05e-6);
    parameters.orientation = Orientation::Inverted;
    // Its weight counts.
    parameters.moving_mass_kg = 8.0;
    let valve = valve_of(parameters, effects.iter().map(|(kind, values)| effect(*kind, values)).collect());
    let run = run_of(&valve, vec![close_at(1.0), open_at(100.0)], 250.0);
    let mut nodes = Trajectory::default();
    simulate(&[Prepared::new(&valve, &run, fidelity)], true, |_, found, _| nodes = found.clone());
    nodes
}

#[test]
fn an_inert_piston_takes_longer_steps_and_moves_as_slowly_as_ever() {
    let quick = Fidelity { most_inert_kg: 2000.0, ..Fidelity::with_step(0.02) };
    let sets: [&[(EffectKind, &[f64])]; 2] = [&[], &[(EffectKind::DRY_FRICTION, &[35.0])]];
    for effects in sets {
        let (fine, rough) = (slow(effects, Fidelity::FINE), slow(effects, quick));
        assert!(rough.time_s.len() * 10 < fine.time_s.len(), "{} of {}", rough.time_s.len(), fine.time_s.len());
        let apart = (0..2500).map(|tenth| {
            let time = f64::from(tenth) * 0.1;
            (at(&fine, time)[0] - at(&rough, time)[0]).powi(2)
        });
        let rms_m = (apart.sum::<f64>() / 2500.0).sqrt();
        // A tenth of what a good position sensor resolves.
        assert!(rms_m < 2e-6, "{rms_m}");
        assert!(at(&fine, 80.0)[0] < 1e-4 && at(&fine, 240.0)[0] > 25e-3);
    }
}

#[test]
fn a_step_alone_says_all_and_inertia_is_only_lent_where_it_is_allowed() {
    assert_eq!(Fidelity::from(1e-3), Fidelity::FINE);
    assert_eq!(Fidelity::from(4e-3), Fidelity { roughness: 4.0, step_s: 4e-3, ..Fidelity::FINE });
    let nodes = |fidelity| slow(&[], fidelity).time_s.len();
    assert_eq!(nodes(Fidelity { most_inert_kg: 1e-3, ..Fidelity::with_step(0.02) }), nodes(Fidelity::with_step(0.02)));
}
