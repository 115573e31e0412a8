"""A fleet on Spark: one row in, one row out, each valve's rows in their order, whatever the partitioning.

The tables go to every executor once. Rows of a valve meet in one task, in the order that ``order_by`` gives, and a
prognoser of one thread reads them; Spark alone decides how many tasks there are. The rows that come out are those of
the ``valve`` program.

    prognoses = prognose(spark.read.parquet("rows"), tables, order_by=["time"])
    prognoses = prognose_stream(spark.readStream.schema(...).parquet("rows"), tables, order_by=["time"])
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from valve_prognosis._fleet import digest, tables_at_hand, valve_by_valve
from valve_prognosis._native import Prognoser, Rows, Tables

if TYPE_CHECKING:
    import pandas as pd
    from pyspark.sql import DataFrame

__all__ = ["prognose", "prognose_stream", "schema"]

#: Spark's names of types.
_TYPES = {"string": "string", "double": "double", "long": "bigint"}


def schema() -> str:
    """The columns that come out, as Spark's DDL; those of `Rows`."""
    return ", ".join(f"`{name}` {_TYPES[kind]}" for name, kind in Rows.columns())


class _Shipped:
    """Tables on their way to the executors."""

    def __init__(self, frame: DataFrame, tables: Tables) -> None:
        content = tables.to_bytes()
        self._known_by = digest(content)
        self._content = frame.sparkSession.sparkContext.broadcast(content)

    def tables(self) -> Tables:
        """The tables, on an executor."""
        return tables_at_hand(self._known_by, lambda: bytes(self._content.value))


def prognose(
    rows: DataFrame,
    tables: Tables,
    *,
    order_by: Sequence[str],
    keep: Sequence[str] = (),
    partitions: int | None = None,
    **settings: Any,
) -> DataFrame:
    """The prognosis after every row of a log.

    Parameters
    ----------
    rows : pyspark.sql.DataFrame
        Columns as `Prognoser.push_frame` takes them.
    tables : Tables
        The tables of the kind of valve that the log is of.
    order_by : sequence of str
        Columns that give the order of a valve's rows, such as a time or the number of the row. It has to be an order in
        which no two rows of a valve are alike.
    keep : sequence of str
        Further columns of ``rows`` that come out beside the prognosis, to know the row by.
    partitions : int, optional
        Into how many tasks the valves are shared out; Spark's own number unless given.
    **settings
        Those of `Prognoser`. What is no row comes out with the reason in its column ``error``.

    Returns
    -------
    pyspark.sql.DataFrame
        A row for every row, in no order.
    """
    shared = rows.repartition(partitions, "valve") if partitions else rows.repartition("valve")
    kept = [rows.schema[name] for name in keep]
    told = rows.sparkSession.createDataFrame([], schema()).schema
    for field in kept:
        told = told.add(field)
    work = _batches(_Shipped(rows, tables), list(keep), settings)
    return shared.sortWithinPartitions("valve", *order_by).mapInArrow(work, told)


def _batches(
    shipped: _Shipped, keep: list[str], settings: dict[str, Any]
) -> Callable[[Iterable[pa.RecordBatch]], Iterator[pa.RecordBatch]]:
    def work(batches: Iterable[pa.RecordBatch]) -> Iterator[pa.RecordBatch]:
        yield from valve_by_valve(Prognoser(shipped.tables(), threads=1, **settings), batches, keep)

    return work


def prognose_stream(
    rows: DataFrame, tables: Tables, *, order_by: Sequence[str], groups: int | None = None, **settings: Any
) -> DataFrame:
    """The prognosis after every row of a stream; each valve's state is the prognoser's bytes.

    Exactly once as far as the stream's source and sink are: states are part of Spark's checkpoints. A state that was kept
    with other tables or settings stops the stream; begin anew from the log with another checkpoint then.

    Parameters
    ----------
    rows : pyspark.sql.DataFrame
        A stream with the columns that `Prognoser.push_frame` takes.
    tables, order_by, **settings
        As for `prognose`; the order is that within a micro-batch, and what comes later counts as later.
    groups : int, optional
        Share the valves out into so many groups with a state each, that of all its valves. Spark spends milliseconds on
        each state that a micro-batch touches: where most valves have rows in most of them, hundreds of valves in a group
        are many times faster. The number cannot change once there is a checkpoint. A state for each valve unless given.

    Returns
    -------
    pyspark.sql.DataFrame
        A row for every row; write it with the output mode "append".
    """
    from pyspark.sql import functions as f
    from pyspark.sql.streaming.state import GroupStateTimeout

    work = _groups(_Shipped(rows, tables), list(order_by), settings)
    told = rows.sparkSession.createDataFrame([], schema()).schema
    key = f.col("valve") if groups is None else f.pmod(f.hash("valve"), f.lit(groups))
    return (
        rows.withColumn("_group", key)
        .groupBy("_group")
        .applyInPandasWithState(work, told, "state binary", "append", GroupStateTimeout.NoTimeout)
    )


def _groups(
    shipped: _Shipped, order_by: list[str], settings: dict[str, Any]
) -> Callable[[tuple[Any], Iterable[pd.DataFrame], Any], Iterator[pd.DataFrame]]:
    def work(key: tuple[Any], frames: Iterable[pd.DataFrame], state: Any) -> Iterator[pd.DataFrame]:
        prognoser = Prognoser(shipped.tables(), threads=1, **settings)
        if state.exists:
            prognoser.load_bytes(bytes(state.get[0]))
        parts = [pa.RecordBatch.from_pandas(frame, preserve_index=False) for frame in frames]
        rows = pa.Table.from_batches(parts).sort_by([(name, "ascending") for name in order_by])
        out = pa.table(prognoser.push_frame(rows, on_error="keep"))
        state.update((prognoser.to_bytes(),))
        yield out.to_pandas()

    return work
