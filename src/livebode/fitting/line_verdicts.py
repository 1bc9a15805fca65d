"""Lines that are invalid in a mean, because a reason found later outweighs their valid time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.core import Responses

_FIRST_VERDICT = 3  # windows that may be valid before the first verdict: three periods, of which two are complete


class LineVerdicts:
    """At each line the newest known distortion, and whether its invalid time outweighs its valid time."""

    def __init__(self, window: int, lines: int) -> None:
        self._window, self._stop = window, 0
        self.distortion = np.full(lines, np.nan)
        self._valid, self._against = np.zeros(lines), np.zeros(lines)  # in samples

    def add(self, used: NDArray[np.bool_], part: Responses) -> None:
        """Process the next responses, with their valid lines, (rows, lines)."""
        if not len(part):
            return
        against = np.isinf(part.distortion)
        step = np.diff(part.sample + 1, prepend=self._stop or int(part.sample[0]) + 1 - self._window)
        step, self._stop = np.minimum(step, self._window), int(part.sample[-1]) + 1
        self._valid += step @ used
        self._against += step @ against
        known = against | (used & ~np.isnan(part.distortion))
        newest = len(known) - 1 - np.argmax(known[::-1], axis=0)
        of_part = np.take_along_axis(part.distortion, newest[np.newaxis], 0)[0]
        self.distortion = np.where(known.any(axis=0), of_part, self.distortion)

    @property
    def against(self) -> NDArray[np.bool_]:
        """Lines that are invalid in a mean, (lines,)."""
        late = self._valid <= self._against + _FIRST_VERDICT * self._window
        return np.asarray(np.isinf(self.distortion) & late)
