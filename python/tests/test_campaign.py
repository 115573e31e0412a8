"""Answers about recorded strokes against the program's."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import valve_prognosis as vp

FILES = ("data/sticking-valve/valve.toml", "data/sticking-valve/campaign.toml")


@pytest.fixture(scope="module")
def campaign(sticking: Path) -> vp.Campaign:
    # The name is what documents call the file, as the program is given it.
    valve = vp.ValveFile.parse((sticking / "valve.toml").read_text(), FILES[0])
    return vp.Campaign.read(valve, sticking / "campaign.toml")


def test_a_comparison_is_the_programs(json_of: Callable[..., Any], campaign: vp.Campaign, tmp_path: Path) -> None:
    answer = campaign.compare(residual_force=True)
    told = json_of("compare", *FILES, "--residual-force", "--plot", tmp_path / "strokes.svg")
    assert answer.document == told
    assert answer.figures["strokes"].svg == (tmp_path / "strokes.svg").read_text()
    assert set(answer.figures) == {"strokes", "strips", "missing_force"}
    assert answer["overall"] == told["overall"]


def test_a_calibration_is_the_programs_and_gives_nothing_that_strayed(
    json_of: Callable[..., Any], campaign: vp.Campaign
) -> None:
    answer = campaign.calibrate()
    told = json_of("calibrate", *FILES)
    assert told.pop("out") is None
    assert answer.document == told
    assert answer.valve is None, "its values would only stand in for what is missing"
    assert "missing" in answer.headline


def test_what_is_missing_is_found_and_adopted_as_by_the_program(
    json_of: Callable[..., Any], campaign: vp.Campaign, tmp_path: Path
) -> None:
    answer = campaign.explain()
    assert answer.document == json_of("explain", *FILES, "--plot", tmp_path / "found.svg")
    assert answer.figures["candidates"].svg == (tmp_path / "found.svg").read_text()
    assert "dry-friction" in answer.headline
    assert answer.headline in answer._repr_html_()
    adopted = campaign.adopt(["dry-friction"])
    told = json_of("adopt", *FILES, "--effect", "dry-friction", "--out", tmp_path / "better.toml")
    assert {**adopted.document, "end_of_life": None, "out": str(tmp_path / "better.toml")} == told
    assert adopted.valve is not None
    assert adopted.valve.text == (tmp_path / "better.toml").read_text()


def test_a_campaign_of_data_frames_is_that_of_the_files(campaign: vp.Campaign, sticking: Path, tmp_path: Path) -> None:
    def frame(place: int) -> pd.DataFrame:
        return pd.read_csv(sticking / "traces" / f"run-{place}.csv")

    conditions = [{"supply_pressure": f"{psi} psig", "temperature": "20 degC"} for psi in [60, 70, 80, 90]]
    runs = [(frame(place), one) for place, one in enumerate(conditions, start=1)]
    framed = vp.campaign_from_frames(
        campaign.valve, runs, name="sticking valve", sensors={"position_noise": "0.03 mm"}, folder=tmp_path
    )
    document, told = framed.compare().document, campaign.compare().document
    for run in document["runs"] + told["runs"]:
        run.pop("file")
    for nuisance in document["nuisances"] + told["nuisances"]:
        nuisance.pop("run")
    assert document == told
    assert (tmp_path / "campaign.toml").exists()


def test_refusals_say_what_was_found(campaign: vp.Campaign, tmp_path: Path) -> None:
    with pytest.raises(vp.ValveError, match="hint: did you mean dry-friction"):
        campaign.adopt(["dry-frction"])
    with pytest.raises(vp.ValveError, match="suply_pressure"):
        vp.campaign_from_frames(campaign.valve, [({"time_s": [0.0]}, {"suply_pressure": "75 psig"})])
    with pytest.raises(vp.ValveError, match="nothing.toml"):
        vp.Campaign.read(campaign.valve, tmp_path / "nothing.toml")


def test_an_evaluation_is_the_programs(json_of: Callable[..., Any], reference: vp.ValveFile) -> None:
    answer = vp.evaluate(reference, seeds=3, noise_variance_s2=[0.0, 1e-3])
    told = json_of("evaluate", "models/testbed.toml", "--seeds", 3, "--noise-variance", "0,1e-3")
    assert answer.document == told
    with pytest.raises(vp.ValveError, match="seeds above 0"):
        vp.evaluate(reference, seeds=0)
