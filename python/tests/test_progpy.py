"""ProgPy's interfaces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import valve_prognosis as vp

pytest.importorskip("progpy")

from progpy.predictors import MonteCarlo  # noqa: E402

from valve_prognosis.progpy import EVENT, LeakingValve, ValvePredictor, ValvePrognoser  # noqa: E402


@pytest.fixture(scope="module")
def model(tables: vp.Tables) -> LeakingValve:
    return LeakingValve(tables)


def test_the_model_grows_to_its_end_with_the_tables_times(model: LeakingValve, tables: vp.Tables) -> None:
    model.parameters["x0"] = {"severity": 0.2, "rate": 0.04}
    run = model.simulate_to_threshold(dt=1, save_freq=1)
    assert run.times[-1] == pytest.approx(20, abs=1)
    limit_m2 = 1e-6 * tables.document["faults"][0]["leak_area_at_limit_mm2"]
    close, opening = tables.stroke_times("atmosphere", [0.2 * limit_m2])
    assert run.outputs[0]["close_time_s"] == close[0]
    assert run.outputs[0]["open_time_s"] == opening[0]
    with pytest.raises(ValueError, match="found 'rust'"):
        LeakingValve(tables, "rust")


def test_prediction_has_the_prognosers_quantiles_whoever_predicts(model: LeakingValve, log: Path) -> None:
    estimator = ValvePrognoser(model, samples=1001)
    assert all(one["rate"] == 0 for one in estimator.x), "nothing is known before the first row"
    assert ValvePredictor(model).predict(estimator.x).time_of_event.key(EVENT)[0] is None
    for row in pd.read_csv(log).to_dict("records"):
        estimator.estimate(row["cycle"], {}, {name: row[name] for name in model.outputs})
    told = estimator.prognosis
    assert told is not None
    ends = np.array(ValvePredictor(model).predict(estimator.x, t0=estimator.t).time_of_event.key(EVENT))
    for share, name in [(0.05, "rul_p05"), (0.5, "rul_p50"), (0.95, "rul_p95")]:
        assert np.quantile(ends, share) - estimator.t == pytest.approx(told[name], abs=2e-3), name  # type: ignore[literal-required]
    few = ValvePrognoser(model, samples=9)
    for row in pd.read_csv(log)[:13].to_dict("records"):
        few.estimate(row["cycle"], {}, {name: row[name] for name in model.outputs})
    own = ValvePredictor(model).predict(few.x, t0=few.t).time_of_event.key(EVENT)
    theirs = MonteCarlo(model).predict(few.x, t0=few.t, dt=0.05, horizon=100).time_of_event.key(EVENT)
    assert np.allclose(np.array(theirs, dtype=float), own, atol=0.06)
    with pytest.raises(ValueError, match="expected the number of a cycle"):
        few.estimate(0.5, {}, {"close_time_s": 1.0, "open_time_s": 2.0})
