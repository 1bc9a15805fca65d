"""Content of a recording, and the excitation in one of its channels."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import Block, Lines, LivebodeError, QuantityKind, UsageError
from livebode.estimation.settings import nearest_hop
from livebode.excitation import Excitation, pattern, recognise
from livebode.preparation.part import chosen_part
from livebode.preparation.plan import LIVE_RESPONSES_PER_S, SEARCHED, beginning
from livebode.preparation.quiet import Quiet, look_for_hum
from livebode.preparation.stretches import Stretch, stretches
from livebode.sources import Log, open_log


@dataclass
class ChannelSummary:
    """One channel over the whole recording: range of its finite samples, and number of others."""

    name: str
    unit: str
    kind: QuantityKind
    minimum: float = float("inf")
    maximum: float = float("-inf")
    not_finite: int = 0

    def take(self, block: Block) -> None:
        samples = block[self.name]
        finite = samples[np.isfinite(samples)]
        self.not_finite += samples.size - finite.size
        if finite.size:
            self.minimum = min(self.minimum, float(finite.min()))
            self.maximum = max(self.maximum, float(finite.max()))


@dataclass(frozen=True, eq=False)
class Inspection:
    """Result of `livebode inspect`; `unrecognised`: why an excitation next to a silent stretch is not recognised."""

    log: Log
    samples: int
    channels: list[ChannelSummary]
    gaps: int
    missing: int
    excitation: Excitation | None
    quiet: Quiet | None = None
    unrecognised: str = ""

    @property
    def live_hop(self) -> int:
        """Default hop of a live run whose window is the excitation's period, in samples."""
        assert self.excitation is not None
        return nearest_hop(self.excitation.period, self.log.rate_hz / LIVE_RESPONSES_PER_S)

    @property
    def stretches(self) -> list[Stretch]:
        """Parts of the recording by what a run does with them; of the searched beginning of a long recording."""
        assert self.excitation is not None
        searched = min(self.samples + self.missing, SEARCHED)
        return stretches(self.excitation, self.log.first, searched)

    def plain(self) -> dict[str, Any]:
        """As plain data, for JSON."""
        log, found = self.log, self.excitation
        plain: dict[str, Any] = {
            "log": str(log.path),
            "format": log.format,
            "rate_hz": log.rate_hz,
            "rate_from": log.rate_origin,
            "samples": self.samples,
            "duration_s": self.samples / log.rate_hz,
            "gaps": self.gaps,
            "missing_samples": self.missing,
            "part": {"first": log.first, "stop": log.stop},
            "timing": asdict(log.timing) if log.timing else None,
            "channels": [asdict(channel) for channel in self.channels],
            "skipped": [asdict(skipped) for skipped in log.skipped],
            "other_clocks": {clock: list(names) for clock, names in log.other_clocks.items()},
        }
        if self.quiet is not None:
            plain["without_excitation"] = self.quiet.plain()
        if found is not None:
            plain["excitation"] = {
                "period": found.period,
                "periods": found.periods,
                "start": log.first + found.start,
                "crest_factor": found.crest_factor,
                "rms": found.rms,
                "peak": found.peak,
                "live_hop": self.live_hop,
                "design": pattern(found.lines.bins),
                "frequency_hz": found.lines.frequency_hz.tolist(),
                "amplitude": found.amplitude.tolist(),
                "snr_db": None if found.snr_db is None else found.snr_db.tolist(),
                "transient_periods": list(found.transient),
                "outlying_periods": list(found.outlying),
                "stretches": [asdict(stretch) for stretch in self.stretches],
                "phase_slips": [[log.first + slip.sample, slip.missing] for slip in found.slips],
            }
        if self.unrecognised:
            plain["unrecognised"] = self.unrecognised
        return plain


def inspect(
    path: Path,
    *,
    rate_hz: float | None = None,
    time: str | None = None,
    dbc: Path | None = None,
    excitation: str | None = None,
    output: str | None = None,
    input: str | None = None,
    lines: tuple[str, int] | None = None,
    begin: float | str | None = None,
    end: float | str | None = None,
    skip_periods: int = 0,
) -> Inspection:
    """Read and describe a recording, or the part of it from `begin` to `end`, as in [source].

    With lines (a text and the window), hum is searched in `output` and `input` where there is no excitation.

    Raises
    ------
    LivebodeError
        If it cannot be read, has no periodic signal, or the part has no samples.
    """
    required = [name for name in (excitation, output, input) if name is not None]
    log = open_log(path, rate_hz=rate_hz, time=time, dbc=dbc, channels=required[:1] or None)
    log = chosen_part(log, begin, end, skip_periods, lambda part: _periods_in(part, excitation))
    known = {channel.name for channel in log.channels}
    # A channel given by a path or an alias is listed by that name.
    extra = [name for name in dict.fromkeys(required) if name not in known]
    names = [channel.name for channel in log.channels] + extra
    summaries: dict[str, ChannelSummary] = {}
    samples, gaps, missing, stop = 0, 0, 0, None
    for block in log.blocks(names):
        for channel in block.channels:
            summaries.setdefault(channel.name, ChannelSummary(channel.name, channel.unit, channel.kind)).take(block)
        samples += len(block)
        if stop is not None and (block.gap or block.start != stop):
            gaps, missing = gaps + 1, missing + block.start - stop
        stop = block.stop
    found, quiet = None, None
    if lines is not None:
        signals = [name for name in (output, input) if name is not None]
        quiet = look_for_hum(log, signals, excitation, Lines.parse(lines[0], log.rate_hz, lines[1]))
    unrecognised = ""
    if excitation is not None and not (quiet is not None and quiet.constant):
        try:
            w = beginning(log, excitation)
            found = recognise(w, log.rate_hz, None if output is None else beginning(log, output))
        except LivebodeError as error:
            if quiet is None:
                raise
            unrecognised = str(error)
    return Inspection(log, samples, list(summaries.values()), gaps, missing, found, quiet, unrecognised)


def _periods_in(log: Log, excitation: str | None) -> tuple[int, int]:
    """Where the excitation begins, and its period."""
    if excitation is None:
        raise UsageError(
            "missing",
            "a limit in periods needs the channel of the excitation",
            "name the excitation, or give the limit in seconds or samples",
            argument="excitation",
        )
    found = recognise(beginning(log, excitation), log.rate_hz)
    return log.first + found.start, found.period
