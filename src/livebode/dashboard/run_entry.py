"""A run as one row of the list of runs, from its run.json, its notes and the sizes of its files."""

from __future__ import annotations

import os
import stat
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, field
from math import isfinite, nan
from pathlib import Path
from typing import Any, Literal

from livebode.core import LEVELS, LivebodeError, RunClock
from livebode.dashboard.alarm import limited
from livebode.dataclass import dataclass
from livebode.language import for_page, recorded
from livebode.monitoring import result_tone
from livebode.records import COPY, RUN, Manifest, read_notes, read_summary, what_is_wrong

RunState = Literal["finished", "recording", "stopped", "broken"]
_GROWS_S = 10.0
_SEARCHED = ("report", "machine", "signals", "source", "lines", "tracking", "monitoring")
_WORDS_MAX, _QUANTITIES_MAX, _TEXT_MAX = 1000, 40, 500


@dataclass(frozen=True)
class RunEntry:
    """A row of the list.

    Attributes
    ----------
    name
        Name of its directory.
    state
        "finished" (its source or a person ended it), "recording" (its files change), "stopped" before its end, "broken"
        (it cannot be read: `message`).
    machine, recording, signals
        As configured: its path in [machine], its name in [report], or the address of its source; the file; the
        channels. Empty if unknown.
    begun, duration_s
        Seconds since 1970, and length; None if unknown.
    written
        When run.json was written, seconds since 1970.
    lines, low_hz, high_hz, estimator
        Number and span of the lines; 0 lines of an output-only run.
    averaged
        Whether each response is the average of all periods before it, from which no baseline is learned.
    tone, message, alarms
        Verdict of the monitoring, its sentence, and how many alarms are active.
    fit
        Newest valid fit: name, value, 95 % bound, unit.
    size_bytes
        Of its files.
    tags, notes
        Of a person.
    words
        Texts of the configuration, for the search.
    """

    name: str
    state: RunState
    written: float
    size_bytes: int
    message: str = ""
    machine: str = ""
    recording: str = ""
    signals: str = ""
    begun: float | None = None
    duration_s: float | None = None
    lines: int = 0
    low_hz: float | None = None
    high_hz: float | None = None
    estimator: str = ""
    averaged: bool = False
    tone: str = "open"
    alarms: int = 0
    model: str = ""
    fit: list[tuple[str, float, float, str]] = field(default_factory=list)
    tags: list[str] = field(default_factory=list)
    notes: str = ""
    words: str = ""

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self) | {"message": str(self.message), "said": for_page(self.message)}


def entry(run: Path) -> RunEntry:
    """The row of a run; never an error: a run that cannot be read is "broken"."""
    size, newest = _size(run)
    written = newest.get(RUN, newest.get(COPY, nan))
    try:
        summary, _ = read_summary(run)
        if wrong := what_is_wrong(summary):
            return RunEntry(run.name, "broken", written, size, wrong[:_TEXT_MAX])
        return _readable(run, summary, size, newest)
    except (LivebodeError, OSError, ValueError) as error:
        return RunEntry(run.name, "broken", written, size, limited(getattr(error, "words", str(error)), _TEXT_MAX))


def grows(newest: Mapping[str, float]) -> bool:
    """Whether a file of the run has changed in the last seconds."""
    return time.time() - max(newest.values(), default=0.0) < _GROWS_S


def _readable(run: Path, summary: dict[str, Any], size: int, newest: dict[str, float]) -> RunEntry:
    settings, configuration = summary["found"], summary.get("configuration", {})
    record = summary.get("record", {})
    ended = bool(record.get("finished", True) or record.get("ended", False))
    state: RunState = "finished" if ended else "recording" if grows(newest) else "stopped"
    recorded_s = summary.get("speed", {}).get("recorded_s")
    frequencies = settings.get("frequency_hz") or [
        k * settings["rate_hz"] / settings["window"] for k in settings.get("bins", [])
    ]
    tone, message, alarms = _verdict(summary)
    try:
        notes = read_notes(run)
        tags, text = notes.tags, notes.text
    except LivebodeError as error:
        tags, text = [], str(error)
    return RunEntry(
        name=run.name,
        state=state,
        written=newest.get(RUN, newest.get(COPY, nan)),
        size_bytes=size,
        message=message,
        machine=_machine(configuration),
        recording=Path("".join(_texts(configuration.get("source", {}), ("log",)))).name,
        signals=" / ".join(_channels(configuration.get("signals", {}))),
        begun=_begun(run, summary),
        duration_s=recorded_s,
        lines=len(frequencies),
        low_hz=min(frequencies, default=None),
        high_hz=max(frequencies, default=None),
        estimator=""
        if "output_only" in summary
        else "".join(_texts(configuration.get("tracking") or {}, ("estimator",))),
        averaged=(configuration.get("tracking") or {}).get("average") is True,
        tone=tone,
        alarms=alarms,
        model=str(summary.get("fit", {}).get("model", ""))[:80],
        fit=list(_fit(summary)),
        tags=tags,
        notes=text,
        words=" ".join(dict.fromkeys(_leaves([configuration.get(part) for part in _SEARCHED])))[:_WORDS_MAX],
    )


