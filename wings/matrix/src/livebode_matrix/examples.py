"""The examples of matrices: recordings of a simulated gantry with two motors. The same files on every call."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from livebode.core import Lines
from livebode.excitation import MatrixExcitation
from livebode.interface import Example, table_of
from livebode.simulation import Gantry, GantryLoop
from livebode.tables import Table


def _gantry(
    seed: int, cart_m: float = 0.2, frequencies: str = "6:90:4", amplitude_n_m: float = 0.2, settle: int = 3
) -> Callable[[], Table]:
    """A gantry in closed loop, whose two motors have orthogonal multisines, with noise of the encoders."""

    def simulate() -> Table:
        lines = Lines.parse(frequencies, 4000.0, 2000)
        excitation = MatrixExcitation.orthogonal(lines, 2, amplitude=amplitude_n_m, dwell=4, settle=settle)
        w = np.tile(excitation.samples, 4)
        noise = 0.02 * np.random.default_rng(seed).standard_normal((3, w.shape[1]))
        block = GantryLoop(gantry=Gantry(cart_m=cart_m)).simulate(w, noise=noise)
        return table_of(block, ("w1", "w2", "u1", "u2", "velocity1", "velocity2"))

    return simulate


MATRIX_EXAMPLES = {
    "matrix": Example(
        "a gantry with two motors that move each other, with its cart at two places",
        {"gantry.parquet": _gantry(10, 0.2), "gantry-2.parquet": _gantry(11, 0.25)},
        ("gantry.toml", "gantry-2.toml"),
        (
            "livebode run gantry.toml",
            "livebode fit runs/gantry --entry velocity1/u1 --entry velocity2/u1 --model modal",
            "livebode run gantry-2.toml",
            "livebode compare runs/gantry runs/gantry-2",
        ),
        package="livebode_matrix",
    ),
    "matrix-tune": Example(
        "the gantry excited to beyond its resonances, with its two controllers described",
        {"gantry-tune.parquet": _gantry(12, frequencies="4:100:2, 104:400:8", amplitude_n_m=0.1, settle=1)},
        ("gantry-tune.toml",),
        (
            "livebode run gantry-tune.toml",
            "livebode validate runs/gantry-tune --loop",
            "livebode tune runs/gantry-tune --entry velocity1/u1",
        ),
        package="livebode_matrix",
    ),
}
