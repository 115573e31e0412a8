"""Campaigns from data frames."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from valve_prognosis._native import Campaign, ValveFile

_Scalar = str | int | float | bool


def campaign_from_frames(
    valve: ValveFile,
    runs: Sequence[tuple[Any, Mapping[str, _Scalar]]],
    *,
    name: str = "recordings",
    sensors: Mapping[str, _Scalar] | None = None,
    folder: str | PathLike[str] | None = None,
) -> Campaign:
    """A campaign of strokes that are in data frames.

    Parameters
    ----------
    valve : ValveFile
        The valve on which they were recorded.
    runs : sequence of (frame, conditions)
        Each frame (or dict of arrays of one length) has columns as a recording has them, with units in their names:
        ``time_s``, ``command`` and ``position_mm``, pressures as ``chamber_pressure_kpa``. The conditions are the keys
        of a ``[[run]]``, such as ``{"supply_pressure": "75 psig", "temperature": "20 degC"}``.
    name : str
        What answers call the campaign.
    sensors : dict, optional
        The keys of ``[sensors]``, such as ``{"position_noise": "0.03 mm"}``.
    folder : path, optional
        Where the campaign's files are written and kept; somewhere temporary unless given.

    Returns
    -------
    Campaign
        As `Campaign.read` gives it, of the same numbers.
    """
    if folder is None:
        with tempfile.TemporaryDirectory() as temporary:
            return _written(valve, runs, name, sensors or {}, Path(temporary))
    return _written(valve, runs, name, sensors or {}, Path(folder))


def _written(
    valve: ValveFile,
    runs: Sequence[tuple[Any, Mapping[str, _Scalar]]],
    name: str,
    sensors: Mapping[str, _Scalar],
    folder: Path,
) -> Campaign:
    folder.mkdir(parents=True, exist_ok=True)
    lines = [f"name = {_toml(name)}"]
    if sensors:
        lines += ["", "[sensors]", *(f"{key} = {_toml(value)}" for key, value in sensors.items())]
    for place, (frame, conditions) in enumerate(runs, start=1):
        file = f"run-{place}.csv"
        (folder / file).write_text(_csv(frame), encoding="utf-8")
        lines += ["", "[[run]]", f"file = {_toml(file)}"]
        lines += [f"{key} = {_toml(value)}" for key, value in conditions.items()]
    path = folder / "campaign.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return Campaign.read(valve, path)


def _toml(value: _Scalar) -> str:
    # A JSON string is a TOML string, and so are numbers and truth values.
    return json.dumps(value, ensure_ascii=False)


def _csv(frame: Any) -> str:
    names = [str(name) for name in (frame.columns if hasattr(frame, "columns") else frame)]
    columns = [np.asarray(frame[name]).tolist() for name in names]
    # The shortest text that is read back as the same number; nothing where there is none.
    texts = (["" if value is None or value != value else repr(value) for value in column] for column in columns)
    rows = (",".join(row) for row in zip(*texts, strict=True))
    return "\n".join([",".join(names), *rows]) + "\n"
