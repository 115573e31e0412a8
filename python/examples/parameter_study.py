"""How the closing time depends on spring and supply: ten thousand variants at once."""

from __future__ import annotations

import time

import numpy as np

import valve_prognosis as vp

VARIANTS = 10_000


def main() -> None:
    valve = vp.ValveFile.reference()
    random = np.random.default_rng(1)
    stiffness = valve.parameters["spring.stiffness"] * random.normal(1.0, 0.02, VARIANTS)
    supply_pa = random.uniform(5.5e5, 6.9e5, VARIANTS)
    start = time.perf_counter()
    strokes = valve.simulate_many({"spring.stiffness": stiffness}, supply_pressure_pa=supply_pa)
    took = time.perf_counter() - start
    close_s = strokes.close_time_s[:, 0]
    print(f"{VARIANTS} cycles in {took:.2f} s: {VARIANTS / took:.0f} a second")
    print(f"closing time: {np.nanmean(close_s):.3f} s, standard deviation {np.nanstd(close_s):.3f} s")
    for name, values in {"stiffness": stiffness, "supply pressure": supply_pa}.items():
        print(f"correlation with the {name}: {np.corrcoef(values, close_s)[0, 1]:+.3f}")


if __name__ == "__main__":
    main()
