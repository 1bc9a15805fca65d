"""What axes of one process compute together: one call for several costs little more than for one.

No result depends on which axes are joined, to the bit.
"""

from __future__ import annotations

import logging
from collections.abc import Generator, Sequence

import numpy as np

from livebode.core import Responses
from livebode.dataclass import dataclass
from livebode.estimation import NewestSpectra, SpectraTracker

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class WaitingSpectra:
    """The next spectra of an axis as those of `NewestSpectra`, and its tracker, whose `kind` is not None."""

    tracker: SpectraTracker
    spectra: NewestSpectra

    @property
    def kind(self) -> object:
        return self.tracker.kind, self.spectra.channels, self.spectra.rate_hz


Steps = Generator[bool | WaitingSpectra, Responses | None, None]
"""Steps of a run: whether the next one is due, or the spectra with whose responses, or with None, it continues."""


def track_together(waiting: Sequence[WaitingSpectra]) -> list[Responses | None]:
    """The responses of each; None where nothing has changed, as it is to be tracked alone.

    That is an axis that is alone of its kind, or whose first spectrum `SpectraTracker.process_each` does not take.
    Where it does not take a later one, the responses are those before it.
    """
    found: list[Responses | None] = [None] * len(waiting)
    alike: dict[object, list[int]] = {}
    for i, one in enumerate(waiting):
        alike.setdefault(one.kind, []).append(i)
    for members in alike.values():
        if len(members) > 1:
            _track(waiting, members, found)
    return found


def _track(waiting: Sequence[WaitingSpectra], members: list[int], found: list[Responses | None]) -> None:
    """The first spectrum of each, then the second one."""
    batches: list[Responses] = []
    rows: dict[int, list[int]] = {}
    row = taken = 0
    while members:
        try:
            trackers = [waiting[i].tracker for i in members]
            responses, which = SpectraTracker.process_each(trackers, _nth(waiting, members, row))
        except Exception:  # which of them it is shows only alone
            _logger.exception("internal error while %d axes are tracked together", len(members))
            break
        if responses is None:
            break
        batches.append(responses)
        members = [i for i, is_taken in zip(members, which.tolist()) if is_taken]
        for i in members:
            rows.setdefault(i, []).append(taken)
            taken += 1
        row += 1
        members = [i for i in members if row < len(waiting[i].spectra.start)]
    if batches:
        every = batches[0] if row == 1 else Responses.join(batches)
        for i, own in rows.items():
            found[i] = every[own[0] : own[0] + 1] if len(own) == 1 else every[np.array(own)]


def _nth(waiting: Sequence[WaitingSpectra], members: list[int], row: int) -> NewestSpectra:
    """The spectrum in this row of each."""
    spectra = [waiting[i].spectra for i in members]
    return NewestSpectra(
        np.concatenate([one.sums[:, row : row + 1] for one in spectra], axis=1),
        np.concatenate([one.values[:, row : row + 1] for one in spectra], axis=1),
        np.array([one.start[row] for one in spectra]),
        np.array([one.place[row] for one in spectra]),
        spectra[0].channels,
        spectra[0].rate_hz,
    )
