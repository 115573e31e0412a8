"""From recordings in data frames to the effect that the model lacks, and the valve file that has it."""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd

import valve_prognosis as vp


def main(folder: Path) -> None:
    valve = vp.ValveFile.read(folder / "valve.toml")
    pressures = {1: "60 psig", 2: "70 psig", 3: "80 psig", 4: "90 psig"}
    runs = [
        (pd.read_csv(folder / "traces" / f"run-{place}.csv"), {"supply_pressure": pressure, "temperature": "20 degC"})
        for place, pressure in pressures.items()
    ]
    campaign = vp.campaign_from_frames(valve, runs, name="sticking valve", sensors={"position_noise": "0.03 mm"})
    print(campaign.compare().headline)
    answer = campaign.explain()
    print(answer.headline)
    answer.figures["candidates"].save("candidates.svg")
    adopted = campaign.adopt(answer["recommended"])
    print(adopted.headline)
    if adopted.valve is not None:
        adopted.valve.write("better.toml")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "data/sticking-valve"))
