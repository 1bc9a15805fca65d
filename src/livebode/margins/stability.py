"""Stability of a closed loop from the frequency response of its open loop."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats


def stable(open_loop: Complex, frequency_hz: Floats, unstable_poles: NDArray[np.int64] | int = 0) -> NDArray[np.bool_]:
    """By Nyquist's criterion for a sampled loop, shape (rows,).

    Along the upper half of the unit circle, and around its integrators at z = 1, the angle of 1 + L turns by π times
    the closed loop's poles inside less the open loop's poles inside. As both have equally many, it ends at π times
    (the open loop's unstable poles less those of the closed loop). With ν integrators it begins at −ν·π/2.

    Parameters
    ----------
    open_loop
        L, shape (rows, frequencies), from where only its integrators matter up to half the rate, and close enough that
        1 + L turns by less than half a turn between neighbours.
    frequency_hz
        Ascending; the last is half the rate.
    unstable_poles
        Of the open loop, outside the unit circle.
    """
    size = np.log(np.abs(open_loop[:, :2]))
    integrators = np.rint(-(size[:, 1] - size[:, 0]) / np.log(frequency_hz[1] / frequency_hz[0]))
    angle = np.unwrap(np.angle(1 + open_loop), axis=1)
    begin = -integrators * np.pi / 2
    turns = np.rint((angle[:, 0] - begin) / (2 * np.pi))
    end = angle[:, -1] - 2 * np.pi * turns
    return np.asarray(np.abs(end - np.pi * unstable_poles) < np.pi / 2)
