"""What the engines have in common: tables that a worker reads once, and valves that come one after the other."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence

import pyarrow as pa

from valve_prognosis._native import Prognoser, Tables

#: Tables of this worker, by their digest: read once, however many tasks it runs.
_AT_HAND: dict[str, Tables] = {}


def digest(content: bytes) -> str:
    """What tables are known by on a worker."""
    return hashlib.sha256(content).hexdigest()


def tables_at_hand(known_by: str, content: Callable[[], bytes]) -> Tables:
    """The tables on a worker; their bytes are asked for once."""
    if known_by not in _AT_HAND:
        _AT_HAND[known_by] = Tables.from_bytes(content())
    return _AT_HAND[known_by]


def valve_by_valve(
    prognoser: Prognoser, batches: Iterable[pa.RecordBatch], keep: Sequence[str]
) -> Iterator[pa.RecordBatch]:
    """The prognosis after every row of batches in which each valve's rows come in one piece, in their order.

    Only one valve's state is at hand from one batch to the next.
    """
    for batch in batches:
        if batch.num_rows == 0:
            continue
        out = pa.table(prognoser.push_frame(batch, on_error="keep"))
        for name in keep:
            out = out.append_column(name, batch.column(name))
        yield from out.to_batches()
        # Only the last valve of a batch may go on in the next.
        last = batch.column("valve")[-1].as_py()
        for valve in prognoser.valves:
            if valve != last:
                prognoser.forget(valve)
