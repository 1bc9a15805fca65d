"""What is sent: events and results of an axis, independent of the run's arrays."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from typing import Any, Literal

import numpy as np

from livebode.configuration import filled
from livebode.core import Parameters, Responses
from livebode.dataclass import dataclass
from livebode.monitoring import Priority

Condition = Literal["alarm", "ended", "event"]
"""An alarm began or is reported again; its condition ended; an event that is no alarm."""


@dataclass(frozen=True)
class EventMessage:
    """An event of an axis.

    Attributes
    ----------
    id
        Name of the event, the same when it is sent again.
    axis, machine, run
        Name of the axis, path of its machine (empty: not specified), name of the run directory.
    kind, condition, priority
        Kind of the event; what it means for an alarm; priority of the alarm, "info" if it is none.
    cause
        Name of the alarm, which its reports and its end share.
    message
        A sentence for people.
    unix_s
        When it occurred: seconds since 1970.
    sample
        Number of the first sample that it concerns.
    value, unit
        The amount that it reports; None without one.
    """

    id: str
    axis: str
    machine: str
    run: str
    kind: str
    condition: Condition
    priority: Priority | Literal["info"]
    cause: str
    message: str
    unix_s: float
    sample: int
    value: float | None = None
    unit: str = ""

    @property
    def time(self) -> str:
        """`unix_s` as date and time in UTC."""
        return utc(self.unix_s)

    def sentence(self, template: str | None) -> str:
        """The template with its values; by default axis and message."""
        if template is None:
            return f"{self.axis}: {self.message}" if self.axis else self.message
        plain = {name: str(value) for name, value in asdict(self).items()} | {"time": self.time}
        return filled(template, plain | {"value": "" if self.value is None else f"{self.value:.4g}"})

    def plain(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self) | {"time": self.time}

    def stored(self) -> str:
        """As one line of JSON; see `read_event`."""
        return json.dumps(asdict(self), ensure_ascii=False)


def read_event(stored: str) -> EventMessage:
    """The event that `EventMessage.stored` returned."""
    return EventMessage(**json.loads(stored))


@dataclass(frozen=True)
class Measurement:
    """A quantity with the half-width of its 95 % interval; `value` is None where there is no valid one."""

    name: str
    unit: str
    value: float | None
    bound: float | None


@dataclass(frozen=True)
class AlarmNow:
    """An active alarm: its cause, kind, priority, newest message, and seconds since 1970 when it was reported."""

    cause: str
    kind: str
    priority: Priority
    message: str
    unix_s: float


@dataclass(frozen=True)
class AxisValues:
    """The newest results of an axis.

    Attributes
    ----------
    axis, machine, run
        As in `EventMessage`.
    unix_s
        Effective time of the newest response: seconds since 1970.
    measurements
        Parameters of the newest fit, quantities derived from it, and margins; empty without fits.
    response
        The newest response as plain data: frequency_hz, real, imag, sigma, coherence, valid; None without one.
    quantity, unit
        Of the response.
    status
        Counts and state of the axis: state, samples, responses, rate_hz, lost, latency_s, behind_s.
    alarms
        The active ones.
    """

    axis: str
    machine: str
    run: str
    unix_s: float
    measurements: tuple[Measurement, ...]
    response: Mapping[str, Sequence[Any]] | None
    quantity: str
    unit: str
    status: Mapping[str, float | str]
    alarms: tuple[AlarmNow, ...]

    def plain(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self) | {"time": utc(self.unix_s)}


def measurements_of(parts: Sequence[Parameters]) -> tuple[Measurement, ...]:
    """The newest row of each of these, with half-widths of the 95 % intervals."""
    found: dict[str, Measurement] = {}
    for part in parts:
        if not len(part):
            continue
        newest = part[-1:]
        bound = newest.bound()[0]
        for name, unit, value, half in zip(part.names, part.units, newest.value[0].tolist(), bound.tolist()):
            found.setdefault(name, Measurement(name, unit, _number(value), _number(half)))
    return tuple(found.values())


def response_of(responses: Responses) -> dict[str, list[Any]]:
    """The newest response as plain data; None for what is not known."""
    newest = responses[-1]
    return {
        "frequency_hz": newest.lines.frequency_hz.tolist(),
        "real": list(map(_number, newest.value.real.tolist())),
        "imag": list(map(_number, newest.value.imag.tolist())),
        "sigma": list(map(_number, newest.sigma.tolist())),
        "coherence": list(map(_number, newest.coherence.tolist())),
        "valid": newest.valid.tolist(),
    }


def utc(unix_s: float) -> str:
    """Date and time in UTC (ISO 8601, RFC 3339).

    >>> utc(0.0)
    '1970-01-01T00:00:00.000Z'
    """
    return datetime.fromtimestamp(unix_s, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None
