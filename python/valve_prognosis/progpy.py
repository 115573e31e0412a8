"""ProgPy's interfaces: a leaking valve as a model, and the prognoser as a state estimator and predictor.

Time is counted in cycles. Whatever of ProgPy takes a model, an estimator or a predictor takes these, so that its filters
and predictors can be run on our model, and our prognoser beside them on the same log.

    model = LeakingValve(tables)
    estimator = ValvePrognoser(model)
    estimator.estimate(cycle, {}, {"close_time_s": 1.31, "open_time_s": 1.87})
    prediction = ValvePredictor(model).predict(estimator.x, t0=cycle)
    prediction.time_of_event.metrics()
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

import numpy as np
from progpy import PrognosticsModel
from progpy.predictors import Predictor
from progpy.predictors.prediction import Prediction, PredictionResults
from progpy.state_estimators import StateEstimator
from progpy.uncertain_data import UncertainData, UnweightedSamples

from valve_prognosis._native import Prognoser, Tables

if TYPE_CHECKING:
    from valve_prognosis._native import Prognosis

__all__ = ["LeakingValve", "ValvePredictor", "ValvePrognoser"]

#: The event of all classes here.
EVENT = "end of life"
#: Rows of a valve that has a name nowhere else.
_VALVE = "valve"


class LeakingValve(PrognosticsModel):  # type: ignore[misc]
    """A valve whose leak grows at a steady pace, its stroke times those of its tables.

    Time is in cycles.

    States: ``severity`` (leak area over that at which life ends) and ``rate`` (severity a cycle).
    Outputs: ``close_time_s`` and ``open_time_s``, s; NaN where the valve does not get there.
    Event: ``end of life``, at severity 1.

    Parameters
    ----------
    tables : Tables
        The valve's tables.
    fault : {"atmosphere", "supply"}
        Where the pipe leaks.
    **parameters
        ProgPy's own, such as ``process_noise`` and ``measurement_noise``, and ``x0``.
    """

    inputs: list[str] = []
    states = ["severity", "rate"]
    outputs = ["close_time_s", "open_time_s"]
    events = [EVENT]
    is_vectorized = True
    default_parameters: dict[str, Any] = {"x0": {"severity": 0.0, "rate": 0.02}, "process_noise": 0.0}

    def __init__(self, tables: Tables, fault: str = "atmosphere", **parameters: Any) -> None:
        faults = {one["fault"]: one for one in tables.document["faults"]}
        if fault not in ("atmosphere", "supply") or fault not in faults:
            raise ValueError(f'fault: found {fault!r}, expected "atmosphere" or "supply"')
        limit_m2 = 1e-6 * faults[fault]["leak_area_at_limit_mm2"]
        super().__init__(tables=tables, fault=fault, limit_m2=limit_m2, **parameters)

    def initialize(self, u: Any = None, z: Any = None) -> Any:
        return self.StateContainer(self.parameters["x0"])

    def next_state(self, x: Any, u: Any, dt: float) -> Any:
        return self.StateContainer({"severity": x["severity"] + x["rate"] * dt, "rate": x["rate"]})

    def output(self, x: Any) -> Any:
        severity = np.asarray(x["severity"], dtype=float)
        area_m2 = np.maximum(np.atleast_1d(severity), 0.0) * self.parameters["limit_m2"]
        times = self.parameters["tables"].stroke_times(self.parameters["fault"], area_m2)
        close, opening = (one.reshape(severity.shape) if severity.shape else one[0] for one in times)
        return self.OutputContainer({"close_time_s": close, "open_time_s": opening})

    def event_state(self, x: Any) -> dict[str, Any]:
        return {EVENT: 1.0 - np.asarray(x["severity"])}

    def threshold_met(self, x: Any) -> dict[str, Any]:
        return {EVENT: np.asarray(x["severity"]) >= 1.0}


class ValvePrognoser(StateEstimator):  # type: ignore[misc]
    """The prognoser where ProgPy has a state estimator.

    `estimate` takes the number of the cycle for the time, and the stroke times for the outputs: NaN or None were not
    measured, infinity did not arrive. `x` has samples of severity and rate whose straight continuation ends where the
    prognoser's remaining life does: at its 5, 50 and 95 % quantiles, and between and beyond them as a normal distribution
    with two halves. With it any of ProgPy's predictors predicts as the prognoser does. `prognosis` has all that the
    prognoser says, also of faults that the model does not have.

    Parameters
    ----------
    model : LeakingValve
        The model; its tables are what the prognoser reads.
    x0 : optional
        Taken for the sake of ProgPy's interface; the prognoser has priors of its own.
    samples : int
        Number of samples of `x`.
    **settings
        Those of `Prognoser`.
    """

    def __init__(self, model: LeakingValve, x0: Any = None, *, samples: int = 99, **settings: Any) -> None:
        super().__init__(model, model.parameters["x0"] if x0 is None else x0)
        if samples < 1:
            raise ValueError(f"samples: found {samples}, expected at least 1")
        self._prognoser = Prognoser(model.parameters["tables"], threads=1, **settings)
        self._places = [NormalDist().inv_cdf((one + 0.5) / samples) for one in range(samples)]
        self.prognosis: Prognosis | None = None

    def estimate(self, t: float, u: Any, z: Mapping[str, float | None], **_: Any) -> None:
        if float(t) != int(t) or t < 0:
            raise ValueError(f"t: found {t}, expected the number of a cycle")
        times = {name: z[name] for name in ("close_time_s", "open_time_s")}
        self.prognosis = self._prognoser.push({"valve": _VALVE, "cycle": int(t), **times})
        self.t = float(t)

    @property
    def x(self) -> UncertainData:
        one = self.prognosis
        low, middle, high = (None, None, None) if one is None else (one["rul_p05"], one["rul_p50"], one["rul_p95"])
        severity = 0.0 if one is None or one["severity"] is None else one["severity"]
        if low is None or middle is None or high is None:
            # Nothing that grows is known.
            pairs = [(severity, 0.0)] * len(self._places)
        else:
            at_95 = NormalDist().inv_cdf(0.95)
            widths = ((middle - low) / at_95, (high - middle) / at_95)
            lives = (max(middle + place * widths[place > 0], 0.0) for place in self._places)
            pairs = [(1.0, 0.0) if life == 0 or severity >= 1 else (severity, (1 - severity) / life) for life in lives]
        samples = [{"severity": severity, "rate": rate} for severity, rate in pairs]
        return UnweightedSamples(samples, _type=self.model.StateContainer)


class ValvePredictor(Predictor):  # type: ignore[misc]
    """Where a straight continuation of each sample's growth ends, without simulating the cycles between.

    Takes the state of any estimator of a `LeakingValve`. Samples that do not grow have no time of the event (None).
    """

    def predict(
        self, state: UncertainData, future_loading_eqn: Callable[..., Any] | None = None, **options: Any
    ) -> PredictionResults:
        t0 = float(options.get("t0", 0.0))
        horizon = float(options.get("horizon", float("inf")))
        samples = state if isinstance(state, UnweightedSamples) else state.sample(int(options.get("n_samples", 100)))

        def end(one: Mapping[str, float]) -> float | None:
            left = max(1.0 - float(one["severity"]), 0.0)
            if left == 0.0:
                return t0
            life = left / float(one["rate"]) if one["rate"] > 0 else float("inf")
            return t0 + life if life <= horizon and life < float("inf") else None

        ends = UnweightedSamples([{EVENT: end(one)} for one in samples])
        outputs = UnweightedSamples([self.model.output(self.model.StateContainer(dict(one))) for one in samples])
        left = UnweightedSamples([self.model.event_state(one) for one in samples])
        nothing = UnweightedSamples([self.model.InputContainer({}) for _ in samples])
        at_once = (Prediction([t0], [data]) for data in (nothing, samples, outputs, left))
        return PredictionResults([t0], *at_once, ends)
