"""Tables against the program's."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import valve_prognosis as vp


def test_built_tables_are_the_programs_byte_for_byte(
    json_of: Callable[..., Any], reference: vp.ValveFile, tmp_path: Path
) -> None:
    told = json_of("build-tables", "models/testbed.toml", "--out", tmp_path / "program")
    built = reference.build_tables()
    assert built.document == told
    built.write(tmp_path / "python")
    names = sorted(path.name for path in (tmp_path / "program").iterdir())
    assert names == sorted(path.name for path in (tmp_path / "python").iterdir())
    for name in names:
        assert (tmp_path / "python" / name).read_bytes() == (tmp_path / "program" / name).read_bytes(), name
    with pytest.raises(vp.ValveError, match="has tables already"):
        built.write(tmp_path / "python")
    built.write(tmp_path / "python", force=True)


def test_tables_are_read_shipped_and_looked_up(reference: vp.ValveFile, tables: vp.Tables) -> None:
    assert tables.model_hash == reference.model_hash
    assert tables.faults[:2] == ["atmosphere", "supply"]
    shipped = pickle.loads(pickle.dumps(tables))
    assert shipped.document == tables.document
    leak = np.array([0.0, 1e-7, 1.0])
    close, opening = tables.stroke_times("atmosphere", leak)
    simulated = reference.simulate_many(leak_to_atmosphere_m2=leak[:2], cycles=40)
    assert np.allclose(close[:2], simulated.close_time_s[:, -1], atol=1e-3)
    assert np.allclose(opening[:2], simulated.open_time_s[:, -1], atol=1e-3)
    assert np.isnan(close[2])
    assert tables.figure().svg.startswith("<svg")


def test_refusals_say_what_was_found(reference: vp.ValveFile, tables: vp.Tables, tmp_path: Path) -> None:
    with pytest.raises(vp.ValveError, match="expected one of atmosphere, supply"):
        tables.stroke_times("atmospher", [0.0])
    with pytest.raises(vp.ValveError, match='found "rust", expected all, leaks'):
        reference.build_tables(["rust"])
    with pytest.raises(vp.ValveError, match="no tables"):
        vp.Tables.from_bytes(b"\x01\x02")
    other = reference.with_parameters({"spring.stiffness": 15000.0})
    with pytest.raises(vp.ValveError, match="model"):
        vp.Tables.read(Path(__file__).parents[2] / "tables", valve=other)
    with pytest.raises(vp.ValveError, match="manifest.json"):
        vp.Tables.read(tmp_path)
