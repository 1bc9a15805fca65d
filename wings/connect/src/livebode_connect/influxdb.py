"""InfluxSink: results and events in InfluxDB's line protocol."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from livebode.publishing import AxisValues, EventMessage, PublishSection
from livebode_connect.http_post import HttpPost

_IN_NAME = re.compile(r"([, ])")
_IN_TAG = re.compile(r"([,= ])")
_IN_TEXT = re.compile(r'(["\\])')
_ESCAPING = re.compile(r"\\+(?=[,= ]|$)")
_LINE_BREAKS = re.compile(r"[\r\n\t\x00]+")
Value = float | int | str | bool


class InfluxSink:
    """A server with the line protocol: InfluxDB 1, 2 and 3, VictoriaMetrics, QuestDB, Telegraf.

    Measurements: ``livebode`` has the parameters with their bounds and the status of an axis, ``livebode_response`` a
    point for each line, ``livebode_event`` the events.
    """

    events_at_once = 500
    pause_s = 0.0

    def __init__(self, section: PublishSection) -> None:
        self._http = HttpPost(section, "Token")

    def send_events(self, events: Sequence[EventMessage]) -> None:
        """Write a point for each; one that is sent again replaces the first."""
        self._write([event_line(event) for event in events])

    def send_values(self, values: Sequence[AxisValues]) -> None:
        """Write the points of all axes in one request."""
        self._write([text for value in values for text in value_lines(value)])

    def close(self) -> None:
        """Close the connection."""
        self._http.close()

    def _write(self, lines: Sequence[str]) -> None:
        if lines:
            self._http.post("\n".join(lines).encode(), {"Content-Type": "text/plain; charset=utf-8"})


def line(measurement: str, tags: Mapping[str, str], fields: Mapping[str, Value | None], unix_s: float) -> str:
    r"""One point. Empty tags and unknown fields are omitted; a line break becomes a space, which the protocol needs.

    >>> line("livebode", {"axis": "x 1"}, {"stiffness": 5e5, "state": 'a "b"', "samples": 3, "ok": True}, 1.5)
    'livebode,axis=x\\ 1 stiffness=500000.0,state="a \\"b\\"",samples=3i,ok=true 1500000000'
    """
    head = [_name(measurement), *(f"{_key(name)}={_key(value)}" for name, value in tags.items() if _key(value))]
    body = [f"{_key(name)}={_field(value)}" for name, value in fields.items() if value is not None]
    return f"{','.join(head)} {','.join(body)} {round(unix_s * 1e9)}"


def event_line(event: EventMessage) -> str:
    """The point of an event. Its time has the number of the event in its digits below a microsecond."""
    tags = {"axis": event.axis, "machine": event.machine, "kind": event.kind, "priority": event.priority}
    fields = {"message": event.message, "condition": event.condition, "cause": event.cause, "run": event.run}
    # Two events of one kind and moment would replace each other; the id keeps them apart, also when sent again.
    apart_s = int(event.id, 16) % 1000 * 1e-9 if re.fullmatch("[0-9a-f]+", event.id) else 0.0
    text = line("livebode_event", tags, {**fields, "sample": event.sample, "value": event.value}, event.unix_s)
    head, _, stamp = text.rpartition(" ")
    return f"{head} {int(stamp) // 1000 * 1000 + round(apart_s * 1e9)}"


def value_lines(values: AxisValues) -> Iterator[str]:
    """The points of an axis."""
    tags = {"axis": values.axis, "machine": values.machine}
    fields: dict[str, Value | None] = {
        name: float(value) if isinstance(value, int | float) else value for name, value in values.status.items()
    }
    for measurement in values.measurements:
        fields |= {
            measurement.name: measurement.value,
            f"{measurement.name}_bound": None if measurement.value is None else measurement.bound,
        }
    if any(value is not None for value in fields.values()):
        yield line("livebode", tags, fields, values.unix_s)
    if values.response is None:
        return
    of = values.response
    for i, frequency in enumerate(of["frequency_hz"]):
        parts = {name: of[name][i] for name in ("real", "imag", "sigma", "coherence")}
        tagged = tags | {"frequency_hz": f"{frequency:.9g}", "quantity": values.quantity}
        yield line("livebode_response", tagged, {**parts, "valid": of["valid"][i]}, values.unix_s)


def _field(value: Value) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + _IN_TEXT.sub(r"\\\1", _LINE_BREAKS.sub(" ", value)) + '"'
    return f"{value}i" if isinstance(value, int) else repr(float(value))


def _name(text: str) -> str:
    return _IN_NAME.sub(r"\\\1", _plain(text))


def _key(text: str) -> str:
    return _IN_TAG.sub(r"\\\1", _plain(text))


def _plain(text: str) -> str:
    """Without line breaks, and without backslashes that would escape what follows them or the end of the text."""
    return _ESCAPING.sub("", _LINE_BREAKS.sub(" ", text))
