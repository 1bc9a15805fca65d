"""Images of a controller at a lower rate than the recording: what its sampling folds onto the lines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import Cascade, DriveTiming, Model
from livebode.dataclass import dataclass


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
        index = np.arange(many - 1, read.size)
        total = np.cumsum(np.concatenate([[0.0], read - read.mean()]))
        mean = (total[index + 1] - total[index + 1 - many]) / many + read.mean()
        # The first ticks of the first window have no weight.
        return np.concatenate([np.zeros(many - 1), read[index - (index - phase) % many] - mean])


@dataclass(frozen=True)
class HeldPath:
    """The way of what a slower controller holds to the plant input: u contains −response·held."""

    samples: HeldSamples
    response: Callable[[Floats], Complex]


def held_paths(feedback: Model | None) -> tuple[HeldPath, ...]:
    """Held paths of a feedback with controllers at lower rates; none if all run at the rate of the recording.

    A position controller whose ticks are not among those of its velocity controller has no path here.
    """
    if isinstance(feedback, DriveTiming):
        return (HeldPath(HeldSamples(feedback.rate_divider, "output"), feedback.before_hold),) * _holds(feedback)
    if not isinstance(feedback, Cascade):
        return ()
    inner, outer = feedback.velocity, feedback.position
    paths = held_paths(inner)
    if feedback.in_step and outer.rate_divider > 1:
        divider = outer.rate_divider
    elif _holds(inner) and not _holds(outer):
        divider = inner.rate_divider
    else:
        return paths
    samples = HeldSamples(divider, "backward" if feedback.velocity_differenced else "trapezoidal")
    return (*paths, HeldPath(samples, lambda f: inner.before_hold(f) * outer.before_hold(f)))


def _holds(controller: DriveTiming) -> bool:
    return controller.rate_divider > 1 and controller.hold == "zero-order"
