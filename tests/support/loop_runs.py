"""Recordings of the loop around two masses, and the axis.toml that describes it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from livebode.core import Lines
from livebode.excitation import multisine
from livebode.simulation import TwoMassLoop
from livebode.simulation.two_mass_loop import RATE_HZ
from tests.support.command import write_parquet

LINES = Lines.parse("20:140:10", RATE_HZ, 400)
AXIS = """
[source]
log = "log.parquet"
rate_hz = 4000
[signals]
output = "y"
input = "u"
excitation = "w"
[lines]
frequencies = "20:140:10"
window = 400
[tracking]
hop = 200
[loop.velocity]
gain = {gain}
integral_time_s = 0.2
rate_hz = 4000
delay_ticks = {delay}
[loop.position]
gain = 1.0
rate_hz = 2000
rate_divider = 2
[fit]
model = "two-mass"
output = "velocity"
radius_m = 0.019
"""


def record(path: Path, seed: int, late: int = 0) -> Path:
    """Two seconds of the closed loop, with a gap in it; u acts `late` ticks after it was logged."""
    w = 0.3 * multisine(LINES)
    u, y = TwoMassLoop().run(w, 20, sigma=0.1, seed=seed)
    columns = {"w": np.resize(w, u.size), "u": np.roll(u[0], -late), "y": y[0]}
    columns["y"][700] = np.nan
    return write_parquet(path, columns)
