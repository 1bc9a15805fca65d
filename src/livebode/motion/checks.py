"""What a MotionCorrection cannot be made of."""

from __future__ import annotations

import numpy as np

from livebode.core import InputError
from livebode.estimation import Settings


def check(
    settings: Settings, radius_m: float, chunk_samples: int, driven_by: str, passes: int, splines: tuple[int, int]
) -> None:
    """InputError where a correction cannot be made of these, with the value and the remedy."""
    if settings.input is None or settings.schedule is None:
        raise InputError("the correction needs the input (torque) and the schedule (position); name their channels")
    for name, wanted in (("quantity", "plant"), ("average", False), ("estimator", "joint")):
        value = getattr(settings, name)
        if value not in (wanted, "direct"):
            raise InputError(f"{name}={value!r} cannot be corrected for motion; take {wanted!r}, or leave out [motion]")
    if not (np.isfinite(radius_m) and radius_m > 0):
        raise InputError(f"{radius_m=} is not a positive number of metres per radian")
    _check_lengths(settings.lines.window, settings.step, chunk_samples)
    if driven_by not in ("torque", "excitation"):
        raise InputError(f"{driven_by=} is not known; choose 'torque' or 'excitation'")
    if passes < 1:
        raise InputError(f"{passes=} is not at least 1; 3 is usual")
    for name, many in zip(("stiffness_splines", "damping_splines"), splines):
        if many != 1 and many < 4:
            raise InputError(f"{name}={many} is neither 1 nor at least 4")


def _check_lengths(window: int, hop: int, chunk_samples: int) -> None:
    if chunk_samples < 2 * window:
        raise InputError(f"{chunk_samples=} is less than two windows of {window}; take a stroke")
    if hop > window:
        raise InputError(f"{hop=} is longer than the window of {window}; a correction follows the motion, so take less")
