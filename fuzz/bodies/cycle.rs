//! Any valve, drawn from bytes, and one cycle of it.

use super::drawn::{Bytes, conditions, run, valve};
use valve_model::{Outcome, Prepared, simulate};

/// Steps that one input may cost here; the program affords many more.
const MOST_STEPS: f64 = 40_000.0;

/// Looks at an input.
pub fn look(bytes: &[u8]) {
    let mut bytes = Bytes::new(bytes);
    let drawn = match valve(&mut bytes) {
        Ok(drawn) => drawn,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return;
        }
    };
    let run = run(conditions(&drawn, &mut bytes));
    let prepared = Prepared::new(&drawn, &run, valve_model::simulate::DEFAULT_STEP_S);
    if let Err(error) = prepared.check() {
        assert!(!error.to_string().is_empty());
        return;
    }
    if run.end_s / prepared.step_s() > MOST_STEPS {
        return;
    }
    simulate(&[prepared], true, |_, nodes, _| {
        assert!(nodes.outcome != Outcome::Refused, "it was checked");
        assert!(nodes.time_s.is_sorted());
        // The last node lies at the end but for rounding.
        let last = nodes.time_s.last().copied().unwrap_or_default();
        assert!(last <= run.end_s + 1e-9, "{last} s of {} s", run.end_s);
        let states = [&nodes.position_m, &nodes.velocity_m_per_s, &nodes.chamber_pressure_pa, &nodes.pipe_pressure_pa];
        assert!(states.into_iter().flatten().all(|value| value.is_finite()), "{:?} of {drawn:?}", nodes.outcome);
    });
}
