"""A fleet on Ray Data: one row in, one row out, each valve's rows in their order, whatever the blocks.

The tables go to Ray's object store once. Rows of a valve meet in one block, a task sorts it by ``order_by``, and a
prognoser of one thread reads it; what Ray runs again after a loss gives the same rows. The rows that come out are those
of the ``valve`` program.

    prognoses = prognose(ray.data.read_parquet("rows"), tables, order_by=["time"])
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from valve_prognosis._fleet import digest, tables_at_hand, valve_by_valve
from valve_prognosis._native import Prognoser, Rows, Tables

if TYPE_CHECKING:
    from ray.data import Dataset

__all__ = ["prognose", "schema"]

#: Arrow's names of types.
_TYPES = {"string": pa.string(), "double": pa.float64(), "long": pa.int64()}

#: Rows that go through the prognoser at a time: what comes out of them is some 16 MB, however large the block.
_AT_A_TIME = 65_536


def schema() -> pa.Schema:
    """The columns that come out; those of `Rows`."""
    return pa.schema([(name, _TYPES[kind]) for name, kind in Rows.columns()])


def prognose(
    rows: Dataset,
    tables: Tables,
    *,
    order_by: Sequence[str],
    keep: Sequence[str] = (),
    partitions: int | None = None,
    **settings: Any,
) -> Dataset:
    """The prognosis after every row of a log.

    Parameters
    ----------
    rows : ray.data.Dataset
        Columns as `Prognoser.push_frame` takes them.
    tables : Tables
        The tables of the kind of valve that the log is of.
    order_by : sequence of str
        Columns that give the order of a valve's rows, such as a time or the number of the row. It has to be an order in
        which no two rows of a valve are alike.
    keep : sequence of str
        Further columns of ``rows`` that come out beside the prognosis, to know the row by.
    partitions : int, optional
        Into how many blocks the valves are shared out, each of which has to fit in a worker's memory; Ray's own number
        for shuffles unless given.
    **settings
        Those of `Prognoser`. What is no row comes out with the reason in its column ``error``.

    Returns
    -------
    ray.data.Dataset
        A row for every row, in no order.
    """
    blocks = partitions or rows.context.default_hash_shuffle_parallelism
    shared = rows.repartition(blocks, keys=["valve"])
    # A block as a whole is a batch: never a part of one, since then a valve's rows would be torn apart.
    told: Dataset = shared.map_batches(
        _blocks(tables, list(order_by), list(keep), settings), batch_size=None, batch_format="pyarrow"
    )
    return told


def _blocks(
    tables: Tables, order_by: list[str], keep: list[str], settings: dict[str, Any]
) -> Callable[[pa.Table], Iterator[pa.Table]]:
    import ray

    content = tables.to_bytes()
    known_by, stored = digest(content), ray.put(content)
    order = [(name, "ascending") for name in ["valve", *order_by]]

    def work(block: pa.Table) -> Iterator[pa.Table]:
        if block.num_rows == 0:
            told = schema()
            for name in keep:
                if name in block.column_names:
                    told = told.append(block.schema.field(name))
            yield told.empty_table()
            return
        prognoser = Prognoser(tables_at_hand(known_by, lambda: bytes(ray.get(stored))), threads=1, **settings)
        batches = block.sort_by(order).combine_chunks().to_batches(max_chunksize=_AT_A_TIME)
        for batch in valve_by_valve(prognoser, batches, keep):
            yield pa.Table.from_batches([batch])

    return work
