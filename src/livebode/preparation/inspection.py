"""Inspection: what is in a recording, and in which stretches of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, field
from itertools import groupby
from pathlib import Path
from typing import Any, Literal

import numpy as np

from livebode.core import Lines, LivebodeError, RecordingError, UsageError
from livebode.dataclass import dataclass
from livebode.estimation import Settings, nearest_hop
from livebode.excitation import Excitation, pattern, recognise
from livebode.locations import Location
from livebode.preparation._steady import EXAMINED_MIN, bounded
from livebode.preparation._uneven_grid import measured_grid
from livebode.preparation.contents import Contents, read_contents
from livebode.preparation.followers import LIVE_RESPONSES_PER_S
from livebode.preparation.nonperiodic import suits_lpm
from livebode.preparation.part import chosen_part
from livebode.preparation.plan import SEARCHED, beginning
from livebode.preparation.quiet import Quiet, look_for_hum
from livebode.preparation.trend import ChannelTrend, drifting_channels
from livebode.preparation.uneven_plan import clock_facts
from livebode.sources import (
    UNEVEN,
    ClockGroup,
    Log,
    Recording,
    Skipped,
    UnevenLog,
    Wrap,
    log_of,
    open_file,
    uneven_log_of,
)

StretchKind = Literal["silence", "transient", "periodic", "outlying", "differing"]


@dataclass(frozen=True)
class Stretch:
    """Consecutive samples of one kind.

    Attributes
    ----------
    kind
        "silence" before or after the excitation; "transient", "outlying" and "periodic" periods; "differing" ones,
        behind which the machine does not return to the state before.
    first, stop
        Number of the first sample and of the sample after the last one, in the recording.
    periods
        Its first and last period, counted from the beginning of the excitation; None for silence.
    taken
        Whether a run uses it by default.
    """

    kind: StretchKind
    first: int
    stop: int
    periods: tuple[int, int] | None
    taken: bool


def stretches(found: Excitation, first: int, samples: int) -> list[Stretch]:
    """Stretches of a recording whose searched part has this first sample and length, in samples, in their order."""
    judged = found.periods >= EXAMINED_MIN
    left_out = bounded(np.isin(np.arange(found.periods), found.outlying), last=True)

    def kind(m: int) -> StretchKind:
        if m in found.transient:
            return "transient"
        if m in found.outlying:
            return "outlying" if left_out[m] else "differing"
        return "periodic"

    start, period = first + found.start, found.period
    parts = [Stretch("silence", first, start, None, False)] if found.start else []
    for name, group in groupby(range(found.periods), kind):
        numbers = list(group)
        last = numbers[-1] + 1
        # The rest of the recording, shorter than a period, belongs to the last one.
        stop = first + found.stop if last == found.periods else start + last * period
        taken = name in ("periodic", "differing") or not judged
        parts.append(Stretch(name, start + numbers[0] * period, stop, (numbers[0], last - 1), taken))
    if found.stop < samples:
        parts.append(Stretch("silence", first + found.stop, first + samples, None, False))
    return parts


_WITHOUT_RATE = tuple(
    f"recording.{code}"
    for code in ("rate-missing", "time-unit", "time-jitter", "time-irregular", "time-not-increasing", "time-not-finite")
)


_NOT_REPEATING = ("signal.not-periodic", "signal.too-short")


@dataclass(frozen=True, eq=False)
class Inspection:
    """Result of `livebode inspect`.

    `unrecognised`: why an excitation is not recognised, because it does not repeat, or next to a silent stretch.
    `without_rate`: why the recording has no rate; the rate of `log` has no meaning then. `estimator`: the one for this
    excitation; empty if none was examined, or none finds a response to it. `wraps`: positions, and the output, that are
    angles or counters which wrap; `drifting`: what a run subtracts from the excitation and the output.
    """

    log: Log
    contents: Contents
    excitation: Excitation | None
    quiet: Quiet | None = None
    unrecognised: str = ""
    without_rate: str = ""
    estimator: str = ""
    wraps: Mapping[str, Wrap] = field(default_factory=dict)
    drifting: Sequence[ChannelTrend] = ()

    @property
    def skipped(self) -> tuple[Skipped, ...]:
        """What is not a channel, and why."""
        return (*self.log.skipped, *self.contents.unreadable)

    @property
    def clocks(self) -> list[ClockGroup]:
        """The clocks of the channels, if they have clocks of their own."""
        return self.log.clocks(self._listed) if isinstance(self.log, UnevenLog) else []

    @property
    def _listed(self) -> list[str]:
        return [channel.name for channel in self.contents.channels]

    @property
    def live_hop(self) -> int:
        """Default hop of a live run whose window is the excitation's period, in samples."""
        assert self.excitation is not None
        return nearest_hop(self.excitation.period, self.log.rate_hz / LIVE_RESPONSES_PER_S)

    @property
    def stretches(self) -> list[Stretch]:
        """Parts of the recording by what a run does with them; of the searched beginning of a long recording."""
        assert self.excitation is not None
        searched = min(self.contents.samples + self.contents.missing, SEARCHED)
        return stretches(self.excitation, self.log.first, searched)

    def plain(self) -> dict[str, Any]:
        """As plain data, for JSON."""
        log, found, contents = self.log, self.excitation, self.contents
        plain: dict[str, Any] = {
            "log": str(log.path),
            "format": log.format,
            "rate_hz": None if self.without_rate else log.rate_hz,
            "rate_from": None if self.without_rate else log.rate_origin,
            "samples": contents.samples,
            "duration_s": None if self.without_rate else contents.samples / log.rate_hz,
            "gaps": contents.gaps,
            "missing_samples": contents.missing,
            "part": {"first": log.first, "stop": log.stop},
            "timing": asdict(log.timing) if log.timing else None,
            "channels": [asdict(channel) for channel in contents.channels],
            "skipped": [asdict(skipped) for skipped in self.skipped],
            **({"clocks": clock_facts(log, self._listed)} if isinstance(log, UnevenLog) else {}),
            "other_clocks": {clock: list(names) for clock, names in log.other_clocks.items()},
        }
        if self.without_rate:
            plain["without_rate"] = self.without_rate
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
        if self.estimator:
            plain["estimator"] = self.estimator
        if self.wraps:
            plain["wraps"] = {name: asdict(wrap) for name, wrap in self.wraps.items()}
        if self.drifting:
            plain["drifting"] = [asdict(one) for one in self.drifting]
        if self.unrecognised:
            plain["unrecognised"] = self.unrecognised
        return plain


