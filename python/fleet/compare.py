"""A large fleet through one process of the program and through an engine: the same rows, and what they cost.

    python python/fleet/compare.py --valves 100000 --cycles 100 --engine spark
    python python/fleet/compare.py --valves 100000 --cycles 100 --engine ray

The engine does it twice, in two partitionings, the second time with one of its processes killed by SIGKILL in the middle.
Rows are compared by a digest for each valve over every column that the program writes as CSV, so that what is to be kept
does not grow with the rows: a row's values, bit by bit, are hashed into 64 bits, and those of a valve's rows added up,
since an engine's rows come in no order (the cycle is among the values).
"""

from __future__ import annotations

import argparse
import hashlib
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute
import pyarrow.csv
import pyarrow.dataset
import pyarrow.parquet
from numpy.typing import NDArray

import fleet
import valve_prognosis as vp

#: Parquet files that the rows are in, so that those of a valve come from several tasks.
FILES = 16
#: Into how many partitions the valves are shared out, first and second time.
PARTITIONS = (13, 32)
#: Columns that the program's CSV does not have.
NOT_IN_CSV = {"noise_s", "time", "notices", "error"}
#: Stands for a value that is missing.
MISSING = np.uint64(0x9E37_79B9_7F4A_7C15)


def mixed(words: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Words of which each bit depends on every bit of those that came in (Stafford's variant 13, as in SplitMix64)."""
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58_476D_1CE4_E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D0_49BB_1331_11EB)
    return words ^ (words >> np.uint64(31))


def words_of(column: pa.ChunkedArray) -> NDArray[np.uint64]:
    """A word for each value, the same for the same bits."""
    if pa.types.is_null(column.type):
        return np.full(len(column), MISSING)
    missing = column.is_null().to_numpy(zero_copy_only=False)
    if pa.types.is_floating(column.type):
        words = column.fill_null(0.0).to_numpy().view(np.uint64)
    elif pa.types.is_integer(column.type):
        words = column.fill_null(0).cast(pa.int64()).to_numpy().view(np.uint64)
    else:
        kinds = column.cast(pa.string()).fill_null("").combine_chunks().dictionary_encode()
        digests = [hashlib.blake2b(text.encode(), digest_size=8).digest() for text in kinds.dictionary.to_pylist()]
        words = np.frombuffer(b"".join(digests), dtype=np.uint64)[kinds.indices.to_numpy()]
    return np.where(missing, MISSING, words)


class Digests:
    """The digest of each valve, and how many rows there were."""

    def __init__(self, valves: int) -> None:
        self.sums = np.zeros(valves, dtype=np.uint64)
        self.rows = 0
        self._names = pa.array(fleet.names(valves))

    def add(self, rows: pa.Table) -> None:
        words = np.zeros(len(rows), dtype=np.uint64)
        for name, _ in vp.Rows.columns():
            if name not in NOT_IN_CSV:
                words = mixed(words * np.uint64(3) + words_of(rows.column(name)))
        valves = pa.compute.index_in(rows.column("valve").cast(pa.string()), value_set=self._names)
        np.add.at(self.sums, valves.to_numpy(), words)
        self.rows += len(rows)

    def fingerprint(self) -> str:
        return hashlib.sha256(self.sums.tobytes()).hexdigest()[:16]


def by_program(log: Path, valves: int, rows: int) -> Digests:
    """What one process of the program says, read as it comes."""
    told_as_csv = ["--format", "csv", "-q"]
    call = [fleet.program(), "prognose", str(log), "--tables", str(fleet.ROOT / "tables"), *told_as_csv]
    kinds = {"string": pa.string(), "double": pa.float64(), "long": pa.int64()}
    types = {name: kinds[kind] for name, kind in vp.Rows.columns()}
    told = Digests(valves)
    with tempfile.TemporaryDirectory(dir=log.parent) as folder:
        out = Path(folder) / "told.csv"
        with out.open("wb") as file:
            before = os.times()
            subprocess.run(call, check=True, stdout=file)
            after = os.times()
        cores = after.children_user + after.children_system - before.children_user - before.children_system
        print(f"one process of the program, CSV to CSV: {rows / cores:.0f} rows a core second ({cores:.1f} core s)")
        options = pa.csv.ConvertOptions(column_types=types, null_values=[""], strings_can_be_null=True)
        for batch in pa.csv.open_csv(out, convert_options=options, read_options=pa.csv.ReadOptions(block_size=1 << 26)):
            told.add(pa.Table.from_batches([batch]))
    return told


def by_prognoser(rows: Iterable[pa.RecordBatch], tables: vp.Tables, count: int, valves: int) -> Digests:
    """What one process of the package says, one thread, from Arrow to Arrow."""
    told, prognoser, cores = Digests(valves), vp.Prognoser(tables, threads=1), 0.0
    for batch in rows:
        before = time.process_time()
        out = pa.table(prognoser.push_frame(batch))
        cores += time.process_time() - before
        told.add(out)
    cost = f"{count / cores:.0f} rows a core second ({cores:.1f} core s)"
    print(f"one process of the package, one thread: {cost}")
    sizes = np.array([len(prognoser.state(valve) or b"") for valve in prognoser.valves])
    print(f"state of a valve: {sizes.mean():.0f} bytes, largest of {len(sizes)}: {sizes.max()}", flush=True)
    return told


@contextmanager
def killing(victims: Callable[[], list[int]]) -> Iterator[list[int]]:
    """Kills the first process that is among the victims, once there is one."""
    killed: list[int] = []
    ended = threading.Event()

    def kill() -> None:
        while not (found := victims()):
            if ended.wait(0.05):
                return
        os.kill(found[0], signal.SIGKILL)
        killed.append(found[0])

    thread = threading.Thread(target=kill, daemon=True)
    thread.start()
    try:
        yield killed
    finally:
        ended.set()
        thread.join()


def on_spark(rows: Path, out: Path, tables: vp.Tables, count: int) -> None:
    from valve_prognosis.spark import prognose

    spark = fleet.spark(executors=2)
    tracker = spark.sparkContext.statusTracker()

    def victims() -> list[int]:
        """An executor, once a quarter of the tasks that make prognoses have ended and others run."""
        stages = [tracker.getStageInfo(stage) for stage in tracker.getActiveStageIds()]
        quarter = PARTITIONS[1] // 4
        second = [one for one in stages if one is not None and one.numTasks == PARTITIONS[1]]
        late = any(one.numCompletedTasks >= quarter for one in second)
        return fleet.executors(spark.sparkContext.applicationId) if late else []

    read = spark.read.parquet(str(rows))
    # Once to start Python on every executor.
    prognose(read.limit(100), tables, order_by=["line"]).write.format("noop").mode("overwrite").save()

    def run(partitions: int) -> None:
        with fleet.measured(f"Spark, {partitions} partitions, Parquet to Parquet", count):
            told = prognose(read, tables, order_by=["line"], partitions=partitions)
            told.write.parquet(str(out / str(partitions)))

    run(PARTITIONS[0])
    with killing(victims) as killed:
        run(PARTITIONS[1])
    assert killed, "no executor was killed while tasks ran"
    print(f"executor {killed[0]} was killed in the middle of it", flush=True)
    spark.stop()


def on_ray(rows: Path, out: Path, tables: vp.Tables, count: int) -> None:
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    import ray

    from valve_prognosis.ray import prognose

    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level="ERROR")
    ray.data.DataContext.get_current().enable_progress_bars = False
    read = ray.data.read_parquet(str(rows))
    # Once to start the workers.
    prognose(read.limit(100), tables, order_by=["line"], partitions=2).materialize()

    def run(partitions: int) -> None:
        with fleet.measured(f"Ray, {partitions} blocks, Parquet to Parquet", count):
            told = prognose(read, tables, order_by=["line"], partitions=partitions)
            told.write_parquet(str(out / str(partitions)))

    run(PARTITIONS[0])
    with killing(fleet.ray_workers) as killed:
        run(PARTITIONS[1])
    assert killed, "no worker was killed while tasks ran"
    print(f"worker {killed[0]} was killed in the middle of it", flush=True)
    ray.shutdown()


