"""A fleet on Ray Data: whatever the blocks, and with a worker killed."""

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

import fleet
import valve_prognosis as vp

os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
ray = pytest.importorskip("ray", reason="Ray is not installed")
from valve_prognosis.ray import prognose, schema  # noqa: E402 # after what it needs

VALVES = int(os.environ.get("FLEET_VALVES", "500"))
CYCLES = int(os.environ.get("FLEET_CYCLES", "30"))


@pytest.fixture(scope="module", autouse=True)
def cluster() -> Iterator[None]:
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level="ERROR")
    ray.data.DataContext.get_current().enable_progress_bars = False
    yield
    ray.shutdown()


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
    # In several files, so that the rows of a valve come from several blocks.
    for part, start in enumerate(range(0, len(rows), len(rows) // 5 + 1)):
        pyarrow.parquet.write_table(rows.slice(start, len(rows) // 5 + 1), folder / f"{part}.parquet")
    return str(folder)


def in_order(told: Any) -> pa.Table:
    return pa.concat_tables(ray.get(told.to_arrow_refs())).sort_by("line")


# As many blocks as valves and more leave some of them empty.
@pytest.mark.parametrize("partitions", [1, 7, VALVES + 100])
def test_any_blocks_give_the_programs_rows(
    tables: vp.Tables, parquet: str, lines: list[dict[str, Any]], partitions: int
) -> None:
    # Blocks in an order that is not the rows'.
    read = ray.data.read_parquet(parquet).randomize_block_order(seed=1)
    told = in_order(prognose(read, tables, order_by=["line"], keep=["line"], partitions=partitions))
    assert told.schema.names == [*schema().names, "line"]
    fleet.assert_same(told.to_pylist(), lines)


def test_a_worker_that_is_killed_changes_nothing(
    tables: vp.Tables, parquet: str, lines: list[dict[str, Any]]
) -> None:
    killed = []
    ended = threading.Event()

    def kill() -> None:
        # As soon as a task runs that makes prognoses.
        while not (found := fleet.ray_workers()):
            if ended.wait(0.005):
                return
        killed.append(found[0])
        os.kill(found[0], signal.SIGKILL)

    thread = threading.Thread(target=kill, daemon=True)
    thread.start()
    told = in_order(prognose(ray.data.read_parquet(parquet), tables, order_by=["line"], keep=["line"], partitions=4))
    ended.set()
    thread.join(timeout=10)
    fleet.assert_same(told.to_pylist(), lines)
    assert killed, "no worker was killed while tasks ran"
    assert not Path(f"/proc/{killed[0]}").exists()


def test_what_is_no_row_comes_out_with_the_reason(tables: vp.Tables) -> None:
    log = pa.table({"valve": ["A", "A"], "cycle": [1, -1], "close_time_s": [1.0, 1.0], "open_time_s": [2.0, 2.0]})
    told = prognose(ray.data.from_arrow(log), tables, order_by=["cycle"], partitions=2).take_all()
    errors = {row["cycle"]: row["error"] for row in told}
    assert len(told) == 2
    assert sum(error is not None for error in errors.values()) == 1
