"""Batches as JSON, one object per line: for programs that cannot write binary frames."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Channel, SourceError
from livebode.sources.live.batch import CHANNELS_MAX, VALUES_MAX, Batch
from livebode.sources.live.settings import named_channels

LINE_BYTES_MAX = 8 << 20
KEYS = {"sample", "data", "channels", "rate_hz", "epoch", "stamp_s"}


def encode_line(batch: Batch) -> bytes:
    r"""A batch as one line.

    >>> encode_line(Batch(3, np.array([[1.0, 2.5]]), (Channel("w", "N m"),), 4000.0))
    b'{"sample":3,"rate_hz":4000.0,"channels":["w [N m]"],"data":[[1.0,2.5]]}\n'
    """
    fields: dict[str, Any] = {
        "sample": batch.first_sample,
        "rate_hz": batch.rate_hz,
        "channels": [
            f"{channel.name} [{channel.unit}]" if channel.unit else channel.name for channel in batch.channels
        ],
        "data": batch.data.tolist(),
    }
    fields |= {"epoch": batch.epoch} if batch.epoch else {}
    fields |= {"stamp_s": batch.stamp_s} if batch.stamp_s is not None else {}
    return json.dumps(fields, separators=(",", ":")).encode() + b"\n"


class LineDecoder:
    """Turns lines into Batches; channels, rate and epoch that a line omits are those of the previous line.

    Parameters
    ----------
    rate_hz
        The rate, if lines do not contain it.
    """

    def __init__(self, rate_hz: float | None = None) -> None:
        self._channels: tuple[Channel, ...] = ()
        self._rate_hz = rate_hz
        self._epoch = 0

    def decode(self, line: bytes, arrived_s: float = float("nan")) -> Batch:
        """The batch in a line: an object with `sample`, `data` (a list of numbers for each channel; null is NaN), and
        if they are new `channels` ("name [unit]"), `rate_hz`, `epoch` and `stamp_s`.

        Raises
        ------
        SourceError
            Where the line is too long, not a JSON object, or has an unknown key or an invalid value.
        """
        if len(line) > LINE_BYTES_MAX:
            raise SourceError(
                "line-too-long",
                f"a line is longer than {LINE_BYTES_MAX} bytes",
                "send fewer samples in a line",
                limit_bytes=LINE_BYTES_MAX,
            )
        fields = _object(line)
        channels = _channels(fields["channels"]) if "channels" in fields else self._channels
        rate_hz = _number(fields, "rate_hz") if "rate_hz" in fields else self._rate_hz
        epoch = _whole(fields, "epoch") if "epoch" in fields else self._epoch
        stamp_s = _number(fields, "stamp_s") if fields.get("stamp_s") is not None else None
        if not channels or rate_hz is None:
            key = "rate_hz" if channels else "channels"
            raise SourceError("key-missing", f"the first line has no {key!r}", "add it", key=key)
        batch = Batch(_whole(fields, "sample"), _data(fields), channels, rate_hz, epoch, stamp_s, arrived_s)
        self._channels, self._rate_hz, self._epoch = channels, rate_hz, epoch
        return batch


def _object(line: bytes) -> dict[str, Any]:
    try:
        fields = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise SourceError(
            "line-not-json", f"a line is not JSON: {type(error).__name__}", "send one JSON object in each line"
        ) from None
    if not isinstance(fields, dict):
        raise SourceError("line-not-json", "a line is JSON but not an object", "send one JSON object in each line")
    if unknown := sorted(fields.keys() - KEYS):
        raise SourceError(
            "key-unknown",
            f"a line has the unknown key {unknown[0][:40]!r}",
            f"use {', '.join(sorted(KEYS))}",
            key=unknown[0][:40],
            allowed=sorted(KEYS),
        )
    if missing := {"sample", "data"} - fields.keys():
        raise SourceError("key-missing", f"a line has no {min(missing)!r}", "add it", key=min(missing))
    return fields


def _invalid(key: str, wrong: str) -> SourceError:
    return SourceError("value-invalid", f"{key} {wrong}", "correct the sender", key=key)


def _channels(names: object) -> tuple[Channel, ...]:
    if not isinstance(names, list) or len(names) > CHANNELS_MAX or not all(isinstance(n, str) for n in names):
        raise _invalid("channels", "is not a list of names")
    return named_channels(names)


def _number(fields: dict[str, Any], key: str) -> float:
    value = fields[key]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _invalid(key, "is not a number")
    try:
        return float(value)
    except OverflowError:
        raise _invalid(key, "is larger than any float") from None


def _whole(fields: dict[str, Any], key: str) -> int:
    value = fields[key]
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 1 << 64:
        raise _invalid(key, "is not a whole number from 0 to 2^64")
    return value


def _data(fields: dict[str, Any]) -> NDArray[np.float64]:
    rows = fields["data"]
    if not isinstance(rows, list) or not all(isinstance(row, list) for row in rows):
        raise _invalid("data", "is not a list of one list for each channel")
    if sum(map(len, rows)) > VALUES_MAX or len({len(row) for row in rows}) != 1:
        raise _invalid("data", f"has lists that are not equally long, or more than {VALUES_MAX} values")
    if not all(type(value) in (int, float, type(None)) for row in rows for value in row):
        raise _invalid("data", "has something other than numbers and null")
    try:
        return np.array(rows, dtype=np.float64)
    except (OverflowError, ValueError, TypeError):
        raise _invalid("data", "has a number that is larger than any float") from None
