"""The keys of [source], as plain data, and which of them can be combined."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from livebode.core import (
    Channel,
    ClockKind,
    ConfigError,
    Conversion,
    Field,
    QuantityKind,
    TypedTable,
    UsageError,
    ValueCheck,
)
from livebode.dataclass import dataclass
from livebode.locations import Location, Url, location
from livebode.plugins import loaded, named
from livebode.sources.quantities import DeclaredQuantities
from livebode.sources.units import split_unit

LimitUnit = Literal["s", "samples", "periods"]

PATTERN = r"^ *([+-]?[0-9]{1,15}([.][0-9]{0,15})? *s?|[0-9]{1,15} *samples?|[0-9]{1,9}([.][0-9]{0,9})? *periods?) *$"
"""Of a text; also for editors, in JSON Schema."""


@dataclass(frozen=True)
class PartLimit:
    """A moment in a recording.

    Attributes
    ----------
    value
        Seconds in the time of the recording, number of a sample, or number of periods of the excitation.
    unit
        Which of these.
    """

    value: float
    unit: LimitUnit

    def sample(self, rate_hz: float, origin_s: float) -> int:
        """Number of the first sample at or after a moment in seconds or samples; at least 0."""
        if self.unit == "samples":
            return int(self.value)
        # A time that is written with few digits means the sample that it rounds to.
        return max(0, math.ceil((self.value - origin_s) * rate_hz - 1e-3))


def part_limit(given: float | str) -> PartLimit:
    """The moment that a number (seconds) or a text means.

    >>> part_limit(2.5), part_limit("5000 samples").unit, part_limit("3 periods").value
    (PartLimit(value=2.5, unit='s'), 'samples', 3.0)

    Raises
    ------
    UsageError
        If the text is neither.
    """
    if not isinstance(given, str):
        return PartLimit(given, "s")
    if re.fullmatch(PATTERN, given) is None:
        shown = repr(given) if len(given) < 80 else "the limit"
        raise UsageError(
            "unreadable",
            f"{shown} is neither seconds, a whole number of samples, nor periods",
            "write for example 2.5 (seconds), '5000 samples' or '3 periods'",
            value=shown,
        )
    number = given.strip().rstrip("adelmopris ")
    return PartLimit(float(number), "samples" if "a" in given else "periods" if "p" in given else "s")


def _recording(given: Any) -> Location:
    if not isinstance(given, str | Path | Url):
        raise ValueError("input is not a valid path or URL")
    return location(given) if isinstance(given, str) else given


File = Annotated[Path, Field(strict=False)]
LocatedFile = Annotated[Any, Conversion(_recording, "path")]
"""A path or URL; as JSON without a secret in it."""
LOG = {"log", "time", "rate_hz", "follow", "dbc"}
EVERY = {"timeout_s", "kinds", "units"}
RECORDINGS_MAX = 1000
"""In one run."""
PART = {"from_": "from", "to": "to", "skip_periods": "skip_periods"}
"""Keys that choose a part of a finished recording."""


def _checked_limit(given: float | str) -> float | str:
    part_limit(given)
    return given


Limit = Annotated[float | Annotated[str, Field(json_schema_extra={"pattern": PATTERN})], ValueCheck(_checked_limit)]


def _checked_units(units: dict[str, str]) -> dict[str, str]:
    return dict(DeclaredQuantities(units=units).units)


class SourceKeys(TypedTable, extra="forbid", strict=True, allow_inf_nan=False):
    """[source]: a recording (`log`), one that grows (`follow`), a live source (`url`), or a recorded one (`replay`).

    Parameters
    ----------
    log
        The recording, relative to this file, or its URL, such as "s3://bucket/a.mat". Several, as ["a.mat", "b.mat"],
        are tracked one after the other, and their means are averaged.
    time
        Time column of the recording, with its unit if the file does not state it: "clock [us]". "none" ignores it.
        Default: found by name.
    clock
        What the time column of a recording counts. "utc": seconds since 1970. "relative": seconds since any other
        moment. Default: by its first value.
    from
        Beginning of the part of a recording that is used: seconds in its time (2.5), "5000 samples" or "3 periods".
        Periods count from the beginning of the excitation. Default: its first sample.
    to
        End of that part, in the same form; the sample at this moment is excluded. Default: its last sample.
    skip_periods
        Number of periods that are left out at the beginning of the excitation in that part.
    unwrap
        Unwrap the outputs and the schedule of a recording where they are angles or counters that wrap.
    dbc
        DBC file that defines the signals of CAN frames, live or in a recording, relative to this file.
    follow
        The recording grows: a text table, or a directory of recordings.
    replay
        Directory of a run with recorded samples, relative to this file: they are tracked again as the machine sent
        them, with its own sample numbers.
    url
        Address of a live source, instead of log: kind://host:port; without user and password. Its scheme is the kind.
    rate_hz
        Samples per second, in Hz. Default: from the recording or the sender.
    timeout_s
        Time to the first samples after which a live source is reported as silent, in seconds.
    reorder_batches
        Number of batches by which a batch may be late (UDP, MQTT).
    sender
        The only permitted IP address of the sender (UDP). Default: any.
    fields
        Field of each channel in JSON that another program sends (UDP, TCP, MQTT, standard input), as a path:
        { "u [N m]" = "drive.torque", "y [rad/s]" = "axes[0].vel" }. "samples[*].u" is each element of a list. Needs
        rate_hz. Default: the sender writes frames or lines for livebode.
    sample_field
        Field that numbers the samples of such messages, so that losses are exact. Default: messages are counted.
    kinds
        Kind of quantity of channels whose unit does not show it, or shows another: { speed = "velocity" }. Default: by
        the unit, otherwise by the name.
    units
        What one unit of a channel is, where the source does not state it, or states one without an SI value, such as %,
        counts or the A of a motor whose torque constant is known: { torque = "0.024 N m", position = "1/131072 rev",
        iq = "0.35 N m", speed = "rpm" }. Samples are converted to SI units when they are read.
    """

    log: LocatedFile | Annotated[list[LocatedFile], Field(min_length=1, max_length=RECORDINGS_MAX)] | None = None
    time: str | None = None
    clock: ClockKind | None = None
    from_: Limit | None = Field(default=None, alias="from")
    to: Limit | None = None
    skip_periods: Annotated[int, Field(ge=0, le=1 << 40)] = 0
    unwrap: bool = True
    dbc: File | None = None
    follow: bool = False
    replay: File | None = None
    url: str | None = None
    rate_hz: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    timeout_s: Annotated[float, Field(gt=0, le=1e6)] = 30.0
    reorder_batches: Annotated[int, Field(ge=0, le=256)] = 8
    sender: str | None = None
    fields: dict[str, str] = {}
    sample_field: str | None = None
    kinds: dict[str, QuantityKind] = {}
    units: Annotated[dict[str, str], ValueCheck(_checked_units)] = {}

    @property
    def live(self) -> bool:
        """Whether the samples arrive as a machine sends them, or sent them."""
        return self.url is not None or self.follow or self.replay is not None

    @property
    def title(self) -> str:
        """Name of the source in a picture."""
        if self.replay is not None:
            return self.replay.name
        if not self.logs:
            return self.url or ""
        more = len(self.logs) - 1
        return f"{self.logs[0].name} and {more} more" if more else self.logs[0].name

    @property
    def logs(self) -> tuple[Location, ...]:
        """The recordings; none for a live source."""
        if self.log is None:
            return ()
        return tuple(self.log) if isinstance(self.log, list) else (self.log,)

    def beside(self, folder: Path) -> Self:
        """The same with relative paths from `folder`."""
        files: dict[str, Any] = {
            name: folder / value for name in self.model_fields_set if isinstance(value := getattr(self, name), Path)
        }
        if isinstance(self.log, list):
            files["log"] = [folder / place if isinstance(place, Path) else place for place in self.log]
        return self.model_copy(update=files)


if TYPE_CHECKING:
    SourceSettings = SourceKeys


def __getattr__(name: str) -> type[SourceKeys]:
    """SourceSettings: the keys of all kinds of sources; created when it is first used, since it needs their table."""
    if name != "SourceSettings":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    own = (loaded(kind.settings) for kind in named("sources").values() if kind.settings)
    space = {"__module__": __name__, "__doc__": SourceKeys.__doc__}
    model: type[SourceKeys] = type(name, (*dict.fromkeys(own), SourceKeys), space)
    globals()[name] = model
    return model


def check_keys(settings: SourceKeys, kind: str) -> None:
    """ConfigError for a key that does not apply to this kind of source: the scheme of a URL, "log" or "replay"."""
    if part := [name for key, name in PART.items() if key in settings.model_fields_set]:
        why = "this one grows" if kind == "log" else f"{kind} is a live source"
        raise ConfigError(
            "key-unused",
            f"source.{part[0]} chooses a part of a finished recording, but {why}",
            "remove it; tracking begins with the first sample that arrives",
            key=f"source.{part[0]}",
            source=kind,
        )
    taken = LOG if kind == "log" else {"replay"} if kind == "replay" else named("sources")[kind].keys | {"url"}
    if stray := sorted(settings.model_fields_set - taken - EVERY):
        raise ConfigError(
            "key-unused",
            f"source.{stray[0]} does not apply to {kind}",
            f"remove it; the keys of {kind} are {', '.join(sorted(taken))}",
            key=f"source.{stray[0]}",
            source=kind,
            allowed=sorted(taken),
        )


def named_channels(headings: list[str]) -> tuple[Channel, ...]:
    """Channels from their names, each with its unit in brackets.

    >>> named_channels(["w [N m]", "y"])
    (Channel(name='w', unit='N m', kind='torque'), Channel(name='y', unit='', kind='other'))
    """
    return tuple(Channel(*split_unit(heading)) for heading in headings)
