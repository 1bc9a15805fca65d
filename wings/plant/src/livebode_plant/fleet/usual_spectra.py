"""UsualSpectra: the usual messages of a drive that sends spectra, tracked with those of other axes that are alike."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from livebode.core import Responses
from livebode.estimation import NewestSpectra, SpectraTracker
from livebode.runtime import SingleResponse
from livebode.sources.live import LiveBlock, NextSpectrum, Sequencer, SourceEvents, read_rows


class PendingSpectrum(NamedTuple):
    """A message with one whole spectrum that follows the one before it, taken but not read.

    Its place in the log and the log's time, the sender's number of its first sample and ours, and the sample and time
    after it.
    """

    message: bytes
    position: int
    log_s: float
    first_sample: int
    number: int
    end: tuple[int, float]


class UsualSpectra(NamedTuple):
    """How the usual messages of an axis are recognised, and what tracks them.

    It is valid until another message is taken. `size_bytes` is the most that one adds to a message of results. Axes
    with an equal `kind` are tracked together. `results_only`: nothing is fitted to the responses and nothing monitors
    them.
    """

    next: NextSpectrum
    tracker: SpectraTracker
    size_bytes: int
    kind: tuple[object, float, bool, bool]
    results_only: bool

    @classmethod
    def after(
        cls,
        message: bytes,
        blocks: Sequence[LiveBlock],
        size_bytes: int,
        sequencer: Sequencer,
        pipeline: SingleResponse,
    ) -> UsualSpectra | None:
        """Those that follow this message, if the sequencer returned these Blocks for it; None if it was not usual."""
        tracker, layout = pipeline.follower, sequencer.schema.spectra
        if layout is None or len(blocks) != 1 or len(blocks[0]) != 1 or not sequencer.is_idle:
            return None
        if not isinstance(tracker, SpectraTracker) or tracker.kind is None or pipeline.readiness is not None:
            return None
        following, own = NextSpectrum(message, layout), blocks[0].origin
        found = following.found(message)
        if own is None or found is None or found.first_sample != blocks[0].start + own.offset:
            return None
        unused = pipeline.fits is None and (pipeline.detection is None or pipeline.detection.baseline is None)
        kind = tracker.kind, following.rate_hz, following.double, unused
        return cls(following, tracker, size_bytes, kind, unused)

    def spectrum(
        self, message: bytes, position: int, log_s: float, sequencer: Sequencer, events: SourceEvents
    ) -> PendingSpectrum | None:
        """What is in a usual message, which the sequencer then has; None for another one, and nothing has changed."""
        about = self.next
        found = about.found(message)
        if found is None:
            return None
        first, stamp_s = found
        number = sequencer.passed(first, about.layout.hop, about.rate_hz, stamp_s, log_s)
        return None if number is None else PendingSpectrum(message, position, log_s, first, number, events.position)


def spectra_together(pending: Sequence[tuple[UsualSpectra, PendingSpectrum]]) -> tuple[Responses | None, list[bool]]:
    """Responses of spectra of one kind from different axes, and which of them have one: see
    `SpectraTracker.process_each`."""
    about = pending[0][0].next
    layout, double = about.layout, about.double
    payload = b"".join([spectrum.message[usual.next.payload] for usual, spectrum in pending])
    sums, values, _ = read_rows(payload, layout, double=double)
    number = np.array([spectrum.number for _, spectrum in pending], dtype=np.int64)
    place = (np.array([spectrum.first_sample for _, spectrum in pending]) + layout.hop) % layout.window
    spectra = NewestSpectra(sums, values, number, place, layout.channels, about.rate_hz)
    responses, taken = SpectraTracker.process_each([usual.tracker for usual, _ in pending], spectra)
    return responses, taken.tolist()
