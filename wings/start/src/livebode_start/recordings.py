"""A recording as the page shows it: channels, roles, signals, and the configuration from a person's choices."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from livebode.core import ServerError, UsageError
from livebode.dataclass import dataclass
from livebode.language import Message, for_page
from livebode.plugins import named
from livebode.preparation import (
    Guess,
    Proposals,
    Settled,
    chosen_part,
    settled,
    suitable_estimator,
    suitable_model,
    tables_of,
)
from livebode.sources import Log, open_log
from livebode.sources.live import Survey
from livebode_start.listening import shown
from livebode_start.preview import SignalOverview

OPEN_MAX = 4
"""Recordings in memory."""
_CHANNELS_MAX = 500
_NAME_MAX = 2000
_ESTIMATORS = "joint", "direct", "lpm", "welch"
Role = Literal["excitation", "input", "output", "schedule"]


class ChosenLines(BaseModel):
    """Lines and window as [lines] has them."""

    model_config = ConfigDict(extra="forbid")
    frequencies: str = Field(max_length=50_000)
    window: int


class Choices(BaseModel):
    """What a person chose on the page; what is None is found.

    Attributes
    ----------
    recording
        Name of the file, or the address that was listened to.
    rate_hz
        Samples per second, of a recording without a rate.
    signals
        The channel of each role.
    begin_s, end_s
        The span that is used, in the time of the recording.
    lines
        Lines and window.
    estimator, average, model
        Keys of the configuration.
    baseline
        Name of a learned baseline of the directory, with which the run is compared; each response is then of its own
        window, without an average.
    """

    model_config = ConfigDict(extra="forbid")
    recording: str = Field(max_length=_NAME_MAX)
    rate_hz: float | None = None
    signals: dict[Role, str] = {}
    begin_s: float | None = None
    end_s: float | None = None
    lines: ChosenLines | None = None
    estimator: str | None = Field(None, max_length=20)
    average: bool | None = None
    model: str | None = Field(None, max_length=60)
    baseline: str | None = Field(None, max_length=_NAME_MAX)

    @classmethod
    def read(cls, data: bytes) -> Choices:
        """The choices of a request; ServerError if it is malformed."""
        try:
            return cls.model_validate_json(data)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"]))
            raise ServerError(
                "request-malformed", f"the choices are malformed ({place}: {first['msg']})", Message("reload the page")
            ) from None


@dataclass
class OpenedRecording:
    """A recording of the workspace, or what came from an address, in memory.

    Attributes
    ----------
    name
        Of its file as the workspace offers it, or the address.
    source
        Its section [source].
    log
        What reads it.
    heard
        What the page shows of each channel of a live source; None of a file.
    """

    name: str
    source: Mapping[str, Any]
    log: Log
    heard: Mapping[str, Any] | None = None
    _newest: tuple[Choices, ProposedConfiguration] | None = field(default=None, init=False, repr=False)

    @cached_property
    def proposals(self) -> Proposals:
        """Roles of its channels."""
        return Proposals(self.log)

    @cached_property
    def stop(self) -> int:
        """Number of the sample after its last one."""
        if self.log.stop is not None:
            return self.log.stop
        return max((block.stop for block in self.log.blocks([self.proposals.channels[0].name])), default=0)

    @cached_property
    def overview(self) -> SignalOverview:
        """Extremes of all channels."""
        return SignalOverview.read(self.log, [channel.name for channel in self.proposals.channels], self.stop)

    def plain(self) -> dict[str, Any]:
        """Facts, channels and proposed roles, for JSON."""
        log, channels = self.log, self.proposals.channels[:_CHANNELS_MAX]
        timing = log.timing
        return {
            "recording": self.name,
            "format": log.format,
            "rate_hz": log.rate_hz,
            "rate_given": "rate_hz" in self.source,
            "begin_s": log.origin_s,
            "end_s": log.origin_s + self.stop / log.rate_hz,
            "gaps": 0 if timing is None else timing.gaps,
            **(self.heard or {}),
            "channels": [
                {
                    "name": channel.name,
                    "unit": channel.unit,
                    "kind": channel.kind,
                    "constant": not channel.minimum < channel.maximum,
                    "not_finite": channel.not_finite,
                }
                for channel in channels
            ],
            "estimators": list(_ESTIMATORS),
            "models": ["none", "auto", *named("models")],
            "skipped": [[skipped.name, skipped.reason] for skipped in log.skipped[:_CHANNELS_MAX]],
            "roles": {
                role: {"channel": guess.channel, "reason": for_page(guess.reason), "others": list(guess.others)}
                for role, guess in self.guesses.items()
            },
        }

    def proposed(self, choices: Choices) -> ProposedConfiguration:
        """The configuration of these choices, found and checked as `livebode inspect --out` does it.

        Raises
        ------
        LivebodeError
            If the recording contradicts them, or they do not suffice.
        """
        if self._newest is None or self._newest[0] != choices:  # the lines of a long recording take seconds
            self._newest = choices, _found(self, choices)
        return self._newest[1]

    @cached_property
    def guesses(self) -> dict[str, Guess]:
        """The proposed channel of each role, or None, with the reason."""
        return self.proposals.roles()


@dataclass(frozen=True)
class ProposedConfiguration:
    """A checked configuration, and what was found for it."""

    settled: Settled
    estimator: str
    estimator_reason: str
    average: bool
    model: str

    def plain(self, recording: str) -> dict[str, Any]:
        """Text and values, for JSON."""
        lines = self.settled.tables.get("lines", {})
        comments = self.settled.comments
        return {
            "text": self.settled.text(recording),
            "lines": lines or None,
            "lines_found": for_page(comments.get(("lines", "frequencies"), "")),
            "window_found": for_page(comments.get(("lines", "window"), "")),
            "estimator": self.estimator,
            "estimator_reason": for_page(self.estimator_reason),
            "average": self.average,
            "model": self.model,
            "doubts": [for_page(doubt) for doubt in self.settled.doubts],
        }


class OpenedRecordings:
    """The recordings in memory; for one thread at a time."""

    def __init__(self) -> None:
        self._opened: OrderedDict[Any, OpenedRecording] = OrderedDict()

    def open(self, path: Path, name: str, rate_hz: float | None) -> OpenedRecording:
        """The recording of a file, read again if the file has changed; LivebodeError if it cannot be read.

        `name` is its path relative to the configuration.
        """
        status = path.stat()
        source: dict[str, Any] = {"log": name} | ({} if rate_hz is None else {"rate_hz": rate_hz})
        return self._retained(
            (name, status.st_mtime_ns, status.st_size, rate_hz),
            lambda: OpenedRecording(name, source, open_log(path, rate_hz=rate_hz)),
        )

    def of_heard(self, heard: Survey, rate_hz: float | None) -> OpenedRecording:
        """The samples of a live source as a recording."""

        def opened() -> OpenedRecording:
            log, source = heard.log(rate_hz)
            return OpenedRecording(str(heard.source["url"]), source, log, shown(heard))

        return self._retained((heard, rate_hz), opened)

    def _retained(self, key: object, opened: Callable[[], OpenedRecording]) -> OpenedRecording:
        if key not in self._opened:
            self._opened[key] = opened()
            while len(self._opened) > OPEN_MAX:
                self._opened.popitem(last=False)
        self._opened.move_to_end(key)
        return self._opened[key]


def _found(opened: OpenedRecording, choices: Choices) -> ProposedConfiguration:
    signals: dict[str, str] = {role: name for role, name in choices.signals.items() if name}
    _check_signals(signals)
    log = chosen_part(opened.log, choices.begin_s, choices.end_s, 0, _no_periods)
    estimator, reason = suitable_estimator(log, signals)
    estimator = choices.estimator or estimator
    average = "schedule" not in signals and not choices.baseline if choices.average is None else choices.average
    model = choices.model or suitable_model(opened.proposals, signals, estimator)
    source = {**opened.source, "from": choices.begin_s, "to": choices.end_s}
    tables = tables_of(source, signals, estimator=estimator, average=average, model=model)
    if choices.lines is not None:
        tables["lines"] = choices.lines.model_dump()
    reasons = {role: _reason(opened, role, name) for role, name in signals.items()}
    result = settled(log, tables, reasons)
    if choices.baseline:  # in the directory of the runs, which is not that of this process
        monitoring = {"baseline": f"baselines/{choices.baseline}.json"}
        result = replace(result, tables={**result.tables, "monitoring": monitoring})
    if opened.heard is not None and "lines" not in result.tables:
        raise UsageError(
            "missing",
            Message("nothing repeats in {reference}, and a live source needs lines and a window",
                    reference=signals.get("excitation") or signals["input"]),
            Message("enter both"),
            argument="lines",
        )  # fmt: skip
    return ProposedConfiguration(result, estimator, reason, average, model)


def _reason(opened: OpenedRecording, role: str, name: str) -> str:
    guess = opened.guesses[role]
    return str(guess.reason) if guess.channel == name else "as specified"


def _check_signals(signals: dict[str, str]) -> None:
    if "output" not in signals:
        raise UsageError("missing", Message("the output has no channel"), Message("choose one"), argument="output")
    if "input" not in signals:
        raise UsageError("missing", Message("the input has no channel"), Message("choose one"), argument="input")


def _no_periods(_: Log) -> tuple[int, int]:
    raise AssertionError  # limits of the page are in seconds
