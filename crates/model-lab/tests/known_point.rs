//! A search of all runs may begin where that of some of them ended.

mod recorded;

use identify::Stop;
use identify::select::{Family, Level};
use model_lab::identification::{Catalogue, Known, NuisanceSizes, Subject};
use recorded::{Noise, Off, campaign, stroke};
use valve_file::ValveFile;
use valve_model::EffectKind;

#[test]
fn a_set_with_the_known_effects_begins_at_the_known_point() {
    let file = ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve");
    let mut noise = Noise(3);
    let runs = [4.8e5, 5.6e5, 6.4e5].map(|supply_pa| stroke(file.valve(), supply_pa, &Off::default(), &mut noise));
    let of =
        |count: usize| Subject::new(&file, &campaign(runs[..count].to_vec()), &NuisanceSizes::default(), Stop::never());
    let (some, all) = (of(2), of(3));
    let quiet = |_: identify::select::News<'_>| ();
    let kinds = [EffectKind::DRY_FRICTION, EffectKind::GAS_HEATING];
    let catalogue = Catalogue::new(&some, &kinds, &quiet, Stop::never());
    let ended = catalogue.member(&[0], Level::High).expect("possible");
    let mut u = ended.start();
    for (place, value) in u.iter_mut().enumerate() {
        *value += 0.01 * (place + 1) as f64;
    }
    let known = Known::new(&ended, &u);
    let mut catalogue = Catalogue::new(&all, &kinds, &quiet, Stop::never());
    catalogue.known = Some(&known);
    let [with, without] = [&[0, 1][..], &[1]].map(|set| catalogue.member(set, Level::High).expect("possible"));
    assert!(known.start(&without).is_none(), "friction is missing");
    let start = catalogue.cold(&with).pop().expect("starts");
    let own = ended.space.coordinates.len();
    let valve = |member: &model_lab::identification::ValveProblem<'_>, u: &[f64]| {
        (member.space.base_at(u), member.space.effect_values(EffectKind::DRY_FRICTION, u).expect("has it"))
    };
    assert_eq!(valve(&with, &start), valve(&ended, &u));
    let shared = ended.nuisances.iter().zip(&u[own..]).filter(|(entry, _)| known.shared(entry.nuisance).is_some());
    let mut count = 0;
    for (entry, value) in shared {
        let place = with.place_of(entry.nuisance).expect("is shared by all records");
        assert!((start[place] - value).abs() < f64::EPSILON, "{:?}", entry.nuisance);
        count += 1;
    }
    assert!(count > 1, "{count}");
    // What belongs to single records is not known of others.
    assert!(start[with.space.coordinates.len()..].iter().any(|value| value.abs() < f64::EPSILON));
}
