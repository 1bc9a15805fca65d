"""Images of a controller at a lower rate than the recording: what its sampling folds onto the lines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from livebode.core import Cascade
from livebode.core.controllers import DriveTiming
from livebode.core.model import Model

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class HeldSamples:
    """What a slower controller reads and holds.

    Attributes
    ----------
    rate_divider
        Ticks of the recording for which it holds one value.
    position
        "output": it reads the output. Else how the position is computed from the output, a velocity: its sum
        ("backward") or its trapezoidal integral.
    """

    rate_divider: int
    position: Literal["output", "backward", "trapezoidal"]

    def images(self, output: Floats, rate_hz: float, phase: int) -> Floats:
        """The held samples minus their mean over the hold, for each sample of the output.

        A response without images contains the mean over the hold of all samples. What the controller holds is one
        sample of them, read at the ticks `phase`, `phase` + `rate_divider`, …; the difference is exact.
        """
        read = output
        if self.position != "output":
            read = (np.cumsum(output) - (output / 2 if self.position == "trapezoidal" else 0.0)) / rate_hz
        many = self.rate_divider
        at = np.arange(many - 1, read.size)
        mean = np.mean([read[at - back] for back in range(many)], axis=0)
        # The first ticks of the first window have no weight.
        return np.concatenate([np.zeros(many - 1), read[at - (at - phase) % many] - mean])


@dataclass(frozen=True)
class HeldPath:
    """The way of what a slower controller holds to the plant input: u contains −response·held."""

    samples: HeldSamples
    response: Callable[[Floats], Complex]


def held_path(feedback: Model | None) -> HeldPath | None:
    """Of a feedback with one controller at a lower rate; None if all run at that of the recording, or interpolate."""
    if isinstance(feedback, Cascade):
        inner, outer = feedback.velocity, feedback.position
        if inner.rate_divider > 1 or not _holds(outer):
            return None
        samples = HeldSamples(outer.rate_divider, "backward" if feedback.velocity_differenced else "trapezoidal")
        return HeldPath(samples, lambda f: inner.response(f) * outer.before_hold(f))
    if isinstance(feedback, DriveTiming) and _holds(feedback):
        return HeldPath(HeldSamples(feedback.rate_divider, "output"), feedback.before_hold)
    return None


def _holds(controller: DriveTiming) -> bool:
    return controller.rate_divider > 1 and controller.hold == "zero-order"
