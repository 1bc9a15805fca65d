"""Evidence: score and information of a change of the machine, from a stretch of windows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import RowArrays
from livebode.dataclass import dataclass

JUDGED, UNEVEN, SLOW, FAST, PLACE, DISTURBED = "judged", "uneven", "slow", "fast", "place", "disturbed"
COVARIATE, NO_COVARIATE, UNEXCITED, AMPLITUDE = "covariate", "no covariate", "unexcited", "amplitude"
"""Why a window is not judged: accelerating or settling, slower, faster or elsewhere than learned, or disturbed; a
covariate is outside of the learned range, or has no value; no torque at the lines, or more than learned at a speed at
which it may reverse the motion."""
OFFSET = "offset"
"""Why changes along the direction between runs are not judged: this run's own offset is not known well enough."""


@dataclass(frozen=True, eq=False)
class Evidence(RowArrays):
    """Score and information of a change in each direction, of windows that do not overlap.

    To second order the log-likelihood of a window under the change δ is δ·score − δ·information·δ/2.

    Attributes
    ----------
    score, information
        Shapes (rows, directions), (rows, directions, directions).
    power, quiet_power
        |E|² of the residual of the model, at the lines and at the detection lines, (rows, bins).
    position_m, speed_m_per_s, time_s
        Of the window's centre; speed over the window, negative in the return direction.
    sample
        Newest sample of the window.
    status
        "judged", or why not.
    late_score, late_information
        Of the velocity's delay, s, which is learned and then fixed: (rows,), and with each direction and itself,
        (rows, directions + 1).
    ripple_score, ripple_information
        ⟨ψ, e⟩ and ⟨ψ, ψ⟩ of cosine and sine of each order of the ripple at 1 N m, (rows, 2·orders),
        (rows, 2·orders, 2·orders). Score and information above are with the ripple allowed for.
    ripple_gain
        Power of an order of 1 N m at the lines, (rows, orders, lines).
    covariate
        Mean of each covariate over the window, NaN where it has no value, (rows, covariates).
    amplitude
        Root mean square of the torque at each line, (rows, lines).
    swing
        Root mean square of the velocity at all lines, relative to the speed, (rows,).
    """

    score: Floats
    information: Floats
    power: Floats
    quiet_power: Floats
    position_m: Floats
    speed_m_per_s: Floats
    time_s: Floats
    sample: NDArray[np.int64]
    status: NDArray[np.str_]
    late_score: Floats
    late_information: Floats
    ripple_score: Floats
    ripple_information: Floats
    ripple_gain: Floats
    covariate: Floats
    amplitude: Floats
    swing: Floats

    @property
    def judged(self) -> NDArray[np.bool_]:
        return np.asarray(self.status == JUDGED)
