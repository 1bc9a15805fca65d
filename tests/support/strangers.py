"""The recordings that docs/recordings.md names: one machine, written as each program writes it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.io

from tests.support.command import signals
from tests.support.recordings import DBC, WRITERS, write_scope, write_trace

PERIODS, WINDOW = 12, 100


def write_all(folder: Path) -> None:
    """Every file of the page."""
    given = signals(PERIODS * WINDOW)
    t, w, u, y = given.values()
    text_files(folder, t, w, u, y)
    write_scope(folder / "scope.csv", [(t, {"w": ("A", w), "u": ("A", u), "y": ("mm/s", y)})])
    write_trace(folder / "trace.csv", {f"PLC_PRG.{name}": (1e3 * t, given[name]) for name in "wuy"})
    for module, name in {
        "svdx": "scope.svdx", "lvm": "log.lvm", "matlab": "axis.mat", "parquet": "axis.parquet", "hdf5": "axis.h5",
        "npz": "axis.npz", "tdms": "axis.tdms", "mdf": "axis.mf4", "ulog": "flight.ulg", "blf": "drive.blf",
    }.items():  # fmt: skip
        path = folder / name
        WRITERS[module][1](path, given if module != "lvm" else {key: given[key] for key in "tuwy"})
    (folder / DBC).rename(folder / "drive.dbc")
    (folder / "bag").mkdir()
    WRITERS["mcap"][1](folder / "bag" / "bag_0.mcap", given)
    WRITERS["wav"][1](folder / "stereo.wav", {"c1": w, "c2": y})
    controldesk(folder / "controldesk.mat", t, w, u, y)


def text_files(folder: Path, t: np.ndarray, w: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
    table = np.column_stack([t, w, u, y])
    np.savetxt(folder / "table.txt", table, header="t w u y")
    np.savetxt(folder / "klipper.csv", table, delimiter=",", header="time,accel_x,accel_y,accel_z", comments="#")
    rows = "".join("\t".join(f"{x:.6f}" for x in row) + "\r\n" for row in table)
    head = "Time\tCommand\tCurrent\tVelocity\r\n(s)\t(A)\t(A)\t(mm/s)\r\n"
    (folder / "labview.txt").write_text(head + rows + "\x1a", newline="")
    lines = [f"{k},{1e6 * t[k]:.0f},{w[k]:.6f},{u[k]:.6f},{y[k]:.6f},ANGLE_MODE" for k in range(len(t))]
    head = "loopIteration,time (us),setpoint[0],motor[0],gyroADC[0],flightModeFlags (flags)"
    (folder / "blackbox.csv").write_text("\n".join([head, *lines]) + "\n")


def controldesk(path: Path, t: np.ndarray, w: np.ndarray, u: np.ndarray, y: np.ndarray) -> None:
    """A structure as dSPACE ControlDesk saves it."""
    recorded = np.zeros((1, 3), dtype=[("Name", object), ("Unit", object), ("Data", object)])
    for at, (name, values) in enumerate({"Command (A)": w, "Current (A)": u, "Speed (mm/s)": y}.items()):
        recorded[0, at] = (name, "", values[np.newaxis])
    x = np.zeros((1, 1), dtype=[("Name", object), ("Data", object)])
    x[0, 0] = ("HostService", t[np.newaxis])
    whole = np.zeros((1, 1), dtype=[("X", object), ("Y", object)])
    whole[0, 0] = (x, recorded)
    scipy.io.savemat(path, {"rec": whole})
