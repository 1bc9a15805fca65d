"""RecordedRun: the recorded samples of a run as a log of what its machine sent."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise
from math import inf
from pathlib import Path

import numpy as np

from livebode.core import SI_UNITS, Channel, LivebodeError, RecordError, RunClock
from livebode.records import RunRecord, channels_of
from livebode.runtime.sender_numbers import NumberedFrom, SenderNumbers
from livebode.sources import DeclaredQuantities
from livebode.sources.live import (
    VALUES_MAX,
    Address,
    Batch,
    LiveSource,
    ReplaySource,
    SenderSample,
    SourceSettings,
    make_source,
)
from livebode.tables import Table


class RecordedRun:
    """The samples of a run as its machine sent them: with the epochs and numbers of the sender.

    Those of a run on a recording, or of one without `numbering` in run.json, have the numbers of the run. A sender
    without an epoch gets the number of its start, from 1.

    Raises
    ------
    RecordError
        If the directory is not from a run, cannot be read, or has no samples.
    """

    def __init__(self, path: Path) -> None:
        self._run = RunRecord.open(path)
        first = next(self._run.tables("samples"), None)
        if first is None:
            raise RecordError(
                "no-samples",
                f"the run in {str(path)!r} has no recorded samples",
                "record them with samples = true in [record], or track the recording itself",
                path=str(path),
            )
        summary = self._run.summary
        kinds = summary.get("configuration", {}).get("source", {}).get("kinds") or {}
        self.channels: tuple[Channel, ...] = DeclaredQuantities(kinds).of(channels_of(first.schema))
        self.rate_hz = float(self._run.found["rate_hz"])
        pieces = SenderNumbers.of(summary.get("numbering", ())).pieces
        begun = int(first["sample"][0])
        before = [NumberedFrom(begun, 0, begun)] if not pieces or begun < pieces[0].sample else []
        self._pieces = [
            piece._replace(epoch=piece.epoch or number) for number, piece in enumerate([*before, *pieces], 1)
        ]

    @cached_property
    def samples(self) -> int:
        """Number of its samples."""
        return self._run.check(["samples"])

    @property
    def clock(self) -> RunClock:
        """Time of day by the sender's numbers; not known after a restart of the sender, whose pause has no length."""
        if len(self._pieces) > 1:
            return RunClock()
        (piece,) = self._pieces
        later_s = (piece.sender_sample - piece.sample) / self.rate_hz
        return RunClock([(from_s + later_s, unix_s - later_s) for from_s, unix_s in self._run.clock.pieces])

    def batches(self, begin: SenderSample | None = None) -> Iterator[Batch]:
        """As in `Replayable`; a batch is at most a second long."""
        first = 0 if begin is None else self._sample_of(begin)
        for table in self._run.tables("samples", span_s=(first / self.rate_hz, inf)):
            yield from self._of_table(table, first)

    def _sample_of(self, begin: SenderSample) -> int:
        """The run's number of a sample; RecordError if the run has none of its epoch."""
        stops: list[float] = [*(piece.sample for piece in self._pieces[1:]), inf]
        found = [(piece, stop) for piece, stop in zip(self._pieces, stops) if piece.epoch == begin.epoch]
        if not found:
            raise RecordError(
                "no-samples",
                f"the run in {str(self._run.path)!r} has no samples of epoch {begin.epoch:#x}",
                "replay it from its beginning, into another directory",
                path=str(self._run.path),
                epoch=f"{begin.epoch:#x}",
            )
        piece, stop = next((one for one in reversed(found) if one[0].sender_sample <= begin.number), found[0])
        return int(min(piece.sample + max(0, begin.number - piece.sender_sample), stop))

    def _of_table(self, table: Table, first: int) -> Iterator[Batch]:
        number = table["sample"]
        data = np.stack([table[name] for name in table.column_names[2:]])
        starts = [piece.sample for piece in self._pieces]
        longest = max(1, min(round(self.rate_hz), VALUES_MAX // len(self.channels)))
        cuts = {0, len(number), *(np.flatnonzero(np.diff(number) != 1) + 1).tolist()}
        cuts |= set(np.searchsorted(number, starts).tolist())
        for a, b in pairwise(sorted(cuts)):
            for start in range(a, b, longest):
                stop = min(start + longest, b)
                if number[stop - 1] >= first:
                    piece = self._pieces[max(0, int(np.searchsorted(starts, number[start], side="right")) - 1)]
                    sent = int(number[start]) - piece.sample + piece.sender_sample
                    yield Batch(sent, data[:, start:stop], self.channels, self.rate_hz, piece.epoch)


def source_of(settings: SourceSettings) -> LiveSource:
    """The live source of these settings, not yet opened; of `replay` the samples that the run recorded."""
    if settings.replay is None:
        return make_source(settings)
    path = settings.replay.resolve()
    try:
        log = RecordedRun(path)
    except LivebodeError as error:
        raise error.at("source.replay") from None
    # What is recorded in SI units was converted when it was read.
    open_units = {channel.name for channel in log.channels if channel.unit not in SI_UNITS}
    units = {name: unit for name, unit in settings.units.items() if name in open_units}
    return ReplaySource(settings.model_copy(update={"units": units}), Address("replay", path=str(path)), log)
