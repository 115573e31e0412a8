"""Logs of many valves, each with a leak that grows at its own pace, as large as wanted."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.csv

import valve_prognosis as vp

if TYPE_CHECKING:
    from pyspark.sql import SparkSession

ROOT = Path(__file__).resolve().parents[2]
#: Noise of a time, s.
NOISE_S = 0.02
#: Clock ticks in a second, in which the operating system counts.
TICKS = os.sysconf("SC_CLK_TCK")
#: How often the seconds of processes are looked up: what one uses after the last look before its end is missed.
LOOK_S = 0.25
#: Share of rows in which a time was not measured.
MISSING = 0.01


def names(valves: int) -> list[str]:
    return [f"V-{index:06}" for index in range(valves)]


def log(tables: vp.Tables, valves: int, cycles: int, seed: int = 1) -> pa.Table:
    """A log of ``valves * cycles`` rows, cycle by cycle; ``line`` numbers them.

    A leak to the atmosphere grows from none at a pace of its own, up to 60 % of the limit after the last cycle. Closing
    and opening times have noise, and some are missing.
    """
    random = np.random.default_rng(seed)
    limit_m2 = 1e-6 * tables.document["faults"][0]["leak_area_at_limit_mm2"]
    pace_m2 = random.uniform(0.0, 0.6, valves) * limit_m2 / cycles
    cycle = np.repeat(np.arange(cycles), valves)
    valve = np.tile(np.arange(valves), cycles)
    times = []
    for time_s in tables.stroke_times("atmosphere", cycle * pace_m2[valve]):
        noisy = np.round(time_s + random.normal(0.0, NOISE_S, len(cycle)), 4)
        times.append(pa.array(noisy, mask=random.random(len(cycle)) < MISSING))
    return pa.table(
        {
            "line": pa.array(np.arange(len(cycle))),
            "valve": pa.array(names(valves)).take(pa.array(valve)),
            "cycle": pa.array(cycle),
            "close_time_s": times[0],
            "open_time_s": times[1],
        }
    )


def program() -> str:
    """The program of this checkout, built."""
    subprocess.run(["cargo", "build", "--release", "--quiet", "--locked", "--bin", "valve"], cwd=ROOT, check=True)
    metadata = ["cargo", "metadata", "--format-version", "1", "--no-deps"]
    told = subprocess.run(metadata, cwd=ROOT, check=True, capture_output=True).stdout
    return f"{json.loads(told)['target_directory']}/release/valve"


def lines_of_program(rows: pa.Table, folder: Path) -> list[dict[str, Any]]:
    """What one process of the program says of a log, row by row."""
    pyarrow.csv.write_csv(rows.drop_columns(["line"]), folder / "log.csv")
    call = [program(), "prognose", str(folder / "log.csv"), "--tables", str(ROOT / "tables"), "--format", "jsonl", "-q"]
    done = subprocess.run(call, check=True, capture_output=True, text=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def assert_same(told: list[dict[str, Any]], lines: list[dict[str, Any]]) -> None:
    """Every number of every row, to the bit."""
    assert len(told) == len(lines)
    for row, line in zip(told, lines, strict=True):
        for name, share in (line["fault_probability"] or {}).items():
            assert row[f"p_{name.replace('-', '_')}"] == share, (name, row, line)
        for name, value in line.items():
            if name not in {"schema", "fault_probability", "notices", "fault_group"}:
                assert row[name] == value, (name, row, line)
        assert json.loads(row["notices"] or "[]") == line["notices"]
        assert row["error"] is None


def processes() -> dict[int, float]:
    """Of this process and all that it started that still run: their own seconds of cores."""
    seconds, parents = {}, {}
    for process in Path("/proc").iterdir():
        if process.name.isdigit():
            try:
                words = (process / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue  # It has ended.
            parents[int(process.name)] = int(words[1])
            seconds[int(process.name)] = (int(words[11]) + int(words[12])) / TICKS
    own = {os.getpid()}
    while found := {one for one, parent in parents.items() if parent in own} - own:
        own |= found
    return {one: seconds[one] for one in own if one in seconds}


@contextmanager
def measured(what: str, rows: int) -> Iterator[None]:
    """Prints seconds of cores, of this process and all that it started, and of the wall.

    They are looked up again and again, since the time of a process that ends is not always handed to its parent.
    """
    before, wall = processes(), time.perf_counter()
    last = dict(before)
    ended = threading.Event()

    def look() -> None:
        while not ended.wait(LOOK_S):
            last.update(processes())

    thread = threading.Thread(target=look, daemon=True)
    thread.start()
    yield
    ended.set()
    thread.join()
    last.update(processes())
    cores, wall = sum(last.values()) - sum(before.values()), time.perf_counter() - wall
    print(f"{what}: {rows / cores:.0f} rows a core second ({cores:.1f} core s, {wall:.1f} s)", flush=True)


def spark(executors: int, memory: str = "1g") -> SparkSession:
    """A local cluster of executors of one core, each a process of its own."""
    from pyspark.sql import SparkSession

    os.environ["PYSPARK_PYTHON"] = os.environ["PYSPARK_DRIVER_PYTHON"] = sys.executable
    builder = SparkSession.builder.master(f"local-cluster[{executors},1,1024]").appName("fleet")
    settings = {
        "spark.ui.enabled": "false",
        "spark.driver.host": "localhost",
        "spark.sql.shuffle.partitions": "4",
        "spark.executor.memory": memory,
        "spark.task.maxFailures": "8",
    }
    for name, value in settings.items():
        builder = builder.config(name, value)
    session = builder.getOrCreate()
    session.sparkContext.setLogLevel("ERROR")
    return session


def executors(application: str) -> list[int]:
    """The processes of the executors of a Spark application, which their command lines name."""
    found = []
    for one in processes():
        try:
            words = Path(f"/proc/{one}/cmdline").read_bytes().decode(errors="replace").split("\0")
        except OSError:
            continue  # It has ended.
        if application in words and any(word.endswith("ExecutorBackend") for word in words):
            found.append(one)
    return sorted(found)


def ray_workers() -> list[int]:
    """The processes of Ray's workers that run a task of a shuffle's second half just now, which their titles name."""
    found = []
    for one in processes():
        try:
            title = Path(f"/proc/{one}/cmdline").read_bytes().decode(errors="replace")
        except OSError:
            continue  # It has ended.
        if title.startswith("ray::") and "reduce" in title.lower():
            found.append(one)
    return sorted(found)
