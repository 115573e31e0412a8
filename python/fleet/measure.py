"""What a fleet costs: rows for each second of a core in one process and on Spark, sizes of states, time of checkpoints.

    python python/fleet/measure.py --valves 100000 --cycles 10

Seconds of cores are counted by the operating system for all processes that take part, so that other work on the machine
hardly matters; wall times are printed beside them.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet
from pyspark.sql import SparkSession

import fleet
import valve_prognosis as vp
from valve_prognosis.spark import prognose, prognose_stream

def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--valves", type=int, default=100_000)
    arguments.add_argument("--cycles", type=int, default=10)
    arguments.add_argument("--executors", type=int, default=2)
    arguments.add_argument("--stream-valves", type=int, default=0)
    arguments.add_argument("--stream-batches", type=int, default=2)
    arguments.add_argument("--stream-groups", type=int, nargs="*", default=[0], help="0: a state for each valve")
    options = arguments.parse_args()
    tables = vp.Tables.read(fleet.ROOT / "tables")
    rows = fleet.log(tables, options.valves, options.cycles)
    print(f"{options.valves} valves, {len(rows)} rows; tables of {len(tables.to_bytes()) / 1e3:.0f} kB", flush=True)

    prognoser = vp.Prognoser(tables, threads=1)
    with fleet.measured("one process, one thread", len(rows)):
        prognoser.push_frame(rows)
    with fleet.measured("states of all valves to bytes", options.valves):
        states = prognoser.to_bytes()
    sizes = [len(prognoser.state(valve) or b"") for valve in prognoser.valves[:: max(1, options.valves // 1000)]]
    print(f"state of a valve: {len(states) / options.valves:.0f} bytes, largest of {len(sizes)}: {max(sizes)}", flush=True)
    del prognoser, states

    spark = fleet.spark(options.executors)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        (folder / "rows").mkdir()
        for part in range(8):
            size = len(rows) // 8 + 1
            pyarrow.parquet.write_table(rows.slice(part * size, size), folder / "rows" / f"{part}.parquet")
        read = spark.read.parquet(str(folder / "rows"))
        # Once to start Python on every executor.
        prognose(read.limit(100), tables, order_by=["line"]).write.format("noop").mode("overwrite").save()
        with fleet.measured("Spark, shuffle and sort alone", len(rows)):
            shuffled = read.repartition(8, "valve").sortWithinPartitions("valve", "line")
            shuffled.write.format("noop").mode("overwrite").save()
        with fleet.measured("Spark, prognosis", len(rows)):
            prognose(read, tables, order_by=["line"], partitions=8).write.format("noop").mode("overwrite").save()
        if options.stream_valves:
            for groups in options.stream_groups:
                stream(spark, tables, options.stream_valves, options.stream_batches, groups, folder / f"by-{groups}")
    spark.stop()


def stream(spark: SparkSession, tables: vp.Tables, valves: int, batches: int, groups: int, folder: Path) -> None:
    """One row of every valve in each micro-batch."""
    rows = fleet.log(tables, valves, batches)
    source, checkpoint = folder / "stream", folder / "checkpoint"
    source.mkdir(parents=True)
    for batch in range(batches):
        pyarrow.parquet.write_table(rows.slice(batch * valves, valves), source / f"{batch}.parquet")
        frame = spark.readStream.schema(spark.read.parquet(str(source)).schema).parquet(str(source))
        with fleet.measured(f"Spark, stream, {groups or valves} states, micro-batch {batch + 1}", valves):
            query = (
                prognose_stream(frame, tables, order_by=["line"], groups=groups or None)
                .writeStream.outputMode("append")
                .option("checkpointLocation", str(checkpoint))
                .trigger(availableNow=True)
                .start(path=str(folder / "out"), format="parquet")
            )
            query.awaitTermination()
        told = [json.loads(one.json) if hasattr(one, "json") else one for one in query.recentProgress]
        for one in told:
            for operator in one["stateOperators"]:
                print(
                    f"  {operator['numRowsTotal']} states, commit {operator['commitTimeMs'] / 1e3:.2f} s over all "
                    f"partitions, {operator['memoryUsedBytes'] / 1e6:.0f} MB in memory",
                    flush=True,
                )
    size = sum(file.stat().st_size for file in checkpoint.rglob("*") if file.is_file())
    print(f"checkpoint: {size / 1e6:.1f} MB after {batches} micro-batches", flush=True)


if __name__ == "__main__":
    main()
