"""A tracker for each of several recordings that follow each other in one run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Integers
from livebode.core import Block, Emit, Responses, Stage, StatefulBase, ignore
from livebode.estimation.tracker import Tracker


class SuccessiveTrackers(StatefulBase):
    """Follower of several recordings, each with a Tracker of its own, so that none continues the one before it.

    Parameters
    ----------
    trackers
        One for each recording, all with the same settings.
    starts
        Number of the first sample of each recording, ascending.
    """

    _stage = Stage("successive-trackers", 1)
    _STATE = ("_now",)

    def __init__(self, trackers: Sequence[Tracker], starts: Sequence[int]) -> None:
        self.settings = trackers[0].settings
        self._trackers, self._starts, self._now = list(trackers), list(starts), 0

    def _state(self) -> dict[str, Any]:
        return super()._state() | {str(i): tracker for i, tracker in enumerate(self._trackers)}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        for i, tracker in enumerate(self._trackers):
            tracker.restore(state[str(i)])

    @property
    def _begun(self) -> list[Tracker]:
        return self._trackers[: self._now + 1]

    @property
    def counts(self) -> dict[str, int]:
        """Sums over the recordings."""
        each = [tracker.counts for tracker in self._begun]
        return {name: sum(counts[name] for counts in each) for name in each[0]}

    def found(self) -> dict[str, Any]:
        """Results of the newest recording, with the lines that are invalid in any of them."""
        each = [tracker.found() for tracker in self._begun]
        reasons: dict[str, set[float]] = {}
        for result in each:
            for kind, frequency_hz in result["judged"].get("invalid_lines_hz", {}).items():
                reasons.setdefault(kind, set()).update(frequency_hz)
        judged = each[-1]["judged"] | {"invalid_lines_hz": {kind: sorted(f) for kind, f in reasons.items()}}
        return each[-1] | {"judged": judged}

    def process(self, block: Block, emit: Emit = ignore, /) -> Responses:
        """Responses at the hops of this Block, which is in one recording."""
        while self._now + 1 < len(self._starts) and block.start >= self._starts[self._now + 1]:
            self._trackers[self._now + 1].continue_levels(self._trackers[self._now])
            self._now += 1
        return self._trackers[self._now].process(block, emit)

    def set_aside(self, spans: Integers, /) -> None:
        """See `Tracker.set_aside`."""
        for tracker in self._trackers:
            tracker.set_aside(spans)

    def finish(self, emit: Emit = ignore, /) -> Responses | None:
        """An empty batch, None where no samples came; reports the distortion in all recordings."""
        return self._trackers[self._now].finish(emit)

    def excitation_power(self) -> NDArray[np.float64]:
        """Mean over the recordings of `Tracker.excitation_power`."""
        return np.asarray(np.mean([tracker.excitation_power() for tracker in self._begun], axis=0))

    def repeatability(self) -> NDArray[np.float64]:
        """The least of the recordings' `Tracker.repeatability`."""
        return np.asarray(np.fmin.reduce([tracker.repeatability() for tracker in self._begun]))