def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--valves", type=int, default=100_000)
    arguments.add_argument("--cycles", type=int, default=100)
    arguments.add_argument("--engine", choices=["spark", "ray"], nargs="+", default=["spark"])
    arguments.add_argument("--folder", type=Path, help="for files; 10 million rows need 5 GB")
    options = arguments.parse_args()
    tables = vp.Tables.read(fleet.ROOT / "tables")
    count = options.valves * options.cycles
    with tempfile.TemporaryDirectory(dir=options.folder) as temporary:
        folder = Path(temporary)
        source, log = folder / "rows", folder / "log.csv"
        source.mkdir()
        rows = fleet.log(tables, options.valves, options.cycles)
        print(f"{options.valves} valves, {count} rows", flush=True)
        pa.csv.write_csv(rows.drop_columns(["line"]), log)
        size = -(-count // FILES)
        for part in range(FILES):
            pa.parquet.write_table(rows.slice(part * size, size), source / f"{part:02}.parquet")
        del rows
        program = by_program(log, options.valves, count)
        assert program.rows == count, program.rows
        print(f"the program's rows: {program.fingerprint()}", flush=True)
        package = by_prognoser(pa.dataset.dataset(source).to_batches(), tables, count, options.valves)
        check("the package's", package, program)
        for engine in options.engine:
            out = folder / engine
            out.mkdir()
            {"spark": on_spark, "ray": on_ray}[engine](source, out, tables, count)
            for partitions in PARTITIONS:
                told = Digests(options.valves)
                for batch in pa.dataset.dataset(out / str(partitions), format="parquet").to_batches():
                    told.add(pa.Table.from_batches([batch]))
                check(f"{engine}'s in {partitions} partitions", told, program)


def check(whose: str, told: Digests, program: Digests) -> None:
    differ = int(np.count_nonzero(told.sums != program.sums))
    print(f"{whose} rows: {told.fingerprint()}, {told.rows} rows, {differ} valves differ from the program's", flush=True)
    if differ or told.rows != program.rows:
        sys.exit(1)


if __name__ == "__main__":
    main()
