"""The controllers and filters that a person tries on the page, from the text that the page has in its address."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.core import Algebra, Model, UsageError
from livebode_control.tuning.feedback_parts import FeedbackParts
from livebode_control.tuning.filters import Biquad, low_pass, notch

_NOTCHES_MAX = 4
_SIZE = (1e-12, 1e12)  # of a gain or a time
_DEPTH_DB_MAX = 200.0
_DAMPING = (1e-6, 1e3)
_DELAY_MS_MAX = 10_000.0


@dataclass(frozen=True)
class TrialFeedback(Algebra):
    """F with other parameters, filters in series and a delay.

    Attributes
    ----------
    controller
        The described one.
    values
        Parameters of FeedbackParts that differ from the described ones.
    filters
        In series with it.
    delay_s
        Additional delay.
    """

    controller: Model
    values: Mapping[str, float]
    filters: tuple[Biquad, ...] = ()
    delay_s: float = 0.0

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        f = np.asarray(frequency_hz, dtype=np.float64)
        found = FeedbackParts.of(self.controller, f).response(self.values)
        for one in self.filters:
            found = found * one.response(f)
        return np.asarray(found * np.exp(-2j * np.pi * f * self.delay_s))


def trial_feedback(text: str, controller: Model, rate_hz: float) -> TrialFeedback:
    """From "gain~0.4~~notch~60~20~0.3~~low-pass~300~~delay~0.5"; the notch has Hz, dB and damping, the delay is in ms.

    Raises
    ------
    UsageError
        If the text is not a trial, or a value is out of its range.

    Examples
    --------
    >>> from livebode import PID
    >>> found = trial_feedback("gain~0.4~~delay~0.5", PID(gain=0.2, rate_hz=4000), 4000)
    >>> found.values, found.delay_s
    ({'gain': 0.4}, 0.0005)
    """
    known = FeedbackParts.of(controller, np.array([rate_hz / 8])).values
    values: dict[str, float] = {}
    notches: list[Biquad] = []
    low_passes: list[Biquad] = []
    delay_ms = 0.0
    for part in filter(None, text.split("~~")):
        name, *words = part.split("~")
        numbers = [_number(word, part) for word in words]
        if name == "notch" and len(numbers) == 3 and len(notches) < _NOTCHES_MAX:
            hz, depth_db, damping = numbers
            _check(part, abs(depth_db) <= _DEPTH_DB_MAX and _DAMPING[0] <= damping <= _DAMPING[1] and hz > 0)
            notches.append(notch(hz, depth_db, damping, rate_hz))
        elif name == "low-pass" and len(numbers) == 1 and not low_passes:
            _check(part, numbers[0] > 0)
            low_passes.append(low_pass(numbers[0], rate_hz))
        elif name == "delay" and len(numbers) == 1:
            _check(part, 0 <= numbers[0] <= _DELAY_MS_MAX)
            delay_ms = numbers[0]
        else:
            _check(part, name in known and len(numbers) == 1 and _SIZE[0] <= abs(numbers[0]) <= _SIZE[1])
            values[name] = numbers[0]
    return TrialFeedback(controller, values, (*notches, *low_passes), delay_ms / 1000)


def _number(word: str, part: str) -> float:
    try:
        return float(word[:40])
    except ValueError:
        raise _not_a_trial(part) from None


def _check(part: str, good: bool) -> None:
    if not good:
        raise _not_a_trial(part)


def _not_a_trial(part: str) -> UsageError:
    return UsageError(
        "unreadable",
        f"trial={part[:60]!r} is not a gain, time or filter of this loop within its range",
        "reset the sliders, or reload the page",
        argument="trial",
        value=part[:60],
    )
