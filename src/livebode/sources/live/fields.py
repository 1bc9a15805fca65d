"""Messages of other programs: which field of an object of JSON is which channel."""

from __future__ import annotations

import json
import re
import secrets
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from livebode.core import ConfigError, SourceError
from livebode.sources.live.batch import VALUES_MAX, Batch
from livebode.sources.live.ndjson import LINE_BYTES_MAX, LineDecoder
from livebode.sources.live.settings import SourceKeys, named_channels

_STEP = re.compile(r"([^.\[\]]+)|\[(\d+|\*)\]")
_PATH = re.compile(r"[^.\[\]]+(\.[^.\[\]]+|\[(\d+|\*)\])*")
_DEPTH_MAX = 16
_LISTED_MAX = 8


def numbers_at(path: str, message: Any) -> list[float]:
    """The numbers at a path of names, separated by dots, and indices; [*] is each element of a list.

    A key that has dots itself is found by its whole name. Texts of numbers are numbers, null is NaN.

    >>> axes = {"axes": [{"vel": 1.5}, {"vel": "2"}], "t": [1, None], "a.b": True}
    >>> [numbers_at(path, axes) for path in ("axes[1].vel", "axes[*].vel", "t", "a.b")]
    [[2.0], [1.5, 2.0], [1.0, nan], [1.0]]

    Raises
    ------
    KeyError
        If there is no such field.
    ValueError
        If it has something other than numbers.
    """
    if isinstance(message, dict) and path in message:
        return _numbers(message[path])
    places = [message]
    for name, index in _STEP.findall(path):
        if index == "*":
            places = [part for place in places for part in _listed(place)]
        elif index:
            places = [_listed(place)[int(index)] for place in places if int(index) < len(_listed(place))]
        else:
            places = [place[name] for place in places if isinstance(place, dict) and name in place]
        if not places:
            raise KeyError(path)
    return [number for place in places for number in _numbers(place)]


def _listed(place: Any) -> list[Any]:
    return place if isinstance(place, list) else []


def _numbers(value: Any) -> list[float]:
    if isinstance(value, list):
        return [number for part in value for number in _numbers(part)]
    return [float("nan") if value is None else float(value)]


def number_fields(message: Any, path: str = "", depth: int = 0) -> Iterator[tuple[str, list[float]]]:
    """Each field of a message that has numbers, as the path by which `numbers_at` finds them.

    Lists of objects that are alike are one field of each of their names; of few numbers with other lengths than the
    longest, each is a field.

    >>> list(number_fields({"id": "x", "drive": {"torque": 0.5}, "axes": [{"vel": 1}, {"vel": 2}], "u": [1, 2, 3]}))
    [('drive.torque', [0.5]), ('axes[0].vel', [1.0]), ('axes[1].vel', [2.0]), ('u', [1.0, 2.0, 3.0])]
    """
    if depth > _DEPTH_MAX:
        return
    if isinstance(message, dict):
        for name, part in message.items():
            yield from number_fields(part, f"{path}.{name}" if path else str(name), depth + 1)
    elif isinstance(message, list) and any(isinstance(part, dict | list) for part in message):
        for index, part in enumerate(message):
            yield from number_fields(part, f"{path}[{index}]", depth + 1)
    elif path:
        try:
            yield path, _numbers(message)
        except (ValueError, TypeError, OverflowError):
            return


class FieldDecoder:
    """Turns messages into Batches by the fields of [source].

    A message has one sample, or a list of samples for each channel. Without a field that numbers them they are counted
    as they arrive, so that a lost message is not noticed.

    Parameters
    ----------
    fields
        Path of each channel in a message: {"u [N m]": "drive.torque"}.
    rate_hz
        Samples per second.
    sample_field
        Path of the number of a message's first sample; None counts.
    """

    def __init__(self, fields: Mapping[str, str], rate_hz: float, sample_field: str | None = None) -> None:
        self._paths, self._channels = list(fields.values()), named_channels(list(fields))
        self._rate_hz, self._sample_field = rate_hz, sample_field
        self._next = 0
        # Numbers that are counted here begin again with each connection: a restart, for whoever compares them.
        self._epoch = 0 if sample_field else secrets.randbits(62)

    def decode(self, line: bytes, arrived_s: float = float("nan")) -> Batch:
        """The batch in a message.

        Raises
        ------
        SourceError
            If it is not JSON, or a field is missing or not a number.
        """
        if len(line) > LINE_BYTES_MAX:
            raise SourceError(
                "line-too-long", f"a message is longer than {LINE_BYTES_MAX} bytes", "send fewer samples in a message",
                limit_bytes=LINE_BYTES_MAX,
            )  # fmt: skip
        try:
            message = json.loads(line)
        except (ValueError, RecursionError) as error:
            raise SourceError(
                "line-not-json", f"a message is not JSON: {type(error).__name__}", "send one value of JSON in a message"
            ) from None
        rows = [self._numbers(path, message) for path in self._paths]
        if len({len(row) for row in rows}) != 1 or not 0 < len(rows) * len(rows[0]) <= VALUES_MAX:
            raise SourceError(
                "batch-shape",
                f"the fields of one message have {', '.join(str(len(row)) for row in rows[:_LISTED_MAX])} values",
                "name fields with equally many values in source.fields",
                key="source.fields",
            )
        first = self._next
        if self._sample_field is not None:
            first = int(self._numbers(self._sample_field, message)[0])
        self._next = first + len(rows[0])
        return Batch(first, np.array(rows), self._channels, self._rate_hz, self._epoch, arrived_s=arrived_s)

    def _numbers(self, path: str, message: Any) -> list[float]:
        try:
            return numbers_at(path, message)
        except KeyError:
            names = [name for name, _ in number_fields(message)]
            raise SourceError(
                "key-missing",
                f"a message has no field {path!r}",
                f"name one of {_few(names)} in source.fields" if names else "correct source.fields",
                key=path, fields=names[:_LISTED_MAX],
            ) from None  # fmt: skip
        except (ValueError, TypeError, OverflowError):
            raise SourceError(
                "value-invalid", f"the field {path!r} of a message is not a number", "name another in source.fields",
                key=path,
            ) from None  # fmt: skip


def _few(names: Sequence[str]) -> str:
    return ", ".join(names[:_LISTED_MAX]) + (" …" if len(names) > _LISTED_MAX else "")


def message_decoder(settings: SourceKeys) -> LineDecoder | FieldDecoder:
    """The decoder of messages of JSON for these settings.

    Raises
    ------
    ConfigError
        If a path is invalid, or the rate is missing, which messages of other programs do not have.
    """
    if not settings.fields:
        if settings.sample_field is not None:
            raise ConfigError(
                "key-missing", "source.sample_field needs source.fields", "name the fields of the channels too",
                key="source", keys=["fields"],
            )  # fmt: skip
        return LineDecoder(settings.rate_hz)
    paths = [*settings.fields.values(), *([settings.sample_field] if settings.sample_field else [])]
    for path in paths:
        if _PATH.fullmatch(path) is None:
            raise ConfigError(
                "value-invalid",
                f"the path {path[:40]!r} in source.fields cannot be read",
                "write names with dots and indices, such as drive.torque, axes[0].vel or samples[*].u",
                key="source.fields",
                value=path[:40],
            )
    if settings.rate_hz is None:
        raise ConfigError(
            "key-missing",
            "source.fields needs source.rate_hz",
            "set it to the rate at which the sender samples",
            key="source",
            keys=["rate_hz"],
        )
    return FieldDecoder(settings.fields, settings.rate_hz, settings.sample_field)
