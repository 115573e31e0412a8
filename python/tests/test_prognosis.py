"""Prognoses against the program's."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

import valve_prognosis as vp

Lines = list[dict[str, Any]]


def lines_of(program: Callable[..., str], log: Path, *words: object) -> Lines:
    """The program's line for every row."""
    text = program("prognose", log, "--tables", "tables", "--format", "jsonl", *words)
    return [json.loads(line) for line in text.splitlines()]


def fleet_log(log: Path, valves: int) -> str:
    """The rows of the log that comes along for many valves, interleaved, each a little slower than the one before."""
    frame = pd.read_csv(log)
    parts = []
    for index in range(valves):
        part = frame.copy()
        part["valve"] = f"V-{index:03}"
        part[["close_time_s", "open_time_s"]] *= 1.0 + 1e-3 * index
        parts.append(part)
    return str(pd.concat(parts).sort_values("cycle", kind="stable").to_csv(index=False))


def assert_same(rows: vp.Rows, lines: Lines) -> None:
    """Every number of every row, to the bit."""
    told = rows.to_pyarrow().to_pylist()
    assert len(told) == len(lines)
    apart = {"schema", "fault_probability", "notices", "fault_group"}
    for row, line in zip(told, lines, strict=True):
        for name, share in (line["fault_probability"] or {}).items():
            column = f"p_{name.replace('-', '_')}"
            assert row[column] == share, column
        for name, value in line.items():
            if name not in apart:
                assert row[name] == value, name
        assert json.loads(row["notices"] or "[]") == line["notices"]
        assert row["fault_group"] == (" ".join(line["fault_group"]) if "fault_group" in line else None)
        assert row["error"] is None


def test_rows_one_by_one_are_the_programs(program: Callable[..., str], tables: vp.Tables, log: Path) -> None:
    prognoser = vp.Prognoser(tables)
    told = [prognoser.push(row) for row in pd.read_csv(log).to_dict("records")]
    assert told == lines_of(program, log)
    assert prognoser.last("FV-101") == {**told[-1], "notices": []}
    assert prognoser.last("FV-102") is None
    assert "FV-101" in prognoser and len(prognoser) == 1 and prognoser.valves == ["FV-101"]


@pytest.mark.parametrize(
    ("words", "settings"),
    [
        ([], {}),
        (["--noise", "20 ms"], {"noise_s": 0.02}),
        (["--start", "unknown", "--risk", "0.2"], {"start": "unknown", "risk": 0.2}),
        (["--growth", "linear", "--life", "90"], {"growth": "linear", "life_cycles": 90.0}),
        (["--method", "ols"], {"method": "ols"}),
    ],
)
def test_settings_mean_what_the_programs_mean(
    program: Callable[..., str], tables: vp.Tables, log: Path, words: list[str], settings: dict[str, Any]
) -> None:
    assert_same(vp.Prognoser(tables, **settings).push_frame(pd.read_csv(log)), lines_of(program, log, *words))


def test_what_sister_valves_taught_is_taken_in(
    program: Callable[..., str], tables: vp.Tables, log: Path, tmp_path: Path
) -> None:
    prior = tmp_path / "prior.toml"
    program("learn", log, "--tables", "tables", "--out", prior)
    assert_same(vp.Prognoser(tables, prior=prior).push_frame(pd.read_csv(log)), lines_of(program, log, "--prior", prior))


@pytest.mark.parametrize("kind", ["pandas", "polars", "pyarrow", "batches", "categories", "reader"])
def test_frames_of_every_library_give_the_programs_rows(
    program: Callable[..., str], tables: vp.Tables, log: Path, tmp_path: Path, kind: str
) -> None:
    many = tmp_path / "log.csv"
    many.write_text(fleet_log(log, 40))
    frame = pd.read_csv(many)
    table = pa.Table.from_pandas(frame, preserve_index=False)
    frames: dict[str, Any] = {
        "pandas": frame,
        "polars": pl.read_csv(many),
        "pyarrow": table,
        "batches": pa.Table.from_batches(table.to_batches(max_chunksize=7)),
        "categories": frame.assign(valve=frame["valve"].astype("category"), cycle=frame["cycle"].astype("int32")),
        "reader": pa.RecordBatchReader.from_batches(table.schema, table.to_batches(max_chunksize=100)),
    }
    rows = vp.Prognoser(tables).push_frame(frames[kind])
    assert_same(rows, lines_of(program, many))
    assert list(rows.to_polars()["valve"]) == list(frame["valve"])


