"""Matrix responses for examples."""

from __future__ import annotations

import numpy as np

from livebode.core import Lines, MatrixResponses
from livebode.excitation import MatrixExcitation
from livebode.simulation import GantryLoop
from livebode_matrix.settings import MatrixSettings
from livebode_matrix.tracker import MatrixTracker


def example_matrix_responses() -> MatrixResponses:
    """The newest three matrices of a simulated gantry in closed loop, from its two torques to the speeds of its motors.

    >>> example_matrix_responses()
    <MatrixResponses: 3 rows, 7 lines, 2 outputs × 2 inputs>
    """
    lines = Lines.parse("10:40:5", rate_hz=4000, window=800)
    excitation = MatrixExcitation.orthogonal(lines, 2, 0.5, dwell=3, settle=2)
    w = np.tile(excitation.samples, 8)
    noise = 0.05 * np.random.default_rng(0).standard_normal((3, w.shape[1]))
    settings = MatrixSettings(
        lines=lines,
        output=["velocity1", "velocity2"],
        input=["u1", "u2"],
        excitation=["w1", "w2"],
        dwell=excitation.dwell,
        settle=excitation.settle,
        hop=800,
    )
    return MatrixTracker(settings).process(GantryLoop().simulate(w, noise=noise))[-3:]