def _verdict(summary: Mapping[str, Any]) -> tuple[str, str, int]:
    """Tone, sentence and number of active alarms of the monitoring; the words are those of a report."""
    monitoring = summary.get("monitoring", {})
    active = monitoring.get("standing") or []
    alarms = len(active) if isinstance(active, list) else 0
    message = limited(recorded(monitoring.get("words", {}), str(monitoring.get("message", ""))), _TEXT_MAX)
    tone = result_tone(monitoring, active=alarms > 0)
    return tone, message, 0 if tone == "open" else alarms


def _machine(configuration: Mapping[str, Any]) -> str:
    """The machine that the run names, else the address that its data are from."""
    if path := "/".join(_texts(configuration.get("machine") or {}, LEVELS)):
        return path
    named = _texts(configuration.get("report") or {}, ("machine", "serial_number"))
    return " · ".join(named or _texts(configuration.get("source", {}), ("url",)))[:200]


def _texts(section: Mapping[str, Any], names: tuple[str, ...]) -> list[str]:
    return [section[name][:200] for name in names if isinstance(section.get(name), str) and section[name]]


def _channels(signals: Mapping[str, Any]) -> Iterator[str]:
    """Output, input and excitation; of a matrix run each is a list of channels."""
    for role in ("output", "input", "excitation"):
        names = signals.get(role)
        text = ", ".join(filter(None, _leaves(names)))[:200]
        if text:
            yield text


def _leaves(value: object) -> Iterator[str]:
    if isinstance(value, dict):
        for inner in value.values():
            yield from _leaves(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from _leaves(inner)
    elif isinstance(value, str):
        yield value


def _fit(summary: Mapping[str, Any]) -> Iterator[tuple[str, float, float, str]]:
    quantities = (summary.get("fit", {}).get("newest") or {}).get("quantities") or {}
    for name, quantity in list(quantities.items())[:_QUANTITIES_MAX]:
        value, bound = quantity.get("value"), quantity.get("bound_95")
        if _finite(value) and _finite(bound) and bound > 0:
            yield str(name)[:80], value, bound, str(quantity.get("unit", ""))[:40]


def _finite(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def _begun(run: Path, summary: dict[str, Any]) -> float | None:
    """Seconds since 1970 of the beginning."""
    clock = RunClock.of(summary)
    if clock.pieces and not clock.utc:
        return clock.unix_s(clock.pieces[0][0])
    if summary["found"].get("clock") == "relative" or summary.get("output_only"):
        return None
    first_s = _first_s(run)
    return None if first_s is None else RunClock.of(summary, first_s).unix_s(first_s)


def _first_s(run: Path) -> float | None:
    """Time of the first response, from the manifest."""
    try:
        return next((s.first_s for s in Manifest.read(run).segments if s.table == "responses" and s.rows), None)
    except (LivebodeError, OSError):
        return None


def _size(run: Path) -> tuple[int, dict[str, float]]:
    """Bytes of the files, links not followed, and when each was changed."""
    total, changed = 0, {}
    for folder, _, names in os.walk(run):
        for name in names:
            path = os.path.join(folder, name)
            try:
                status = os.lstat(path)
            except OSError:  # it was just renamed
                continue
            if stat.S_ISREG(status.st_mode):
                total += status.st_size
                changed[os.path.relpath(path, run)] = status.st_mtime
    return total, changed
