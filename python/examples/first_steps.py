"""The remaining life of a valve, from a data frame of its stroke times."""

from __future__ import annotations

import io

import pandas as pd

import valve_prognosis as vp


def main() -> None:
    valve = vp.ValveFile.reference()
    healthy = valve.simulate()
    print(f"{valve.name}: closes in {healthy.close_time_s[0]:.4f} s, opens in {healthy.open_time_s[0]:.4f} s")

    tables = valve.build_tables(["leaks"])
    log = pd.read_csv(io.StringIO(vp.leaking_log()))
    prognoser = vp.Prognoser(tables)
    rows = prognoser.push_frame(log).to_pandas()
    print(rows.iloc[-1][["valve", "cycle", "fault", "rul_cycles", "rul_p05", "rul_p95", "status"]].to_string())

    # One more cycle, as it comes from the plant.
    next_row = prognoser.push(valve="FV-101", cycle=25, close_time_s=2.9, open_time_s=0.63)
    print(f"after cycle 25: {next_row['status']}, {next_row['rul_cycles']} cycles left")

    tables.life_figure(log).save("life.svg")


if __name__ == "__main__":
    main()
