"""The examples run as they stand."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT

EXAMPLES = ROOT / "python" / "examples"


@pytest.mark.parametrize(
    ("name", "words", "said", "written"),
    [
        ("first_steps", [], "atmosphere", "life.svg"),
        ("parameter_study", [], "correlation with the supply pressure: -0.9", None),
        ("beside_progpy", [], "true end of life: cycle 25.3", None),
        ("missing_effect", [ROOT / "data" / "sticking-valve"], "added dry-friction", "better.toml"),
    ],
)
def test_an_example_says_what_it_promises(
    tmp_path: Path, name: str, words: list[object], said: str, written: str | None
) -> None:
    if name == "beside_progpy":
        pytest.importorskip("progpy")
    call = [sys.executable, str(EXAMPLES / f"{name}.py"), *map(str, words)]
    done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert said in done.stdout
    assert written is None or (tmp_path / written).stat().st_size > 1000
