"""The program, to compare with, and what comes along."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import valve_prognosis as vp

ROOT = Path(__file__).resolve().parents[2]

Program = Callable[..., str]


def build() -> str:
    """Builds the program and says where it is."""
    subprocess.run(["cargo", "build", "--release", "--quiet", "--locked", "--bin", "valve"], cwd=ROOT, check=True)
    metadata = ["cargo", "metadata", "--format-version", "1", "--no-deps"]
    told = subprocess.run(metadata, cwd=ROOT, check=True, capture_output=True).stdout
    return f"{json.loads(told)['target_directory']}/release/valve"


@pytest.fixture(scope="session")
def program() -> Program:
    """The ``valve`` program of this checkout: arguments in, stdout out. ``VALVE_PROGRAM`` names one that is built."""
    built = os.environ.get("VALVE_PROGRAM") or build()

    def run(*arguments: object) -> str:
        words = [str(argument) for argument in arguments]
        done = subprocess.run([built, *words], cwd=ROOT, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="session")
def json_of(program: Program) -> Callable[..., Any]:
    """As ``program``, its JSON read."""
    return lambda *arguments: json.loads(program(*arguments, "--format", "json"))


@pytest.fixture(scope="session")
def reference() -> vp.ValveFile:
    return vp.ValveFile.read(ROOT / "models" / "testbed.toml")


@pytest.fixture(scope="session")
def tables() -> vp.Tables:
    return vp.Tables.read(ROOT / "tables")


@pytest.fixture(scope="session")
def log() -> Path:
    return ROOT / "data" / "leaking-valve.csv"


@pytest.fixture(scope="session")
def sticking() -> Path:
    return ROOT / "data" / "sticking-valve"
