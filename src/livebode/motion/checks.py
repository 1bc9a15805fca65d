"""Checks of the arguments of a MotionCorrection."""

from __future__ import annotations

import numpy as np

from livebode.core import UsageError
from livebode.estimation import Settings


def check(
    settings: Settings, radius_m: float, chunk_samples: int, driven_by: str, passes: int, splines: tuple[int, int]
) -> None:
    """Raise UsageError for arguments that a correction does not support, with the value and the remedy."""
    if settings.input is None or settings.schedule is None:
        raise UsageError(
            "missing",
            "the correction needs the input (torque) and the schedule (position)",
            "name their channels",
            argument="schedule" if settings.input is not None else "input",
        )
    for name, required in (("quantity", "plant"), ("average", False), ("estimator", "joint")):
        value = getattr(settings, name)
        if value not in (required, "direct"):
            raise UsageError(
                "conflict",
                f"{name}={value!r} cannot be corrected for motion",
                f"take {required!r}, or leave out the correction ([motion])",
                argument=name,
                value=value,
                allowed=[required],
            )
    if not (np.isfinite(radius_m) and radius_m > 0):
        raise UsageError(
            "out-of-range",
            f"{radius_m=} is not a positive number of metres per radian",
            "give the radius of the pulley",
            argument="radius_m",
            value=radius_m,
        )
    _check_lengths(settings.lines.window, settings.step, chunk_samples)
    if driven_by not in ("torque", "excitation"):
        raise UsageError(
            "not-one-of",
            f"{driven_by=} is not supported",
            "choose 'torque' or 'excitation'",
            argument="driven_by",
            value=driven_by,
            allowed=["torque", "excitation"],
        )
    if passes < 1:
        raise UsageError("out-of-range", f"{passes=} is not at least 1", "3 is usual", argument="passes", value=passes)
    for name, many in zip(("stiffness_splines", "damping_splines"), splines):
        if many != 1 and many < 4:
            raise UsageError(
                "out-of-range",
                f"{name}={many} is neither 1 nor at least 4",
                "take 1 for a constant, or 4 or more",
                argument=name,
                value=many,
            )


def _check_lengths(window: int, hop: int, chunk_samples: int) -> None:
    if chunk_samples < 2 * window:
        raise UsageError(
            "out-of-range",
            f"{chunk_samples=} is less than two windows of {window}",
            "take a stroke",
            argument="chunk_samples",
            value=chunk_samples,
            window=window,
        )
    if hop > window:
        raise UsageError(
            "out-of-range",
            f"{hop=} is longer than the window of {window}, but a correction must follow the motion",
            "take a shorter hop",
            argument="hop",
            value=hop,
            window=window,
        )