def inspect(
    path: Location,
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
        If it cannot be read, the excitation cannot be judged, or the part has no samples.
    """
    required = [name for name in (excitation, output, input) if name is not None]
    needs_rate = bool(excitation or lines or begin is not None or end is not None or skip_periods)
    log, without_rate = log_with_or_without_rate(open_file(path, dbc), rate_hz, time, required, needs_rate=needs_rate)
    if isinstance(log, UnevenLog) and excitation is not None:
        log = log.at_rate(measured_grid(log, excitation, given=rate_hz is not None)[1])
    log = chosen_part(log, begin, end, skip_periods, lambda part: _periods_in(part, excitation))
    known = {channel.name for channel in log.channels}
    # A channel given by a path or an alias is listed by that name.
    extra = [name for name in dict.fromkeys(required) if name not in known]
    names = [channel.name for channel in log.channels] + extra
    contents = read_contents(log, names, required)
    positions = [channel.name for channel in contents.channels if channel.kind == "position"]
    wraps = log.search_wraps([*positions, *([output] if output is not None else [])])
    log = log.unwrapping(wraps)
    found, quiet = None, None
    if lines is not None:
        signals = [name for name in (output, input) if name is not None]
        quiet = look_for_hum(log, signals, excitation, Lines.parse(lines[0], log.rate_hz, lines[1]))
    unrecognised, estimator = "", ""
    if excitation is not None and not (quiet is not None and quiet.constant):
        try:
            w = beginning(log, excitation)
            found = recognise(w, log.rate_hz, None if output is None else beginning(log, output))
            estimator = "joint"
        except LivebodeError as error:
            if quiet is None and error.code not in (*_NOT_REPEATING, "signal.lines-ambiguous"):
                raise
            unrecognised = str(error)
            estimator = "lpm" if error.code in _NOT_REPEATING and suits_lpm(w, log.rate_hz) else ""
    drifting: list[ChannelTrend] = []
    if found is not None and excitation is not None and output is not None:
        roles = Settings(lines=found.lines, estimator="direct", input=excitation, output=output)
        drifting = drifting_channels(log, roles)
    return Inspection(log, contents, found, quiet, unrecognised, without_rate, estimator, wraps, drifting)


def log_with_or_without_rate(
    recording: Recording, rate_hz: float | None, time: str | None, required: Sequence[str], *, needs_rate: bool
) -> tuple[Log, str]:
    """The log, and why it has no rate (empty if it has one); the channels can be listed without.

    An UnevenLog if its clock jitters, or if the `required` channels have several clocks.
    """
    channels = required[:1] or None
    try:
        log = log_of(recording, rate_hz=rate_hz, time=time, channels=channels)
        log.naming(required)
        return log, ""
    except RecordingError as error:
        if error.code in UNEVEN and time != "none":
            return uneven_log_of(recording, required, rate_hz=rate_hz, time=time), ""
        if needs_rate or rate_hz is not None or error.code not in _WITHOUT_RATE:
            raise
        return log_of(recording, rate_hz=1.0, time="none", channels=channels), str(error)


def _periods_in(log: Log, excitation: str | None) -> tuple[int, int]:
    """Where the excitation begins, and its period."""
    if excitation is None:
        raise UsageError(
            "missing",
            "a limit in periods needs the channel of the excitation",
            "name the excitation, or give the limit in seconds or samples",
            argument="excitation",
        )
    found = recognise(beginning(log, excitation), log.rate_hz, doubtful=True)
    return log.first + found.start, found.period
