"""ProgPy's particle filter and Monte Carlo predictor beside our prognoser, on the same log."""

from __future__ import annotations

import io
import time
import warnings

import numpy as np
import pandas as pd
from progpy.predictors import MonteCarlo
from progpy.state_estimators import ParticleFilter
from progpy.uncertain_data import MultivariateNormalDist

import valve_prognosis as vp
from valve_prognosis.progpy import EVENT, LeakingValve, ValvePredictor, ValvePrognoser

#: Growth with which the log was made, mm2 a cycle.
GROWTH_MM2 = 0.0231
#: Noise of its times, s.
NOISE_S = 0.02
SHOWN = (5, 8, 12, 18, 24)


def main() -> None:
    warnings.simplefilter("ignore")
    np.random.seed(1)
    tables = vp.ValveFile.reference().build_tables(["leaks"])
    model = LeakingValve(tables, measurement_noise=NOISE_S, process_noise={"severity": 0.002, "rate": 0.0005})
    log = pd.read_csv(io.StringIO(vp.leaking_log()))
    true_end = tables.document["faults"][0]["leak_area_at_limit_mm2"] / GROWTH_MM2

    start = MultivariateNormalDist(["severity", "rate"], [0.0, 0.04], [[1e-4, 0.0], [0.0, 4e-4]])
    # Readings have strays, which this filter does not know of: its noise is wider than that of most readings.
    particles = ParticleFilter(model, start, num_particles=500, measurement_noise=dict.fromkeys(model.outputs, 2 * NOISE_S))
    prognoser = ValvePrognoser(model)
    monte_carlo, ours = MonteCarlo(model), ValvePredictor(model)
    seconds = {"progpy": 0.0, "ours": 0.0}
    print(f"true end of life: cycle {true_end:.1f}\ncycle   particle filter + Monte Carlo   prognoser")
    for row in log.to_dict("records"):
        cycle = float(row["cycle"])
        z = {"close_time_s": row["close_time_s"], "open_time_s": row["open_time_s"]}
        begin = time.perf_counter()
        particles.estimate(cycle, {}, model.OutputContainer(z))
        seconds["progpy"] += time.perf_counter() - begin
        begin = time.perf_counter()
        prognoser.estimate(cycle, {}, z)
        seconds["ours"] += time.perf_counter() - begin
        if cycle in SHOWN:
            of_progpy = monte_carlo.predict(particles.x, t0=cycle, dt=0.25, horizon=300, n_samples=100)
            of_ours = ours.predict(prognoser.x, t0=cycle)
            print(f"{cycle:5.0f}   {words(of_progpy.time_of_event):>31}   {words(of_ours.time_of_event)}")
    for name, took in seconds.items():
        print(f"{name}: {1e3 * took / len(log):.2f} ms a row")


def words(ends: object) -> str:
    told = [one for one in ends.key(EVENT) if one is not None]  # type: ignore[attr-defined]
    if not told:
        return "none"
    low, middle, high = np.percentile(np.array(told, dtype=float), [5, 50, 95])
    return f"{middle:.1f} ({low:.1f} to {high:.1f})"


if __name__ == "__main__":
    main()