@pytest.mark.parametrize("threads", [1, 3])
def test_threads_and_pieces_change_nothing(tables: vp.Tables, log: Path, tmp_path: Path, threads: int) -> None:
    many = tmp_path / "log.csv"
    many.write_text(fleet_log(log, 40))
    frame = pd.read_csv(many)
    prognoser = vp.Prognoser(tables, threads=threads)
    parts = [prognoser.push_frame(frame[start : start + 333]).to_pyarrow() for start in range(0, len(frame), 333)]
    told = pa.concat_tables(parts).combine_chunks()
    assert told.equals(vp.Prognoser(tables).push_frame(frame).to_pyarrow().combine_chunks())
    lasts = prognoser.lasts().to_pandas()
    assert list(lasts["valve"]) == sorted(frame["valve"].unique())
    assert list(lasts["rul_cycles"]) == list(told.to_pandas()["rul_cycles"][-40:])


def test_stalls_missing_times_dates_and_units_are_the_programs(
    program: Callable[..., str], tables: vp.Tables, tmp_path: Path
) -> None:
    log = tmp_path / "log.csv"
    log.write_text(
        "valve,cycle,close_time_s,open_time_s,time,supply_pressure_psig,temperature_degc\n"
        "A,0,1.04,2.13,2026-01-01T00:00:00Z,75,20\n"
        "A,1,,2.12,2026-01-02T00:00:00Z,75,\n"
        "A,2,stalled,2.10,2026-01-03T00:00:00Z,75,20\n"
        "A,3,1.05,0,2026-01-04T00:00:00Z,75,20\n"
        "A,3,1.05,2.1,2026-01-05T00:00:00Z,75,20\n"
        "A,9,1.30,1.8,2026-01-06T00:00:00Z,75,20\n"
    )
    lines = lines_of(program, log)
    frame = pd.read_csv(log)
    told = vp.Prognoser(tables).push_frame(frame)
    assert_same(told, lines)
    # Numbers, not a word: infinity did not arrive; dates, not texts.
    numbers = frame.assign(
        close_time_s=pd.to_numeric(frame["close_time_s"].replace("stalled", "inf")), time=pd.to_datetime(frame["time"])
    )
    of_numbers = vp.Prognoser(tables).push_frame(numbers).to_pyarrow().drop_columns(["time"])
    assert of_numbers.equals(told.to_pyarrow().drop_columns(["time"]))
    one_by_one = vp.Prognoser(tables)
    assert [one_by_one.push(row) for row in frame.to_dict("records")] == lines


def test_a_state_goes_on_at_any_row(tables: vp.Tables, log: Path) -> None:
    frame = pd.read_csv(log)
    whole = vp.Prognoser(tables).push_frame(frame).to_pyarrow().combine_chunks()
    for cut in [1, 9, 14, len(frame) - 1]:
        first = vp.Prognoser(tables)
        first.push_frame(frame[:cut])
        state = first.state("FV-101")
        assert state is not None
        second = vp.Prognoser(tables)
        second.resume("FV-101", state)
        assert second.push_frame(frame[cut:]).to_pyarrow().combine_chunks().equals(whole.slice(cut).combine_chunks())
        third = vp.Prognoser(tables)
        third.load_bytes(first.to_bytes())
        assert third.to_bytes() == first.to_bytes()
        first.forget("FV-101")
        assert first.state("FV-101") is None


def test_a_state_of_others_is_refused(tables: vp.Tables, reference: vp.ValveFile, log: Path) -> None:
    prognoser = vp.Prognoser(tables)
    prognoser.push_frame(pd.read_csv(log))
    state = prognoser.state("FV-101")
    assert state is not None
    other = reference.with_parameters({"spring.stiffness": 15000.0}).build_tables()
    for others in [vp.Prognoser(tables, risk=0.1), vp.Prognoser(other)]:
        with pytest.raises(vp.ValveError, match="other tables or settings"):
            others.resume("FV-101", state)
    with pytest.raises(vp.ValveError, match="cut off"):
        prognoser.resume("FV-101", state[:-3])
    with pytest.raises(vp.ValveError, match="other tables or settings"):
        prognoser.resume("FV-101", b"")
    with pytest.raises(vp.ValveError, match="keeps no state"):
        vp.Prognoser(tables, method="ols").to_bytes()


