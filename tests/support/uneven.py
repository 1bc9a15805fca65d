"""Recordings whose channels are sampled at times of their own: two masses in closed loop, computed at 4 kHz."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import asammdf
import numpy as np

from livebode import Lines, multisine
from livebode.simulation import TwoMassLoop
from livebode.simulation.two_mass_loop import RATE_HZ
from tests.support.ulog_file import ulog_file

LINES = Lines.parse("20:110:10", RATE_HZ, 400)
RATES_HZ = {"w": 1000.0, "u": 400.0, "y": 250.0}
UNITS = {"w": "N m", "u": "N m", "y": "rad/s"}
NOISE, PERIODS = 0.05, 40
Stamped = Mapping[str, tuple[np.ndarray, np.ndarray]]
"""Times in seconds and samples of each channel."""


def stamped(*, same: bool = False, jitter: float = 0.45, seed: int = 1) -> Stamped:
    """w, u and y at clocks of their own, or all at that of w; no sample is more than `jitter` steps from its place."""
    rng = np.random.default_rng(seed)
    period = multisine(LINES)
    period *= 0.5 / np.std(period)
    u, y = TwoMassLoop().run(period, PERIODS, NOISE, seed=seed)
    signals = {"w": np.tile(period, PERIODS), "u": u[0], "y": y[0]}
    one = ticks(RATES_HZ["w"], jitter, u.size, rng)
    clocks = {name: one if same else ticks(rate, jitter, u.size, rng) for name, rate in RATES_HZ.items()}
    return {name: (at / RATE_HZ, signals[name][at]) for name, at in clocks.items()}


def ticks(rate_hz: float, jitter: float, count: int, rng: np.random.Generator) -> np.ndarray:
    step = RATE_HZ / rate_hz
    places = np.arange(step / 2, count - step / 2, step)
    return np.unique(np.clip(np.rint(places + rng.uniform(-jitter, jitter, places.size) * step), 0, count - 1)).astype(
        int
    )


def write_csv(path: Path, channels: Stamped) -> Path:
    """All channels are at the times of w."""
    rows = np.column_stack([channels["w"][0], *(values for _, values in channels.values())])
    np.savetxt(path, rows, "%.17g", ",", header="time [s],w [N m],u [N m],y [rad/s]", comments="")
    return path


def write_ulog(path: Path, channels: Stamped) -> Path:
    topics = {
        f"topic_{name}": {"timestamp": np.rint(1e6 * (time + 20)).astype(np.uint64), name: values}
        for name, (time, values) in channels.items()
    }
    path.write_bytes(ulog_file(topics))
    return path


def write_mdf(path: Path, channels: Stamped) -> Path:
    with asammdf.MDF(version="4.10") as file:
        for name, (time, values) in channels.items():
            file.append([asammdf.Signal(values, time, name=name, unit=UNITS.get(name, ""))])
        file.save(path, overwrite=True)
    return path
