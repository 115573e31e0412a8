"""Physics-based simulation, identification and prognosis of pneumatic valves from their stroke times.

    import pandas as pd
    import valve_prognosis as vp

    tables = vp.ValveFile.reference().build_tables()
    rows = vp.Prognoser(tables).push_frame(pd.read_csv("log.csv")).to_pandas()

Everything is SI, absolute pressures, with the unit in each name; only leak areas of a prognosis are in mm2, as in the
program's output. Results are those of the ``valve`` program, bit for bit.
"""

from importlib.metadata import version as _version

from valve_prognosis._native import (
    Answer,
    Campaign,
    Figure,
    Prognoser,
    Rows,
    Simulation,
    Strokes,
    Tables,
    ValveError,
    ValveFile,
    evaluate,
    leaking_log,
)
from valve_prognosis.recordings import campaign_from_frames

__all__ = [
    "Answer",
    "Campaign",
    "Figure",
    "Prognoser",
    "Rows",
    "Simulation",
    "Strokes",
    "Tables",
    "ValveError",
    "ValveFile",
    "campaign_from_frames",
    "evaluate",
    "leaking_log",
]

__version__ = _version("valve-prognosis")
