"""Writes early.h5 and late.h5 beside itself with h5py: HDF5 as other programs have it. python3 hdf5.py"""

from pathlib import Path

import h5py
import numpy as np

HERE = Path(__file__).parent
ROWS = np.arange(40)

for name, version in [("early.h5", "earliest"), ("late.h5", "v110")]:
    with h5py.File(HERE / name, "w", libver=(version, "v110")) as file:
        file.create_dataset("time_s", data=ROWS / 8)
        way = file.create_dataset("Weg", data=(ROWS / 4).astype("<f4"), chunks=(16,), compression="gzip", shuffle=True)
        way.attrs["units"] = "mm"
        file.create_dataset("counts", data=(-ROWS).astype(">i2"))
        file.create_dataset("on", data=ROWS > 20)
        file.create_dataset("note", data="a word")
        file.create_group("rec").create_dataset("x", data=(ROWS * ROWS).astype("u4"), chunks=(40,), compression="gzip")
