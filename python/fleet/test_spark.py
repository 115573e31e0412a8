"""A fleet on Spark in local-cluster mode: several executors, each a process of its own, one of them killed."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet
import pytest
from pyspark.sql import SparkSession

import fleet
import valve_prognosis as vp
from valve_prognosis.spark import prognose, prognose_stream

VALVES = int(os.environ.get("FLEET_VALVES", "500"))
CYCLES = int(os.environ.get("FLEET_CYCLES", "30"))


@pytest.fixture(scope="module")
def spark() -> Iterator[SparkSession]:
    session = fleet.spark(executors=2)
    yield session
    session.stop()


@pytest.fixture(scope="module")
def tables() -> vp.Tables:
    return vp.Tables.read(fleet.ROOT / "tables")


@pytest.fixture(scope="module")
def rows(tables: vp.Tables) -> pa.Table:
    return fleet.log(tables, VALVES, CYCLES)


@pytest.fixture(scope="module")
def lines(rows: pa.Table, tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    return fleet.lines_of_program(rows, tmp_path_factory.mktemp("program"))


@pytest.fixture(scope="module")
def parquet(rows: pa.Table, tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("rows")
    # In several files, so that the rows of a valve come from several tasks.
    for part, start in enumerate(range(0, len(rows), len(rows) // 5 + 1)):
        pyarrow.parquet.write_table(rows.slice(start, len(rows) // 5 + 1), folder / f"{part}.parquet")
    return str(folder)


def in_order(frame: Any) -> list[dict[str, Any]]:
    told: list[dict[str, Any]] = pa.Table.from_batches(frame.toArrow().to_batches()).sort_by("line").to_pylist()
    return told


@pytest.mark.parametrize("partitions", [1, 7])
def test_any_partitioning_gives_the_programs_rows(
    spark: SparkSession, tables: vp.Tables, parquet: str, lines: list[dict[str, Any]], partitions: int
) -> None:
    read = spark.read.parquet(parquet).repartition(3)
    told = prognose(read, tables, order_by=["line"], keep=["line"], partitions=partitions)
    fleet.assert_same(in_order(told), lines)


def test_an_executor_that_is_killed_changes_nothing(
    spark: SparkSession, tables: vp.Tables, parquet: str, lines: list[dict[str, Any]]
) -> None:
    application = spark.sparkContext.applicationId
    before = fleet.executors(application)
    assert len(before) == 2, before
    killed = []

    def kill() -> None:
        # As soon as tasks of the second stage run.
        tracker = spark.sparkContext.statusTracker()
        while True:
            stages = [tracker.getStageInfo(stage) for stage in tracker.getActiveStageIds()]
            if any(stage is not None and stage.numTasks == 16 and stage.numCompletedTasks >= 2 for stage in stages):
                break
            time.sleep(0.02)
        killed.append(before[0])
        os.kill(before[0], signal.SIGKILL)

    thread = threading.Thread(target=kill, daemon=True)
    thread.start()
    told = prognose(spark.read.parquet(parquet), tables, order_by=["line"], keep=["line"], partitions=16)
    fleet.assert_same(in_order(told), lines)
    thread.join(timeout=1)
    assert killed == before[:1], "no executor was killed while tasks ran"
    assert before[0] not in fleet.executors(application)


@pytest.mark.parametrize("groups", [None, 5])
def test_a_stream_that_is_stopped_and_started_again_gives_each_row_once(
    spark: SparkSession,
    tables: vp.Tables,
    rows: pa.Table,
    lines: list[dict[str, Any]],
    tmp_path: Path,
    groups: int | None,
) -> None:
    source, out, checkpoint = tmp_path / "rows", tmp_path / "out", tmp_path / "checkpoint"
    source.mkdir()
    days = 3
    size = len(rows) // days + 1

    def day(number: int) -> None:
        """The files of a day are read by a run of the stream, which then ends."""
        pyarrow.parquet.write_table(rows.slice(number * size, size), source / f"{number}.parquet")
        stream = spark.readStream.schema(spark.read.parquet(str(source)).schema).parquet(str(source))
        written = (
            prognose_stream(stream, tables, order_by=["line"], groups=groups)
            .writeStream.outputMode("append")
            .option("checkpointLocation", str(checkpoint))
            .trigger(availableNow=True)
            .start(path=str(out), format="parquet")
        )
        assert written.awaitTermination(600)

    for number in range(days):
        day(number)
    told = spark.read.parquet(str(out)).toArrow().sort_by([("cycle", "ascending"), ("valve", "ascending")])
    fleet.assert_same(told.to_pylist(), lines)
