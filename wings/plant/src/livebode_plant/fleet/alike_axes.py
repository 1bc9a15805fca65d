"""Axes of a partition that are alike: what they have in common is computed once, and none depends on another.

A call for one axis costs nearly what it costs for many (`python -m bench.axes`, `bench.fits`, `bench.fleet_fits`): so
spectra, fits, derived quantities and margins of a partition are one computation, where a run has only its own.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.core import Event, Parameters, Responses
from livebode.dataclass import dataclass
from livebode.estimation import NewestSpectra, SpectraTracker
from livebode.fitting import fit_each
from livebode.runtime import Fits, SingleResponse
from livebode.sources.live import LiveBlock, NextSpectrum, Sequencer, SourceEvents, read_rows

if TYPE_CHECKING:
    from livebode_plant.fleet.axis_stream import AxisStream

NO_ROWS = np.zeros(0, dtype=np.int64)
_logger = logging.getLogger(f"livebode.{__name__}")


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
        """Spectra that follow this message, if the sequencer returned these Blocks for it; None if it was not usual."""
        tracker, layout = pipeline.follower, sequencer.schema.spectra
        if layout is None or len(blocks) != 1 or len(blocks[0]) != 1 or not sequencer.is_idle:
            return None
        if any(channel.factor != 1 for channel in layout.channels):
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


Fitted = tuple[tuple[Parameters, ...], list[Event]]


def process_together(fits: Sequence[Fits], batches: Sequence[Responses]) -> list[Fitted | Exception]:
    """Result of `Fits.process` of each axis for its new responses, bit for bit; axes that are alike share the work.

    Of an axis whose fit raises, the error instead; it disturbs no other axis.

    A process with many axes should collect their responses: derived quantities and margins of one row cost nearly what
    they cost for sixteen (`python -m bench.fits`).
    """
    fitters = [one.fitter(batch.unit) for one, batch in zip(fits, batches)]
    events: list[list[Event]] = [[] for _ in fits]
    found, errors = fit_each(fitters, batches, [of_axis.append for of_axis in events])
    alike: dict[object, list[int]] = {}
    for i, parameters in found.items():
        fits[i].take(parameters, batches[i])
        alike.setdefault((fitters[i].identity, fits[i].loop, batches[i].lines, batches[i].unit), []).append(i)
    around: dict[int, tuple[Parameters, ...]] = {}
    for members in alike.values():
        of = [(fits[i], found[i], batches[i]) for i in members]
        try:
            around |= zip(members, _around(of))
        except Exception:  # which of them it is shows only alone
            for i, one in zip(members, of):
                try:
                    around |= zip([i], _around([one]))
                except Exception as error:
                    errors[i] = error
    return [errors[i] if i in errors else ((found[i], *around[i]), events[i]) for i in range(len(fits))]


def _around(members: Sequence[tuple[Fits, Parameters, Responses]]) -> list[tuple[Parameters, ...]]:
    """`Fits.around` of axes that are alike, as one computation."""
    if len(members) == 1:
        ((one, parameters, batch),) = members
        return [one.around(parameters, batch)]
    fits, found, batches = zip(*members)
    ends = np.cumsum([0, *map(len, found)]).tolist()
    every = fits[0].around(Parameters.join(found), Responses.join(batches))
    return [tuple(one[a:b] for one in every) for a, b in pairwise(ends)]


@dataclass(frozen=True)
class Output:
    """What messages of the log gave.

    Attributes
    ----------
    number
        Of the first response, counted from the beginning of the axis's run.
    responses
        None if there are none.
    fitted
        Numbers of the responses that were fitted, (rows,).
    parameters
        Their fits, the quantities derived from them, and the margins, (rows,) each.
    events
        Alarms of monitoring among them.
    """

    number: int
    responses: Responses | None
    fitted: NDArray[np.int64]
    parameters: tuple[Parameters, ...]
    events: list[Event]


class UnfittedOutput(NamedTuple):
    """What is known before fits: the number of the first response, all responses, which of them are fitted, events."""

    number: int
    responses: Responses | None
    to_fit: NDArray[np.int64]
    events: list[Event]


class StackedRows(NamedTuple):
    """A response of each of several streams: indices of the streams, numbers of the responses, and a row for each."""

    indices: list[int]
    numbers: list[int]
    responses: Responses


def outputs_together(streams: Sequence[AxisStream]) -> list[Output]:
    """The output of each stream, of what it took; what they have in common is computed once, and none depends on
    another."""
    stacks, outputs = stacked_together(streams)
    rows: dict[int, list[tuple[int, Responses]]] = {}
    for stack in stacks:
        for row, (i, number) in enumerate(zip(stack.indices, stack.numbers)):
            rows.setdefault(i, []).append((number, stack.responses[row : row + 1]))
    for i, own in rows.items():
        events, after = [], []
        if i in outputs:
            events, after = outputs[i].events, [outputs[i].responses]
        every = Responses.join([row for _, row in own] + [batch for batch in after if batch is not None])
        outputs[i] = Output(own[0][0], every, NO_ROWS, (), events)
    return [outputs[i] for i in range(len(streams))]


def stacked_together(streams: Sequence[AxisStream]) -> tuple[list[StackedRows], dict[int, Output]]:
    """Results of all streams: those of axes that are alike in one piece, and outputs of all others by their places.

    An axis of the first kind is also among the others if it has events, or further responses.
    """
    stacks: list[StackedRows] = []
    tracked: dict[int, UnfittedOutput] = {}
    alike: dict[object, list[int]] = {}
    for i, stream in enumerate(streams):
        if stream.usual is not None and (len(stream.spectra) == 1 or (stream.spectra and stream.usual.results_only)):
            alike.setdefault(stream.usual.kind, []).append(i)
    for members in alike.values():
        # The first spectrum of each, then the second one: several of a single axis cost less as one Block.
        while members and (len(members) > 1 or len(streams[members[0]].spectra) == 1):
            every = [(usual, streams[i].spectra[0]) for i in members if (usual := streams[i].usual) is not None]
            try:
                responses, taken = spectra_together(every)
            except Exception:  # which of them it is shows only alone
                _logger.exception("internal error while %d axes are tracked together", len(members))
                break
            if responses is None:
                break
            indices = [i for i, has_response in zip(members, taken) if has_response]
            stack = StackedRows(indices, [streams[i].stacked() for i in indices], responses)
            if (usual := streams[indices[0]].usual) is not None and usual.results_only:
                stacks.append(stack)
            else:
                rows = enumerate(zip(indices, stack.numbers))
                tracked |= {i: streams[i].unfitted(number, responses[row : row + 1]) for row, (i, number) in rows}
            members = [i for i in indices if streams[i].spectra]
    done = {i for stack in stacks for i in stack.indices} | tracked.keys()
    tracked |= {i: stream.tracked() for i, stream in enumerate(streams) if i not in done or stream.has_more}
    return stacks, dict(zip(tracked, _fitted_together([streams[i] for i in tracked], [*tracked.values()])))


def _fitted_together(streams: Sequence[AxisStream], tracked: Sequence[UnfittedOutput]) -> list[Output]:
    """What these become; the fits of all axes are one computation."""
    indices = [i for i, output in enumerate(tracked) if len(output.to_fit)]
    fits, batches = [], []
    for i in indices:
        responses, stages = tracked[i].responses, streams[i].pipeline
        assert responses is not None
        assert stages.fits is not None
        fits.append(stages.fits)
        batches.append(responses[tracked[i].to_fit])
    fitted: dict[int, Fitted | Exception] = dict(zip(indices, process_together(fits, batches)))
    return [
        stream.finished(output, fitted.get(i, ((), []))) for i, (stream, output) in enumerate(zip(streams, tracked))
    ]