def test_what_is_no_row_is_refused_whole_or_kept_with_its_reason(tables: vp.Tables, log: Path) -> None:
    frame = pd.read_csv(log)
    bad = frame.copy()
    bad.loc[5, "close_time_s"] = -2.0
    prognoser = vp.Prognoser(tables)
    with pytest.raises(vp.ValveError, match='row 5: close_time_s: found "-2", expected a time in s'):
        prognoser.push_frame(bad)
    assert len(prognoser) == 0, "a frame that is refused leaves the state as it was"
    told = prognoser.push_frame(bad, on_error="keep").to_pandas()
    assert len(told) == len(bad)
    assert told.loc[5, "error"].startswith("close_time_s")
    assert told.loc[5, "valve"] == "FV-101"
    without = vp.Prognoser(tables).push_frame(bad.drop(index=5)).to_pandas()
    pd.testing.assert_frame_equal(
        told.drop(index=5).drop(columns="error").reset_index(drop=True), without.drop(columns="error"), check_dtype=False
    )


def test_refusals_say_what_was_found(tables: vp.Tables, log: Path) -> None:
    frame = pd.read_csv(log)
    prognoser = vp.Prognoser(tables)
    cases: list[tuple[Any, str]] = [
        (frame.drop(columns="open_time_s"), 'expected also "open_time_s"'),
        (frame.assign(cycle=0.5), 'row 0: cycle: found "0.5"'),
        (frame.assign(valve=7), 'column "valve": found values of type Int64, expected text'),
        (frame.assign(close_time_s=True), "found values of type Boolean"),
        (frame.assign(supply_pressure_psig=75.0, supply_pressure_pa=1.0), "two columns supply_pressure_UNIT"),
    ]
    for wrong, message in cases:
        with pytest.raises(vp.ValveError, match=message):
            prognoser.push_frame(wrong)
    with pytest.raises(TypeError, match="found list, expected a data frame"):
        prognoser.push_frame([1, 2])  # type: ignore[arg-type]
    with pytest.raises(vp.ValveError, match='a row without "cycle"'):
        prognoser.push(valve="A", close_time_s=1.0)
    with pytest.raises(vp.ValveError, match='method: found "best"'):
        vp.Prognoser(tables, method="best")  # type: ignore[arg-type]
    assert len(prognoser.push_frame(frame[:0])) == 0
    assert len(prognoser) == 0


def test_nothing_is_copied_on_the_way_in_or_out(tables: vp.Tables, log: Path) -> None:
    table = pa.Table.from_pandas(pd.read_csv(log), preserve_index=False)
    before = pa.total_allocated_bytes()
    rows = vp.Prognoser(tables).push_frame(table)
    out = pa.table(rows)
    assert pa.total_allocated_bytes() == before
    assert out.num_rows == table.num_rows


def test_the_path_of_a_valve_is_drawn_as_the_program_draws_it(
    program: Callable[..., str], tables: vp.Tables, log: Path, tmp_path: Path
) -> None:
    program("prognose", log, "--tables", "tables", "--plot", tmp_path / "life.svg")
    figure = tables.life_figure(pd.read_csv(log))
    assert figure.svg == (tmp_path / "life.svg").read_text()
    figure.save(tmp_path / "life.png")
    assert (tmp_path / "life.png").read_bytes()[1:4] == b"PNG"
    with pytest.raises(vp.ValveError, match=r"\.svg or \.png"):
        figure.save(tmp_path / "life.jpg")
    with pytest.raises(vp.ValveError, match="no row of FV-9"):
        tables.life_figure(pd.read_csv(log), valve="FV-9")


def test_the_columns_are_named_for_other_engines() -> None:
    columns = dict(vp.Rows.columns())
    assert columns["valve"] == "string" and columns["cycle"] == "long" and columns["rul_p05"] == "double"
    assert set(columns.values()) == {"string", "double", "long"}
