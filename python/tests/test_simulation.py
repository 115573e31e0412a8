"""Simulated strokes against the program's."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import valve_prognosis as vp


@pytest.mark.parametrize(
    ("words", "conditions"),
    [
        ([], {}),
        (["--cycles", 3, "--leak-to-atmosphere", "0.3 mm2"], {"cycles": 3, "leak_to_atmosphere_m2": 3e-7}),
        (["--supply-pressure", "600 kPa", "--temperature", "300 K"], {"supply_pressure_pa": 6e5, "temperature_k": 300.0}),
        (["--leak-to-atmosphere", "5 mm2", "--cycles", 2], {"leak_to_atmosphere_m2": 5e-6, "cycles": 2}),
    ],
)
def test_a_simulation_is_the_programs(
    json_of: Callable[..., Any], reference: vp.ValveFile, words: list[object], conditions: dict[str, Any]
) -> None:
    told = json_of("simulate", "models/testbed.toml", *words)
    simulation = reference.simulate(**conditions)
    assert simulation.document == told
    close = [np.nan if one["close_time_s"] is None else one["close_time_s"] for one in told["cycles"]]
    assert np.array_equal(simulation.close_time_s, close, equal_nan=True)


def test_a_trace_is_the_programs(program: Callable[..., str], reference: vp.ValveFile, tmp_path: Path) -> None:
    program("simulate", "models/testbed.toml", "--trace", tmp_path / "trace.csv", "--plot", tmp_path / "trace.svg")
    trace = reference.simulate().trace()
    rows = zip(
        trace["time_s"],
        trace["command"],
        trace["position_m"] * 1e3,
        trace["chamber_pressure_pa"] / 1e3,
        trace["pipe_pressure_pa"] / 1e3,
        strict=True,
    )
    lines = [f"{t:.3f},{c},{x:.6f},{p:.5f},{q:.5f}" for t, c, x, p, q in rows]
    assert (tmp_path / "trace.csv").read_text().splitlines()[1:] == lines
    assert reference.simulate().figure().svg == (tmp_path / "trace.svg").read_text()


def test_many_variants_are_as_each_alone(reference: vp.ValveFile) -> None:
    random = np.random.default_rng(7)
    # Values that a valve file writes without rounding.
    stiffness = np.round(reference.parameters["spring.stiffness"] * random.uniform(0.9, 1.1, 77), -1)
    leak = random.uniform(0.0, 3e-6, 77)
    many = reference.simulate_many({"spring.stiffness": stiffness}, leak_to_atmosphere_m2=leak, cycles=3)
    assert many.close_time_s.shape == many.open_time_s.shape == (77, 3)
    assert np.isnan(many.close_time_s).any(), "some of these leaks are too large to close"
    assert not np.isnan(many.close_time_s).all()
    for index in range(0, 77, 11):
        one = reference.with_parameters({"spring.stiffness": stiffness[index]})
        alone = one.simulate(leak_to_atmosphere_m2=leak[index], cycles=3)
        assert np.array_equal(many.close_time_s[index], alone.close_time_s, equal_nan=True)
        assert np.array_equal(many.open_time_s[index], alone.open_time_s, equal_nan=True)


def test_a_number_stands_for_all_variants(reference: vp.ValveFile) -> None:
    key = "pneumatics.temperature"
    alike = reference.simulate_many({key: 300.0}, leak_to_atmosphere_m2=[0.0, 1e-7])
    each = reference.simulate_many({key: [300, 300]}, leak_to_atmosphere_m2=np.array([0.0, 0.0], dtype=np.float32))
    assert alike.close_time_s[0] == each.close_time_s[0]
    assert alike.close_time_s.shape == (2, 1)
    assert reference.simulate_many().close_time_s.shape == (1, 1)
    assert reference.simulate_many({key: []}).close_time_s.shape == (0, 1)


def test_refusals_say_what_was_found(reference: vp.ValveFile) -> None:
    with pytest.raises(vp.ValveError, match="spring.stiffness"):
        reference.simulate_many({"spring.stifness": 1.0})
    with pytest.raises(vp.ValveError, match="found 3 values, expected 2"):
        reference.simulate_many({"spring.stiffness": [15e3, 16e3]}, temperature_k=[290.0, 291.0, 292.0])
    with pytest.raises(vp.ValveError, match="variant 1: .*-1"):
        reference.simulate_many({"spring.stiffness": [15e3, -1.0]})
    for wrong in [{"cycles": 0}, {"step_s": -1.0}, {"step_s": float("nan")}]:
        with pytest.raises(vp.ValveError, match="expected both above 0"):
            reference.simulate(**wrong)  # type: ignore[arg-type]
        with pytest.raises(vp.ValveError, match="expected both above 0"):
            reference.simulate_many(**wrong)  # type: ignore[arg-type]
    with pytest.raises(vp.ValveError, match="valve.toml:1"):
        vp.ValveFile.parse("name = 3")


def test_a_valve_file_is_edited_and_shipped(reference: vp.ValveFile) -> None:
    softer = reference.with_parameters({"spring.stiffness": 15000.0})
    assert softer.parameters["spring.stiffness"] == 15000.0
    assert softer.model_hash != reference.model_hash
    sticky = reference.with_effect("dry-friction", coulomb_force=20.0)
    assert sticky.effects == ["dry-friction"]
    with pytest.raises(vp.ValveError, match="dry-friction"):
        reference.with_effect("dry-frction")
    again = pickle.loads(pickle.dumps(softer))
    assert str(again) == str(softer)
    assert again.model_hash == softer.model_hash
