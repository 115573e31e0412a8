//! Any valve within a decade of a real one, with effects of any size: it is followed to its end in finite numbers and within its
//! budget, or refused with a reason.

#[path = "../fuzz/bodies/drawn.rs"]
mod drawn;

use drawn::{Bytes, conditions, run, valve};
use proptest::prelude::*;
use valve_model::cycle::cycles;
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{Outcome, Prepared, Schedule, simulate};

/// The steps that a run may take.
const BUDGET: f64 = 4e6;
/// Runs of more steps are only checked here: each would take seconds.
const FOLLOWED: f64 = 200_000.0;
/// What strokes are timed in.
const SCHEDULE: Schedule = Schedule { close_at_s: 0.0, open_at_s: 4.0, end_s: 8.0 };

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn is_followed_in_finite_numbers_or_refused_with_a_reason(bytes in prop::collection::vec(any::<u8>(), 0..160)) {
        let mut bytes = Bytes::new(&bytes);
        let drawn = match valve(&mut bytes) {
            Ok(drawn) => drawn,
            Err(error) => {
                prop_assert!(error.to_string().contains("expected"), "{error}");
                return Ok(());
            }
        };
        let conditions = conditions(&drawn, &mut bytes);
        let run = run(conditions);
        let prepared = Prepared::new(&drawn, &run, DEFAULT_STEP_S);
        if let Err(error) = prepared.check() {
            // It names what to change.
            prop_assert!(error.to_string().len() > 20, "{error}");
            return Ok(());
        }
        let steps = run.end_s / prepared.step_s();
        prop_assert!(steps <= 1.01 * BUDGET, "{steps} steps of {drawn:?}");
        if steps > FOLLOWED {
            return Ok(());
        }
        let mut told = None;
        simulate(&[prepared], true, |_, nodes, _| {
            let states = [&nodes.position_m, &nodes.velocity_m_per_s, &nodes.chamber_pressure_pa, &nodes.pipe_pressure_pa];
            let finite = states.into_iter().flatten().all(|value| value.is_finite());
            told = Some((finite, nodes.time_s.is_sorted(), nodes.outcome));
        });
        let (finite, rises, outcome) = told.expect("one run");
        prop_assert!(finite && rises && outcome != Outcome::Refused, "{outcome:?} of {drawn:?}");
        let times = cycles(&[(&drawn, conditions)], &SCHEDULE, 1, DEFAULT_STEP_S);
        for times in times.into_iter().flatten() {
            for time_s in [times.close_time_s, times.open_time_s].into_iter().flatten() {
                prop_assert!((0.0..=SCHEDULE.end_s).contains(&time_s), "{time_s} s of {drawn:?}");
            }
        }
    }
}
