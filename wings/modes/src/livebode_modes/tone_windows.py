"""ToneWindows: no modes in the windows that share samples with a moving tone."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from livebode.core import Event
from livebode.language import Message
from livebode_modes.mode_tracker import WindowModes

TONE = "moving tone"
"""Status of a window without modes because a tone moves in it."""
_SHARED_MIN = 0.25  # of the hops of a window that may belong to a tone before its modes are doubtful


class ToneWindows:
    """Delays the windows until it is known whether a tone follows, and removes the modes of those beside one.

    A window in which a tone begins has poles of the tone, but is too little filled with it to show its line.

    Parameters
    ----------
    hops
        Hops in a window.
    """

    def __init__(self, hops: int) -> None:
        self._reach = round((1 - _SHARED_MIN) * hops)
        self._waiting: deque[WindowModes] = deque()
        self._after = self._reach
        self._first: WindowModes | None = None
        self._last: WindowModes | None = None
        self._range_hz = (float("inf"), float("-inf"))

    def process(self, window: WindowModes) -> list[WindowModes]:
        """The windows that are complete, at most one."""
        self._after += 1
        if window.tone is not None:
            self._after = 0
            self._first, self._last = self._first or window, window
            ends = sorted((window.tone.from_hz, window.tone.to_hz))
            self._range_hz = min(self._range_hz[0], ends[0]), max(self._range_hz[1], ends[1])
            self._waiting = deque(map(_without_modes, self._waiting))
        self._waiting.append(_without_modes(window) if self._after < self._reach else window)
        return [self._waiting.popleft()] if len(self._waiting) > self._reach else []

    def finish(self) -> list[WindowModes]:
        """The remaining windows."""
        remaining = list(self._waiting)
        self._waiting.clear()
        return remaining

    @property
    def tones(self) -> list[dict[str, float]]:
        """Begin, end and frequencies of the tone, if there was one."""
        if self._first is None or self._last is None:
            return []
        low_hz, high_hz = self._range_hz
        times = {"begin_s": self._first.time_s, "end_s": self._last.time_s}
        return [times | {"low_hz": low_hz, "high_hz": high_hz, "sample": self._last.sample}]


def tone_event(tone: Mapping[str, Any]) -> Event:
    """The sentence about a tone."""
    words = Message(
        "from {begin_s:.4g} s to {end_s:.4g} s a tone moves between {low_hz:.3g} and {high_hz:.3g} Hz: a sweep or a "
        "rotation whose speed changes, not a mode; windows with it have no modes; measure the response to a sweep with "
        "its signal as input and the estimator lpm, or choose a part of the recording without it",
        **{key: tone[key] for key in ("begin_s", "end_s", "low_hz", "high_hz")},
    )
    return Event("moving-tone", int(tone["sample"]), tone["end_s"], words)


def _without_modes(window: WindowModes) -> WindowModes:
    return window if window.status == "gaps" else replace(window, modes=(), harmonics=(), status=TONE)
