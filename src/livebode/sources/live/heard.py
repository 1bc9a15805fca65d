"""What comes from an address within some seconds: channels, or the fields of messages of other programs."""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from threading import Timer
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Channel, SourceError
from livebode.dataclass import dataclass
from livebode.locations import Url
from livebode.plugins import loaded, named
from livebode.sources.live.address import parse_address
from livebode.sources.live.fields import number_fields
from livebode.sources.live.opening import make_source
from livebode.sources.live.settings import SourceKeys, SourceSettings
from livebode.sources.live.source import LiveSource
from livebode.sources.opening import log_of
from livebode.sources.quantities import kind_by_name
from livebode.sources.recording import ArrayRecording, Column
from livebode.sources.units import split_unit

if TYPE_CHECKING:
    from livebode.sources.log import Log

LISTEN_S = 3.0
"""How long an address is listened to."""
_MESSAGES_MAX = 1 << 16
_TICK_S = 0.05
_NICE = (1.0, 1.25, 2.0, 2.5, 4.0, 5.0, 8.0)
_NEAR = 0.03  # of a rate: arrivals within three seconds do not give it better
_BYTES_SHOWN = 24
_NEITHER = "what arrives is neither JSON nor samples for livebode"


@dataclass(frozen=True)
class HeardChannel:
    """A channel, or a number in messages of another program.

    Attributes
    ----------
    name, unit
        As the sender states them; of a number in a message its path.
    rate_hz
        Values per second as they arrived.
    example
        Its newest value.
    """

    name: str
    unit: str
    rate_hz: float
    example: float

    def within(self, place: str) -> HeardChannel:
        """The same with the place where it was heard, such as a topic, before its name."""
        return replace(self, name=f"{place}: {self.name}")


@dataclass(frozen=True, eq=False)
class Survey:
    """What came from an address.

    Attributes
    ----------
    channels
        What has numbers; empty where nothing came, or nothing that can be used.
    source
        Keys of [source] that receive them, the address among them; the rate is measured where none is stated.
    block
        The samples, for proposals; None where they have none in common.
    trouble
        Why nothing can be used; empty if something can.
    """

    channels: tuple[HeardChannel, ...]
    source: Mapping[str, Any]
    block: Block | None = None
    trouble: str = ""

    @property
    def rate_hz(self) -> float:
        assert self.block is not None
        return self.block.rate_hz

    def log(self, rate_hz: float | None = None) -> tuple[Log, Mapping[str, Any]]:
        """The samples as a recording, and its section [source]; with another rate than the measured one, if given."""
        assert self.block is not None
        rate_hz = rate_hz or self.rate_hz
        channels, samples = self.block.channels, len(self.block)
        columns = [Column(c.name, c.unit, samples, key=row) for c, row in zip(channels, self.block.data)]
        log = log_of(ArrayRecording(Url(self.source["url"]), columns), rate_hz=rate_hz, time="none")
        return log, {**self.source, "rate_hz": rate_hz}


def survey(url: str, seconds: float = LISTEN_S) -> Survey:
    """Listen to an address.

    Raises
    ------
    ConfigError
        If it is not the address of a live source.
    SourceError
        If the peer rejects the connection, or nothing arrives.
    ExtraError
        If the package that it needs is not installed.
    """
    address = parse_address(url)
    kind = named("sources")[address.scheme]
    listen = loaded(kind.survey) if kind.survey else survey_messages
    return cast("Survey", listen(SourceSettings(url=url), seconds))


def survey_messages(settings: SourceKeys, seconds: float) -> Survey:
    """Listen for frames or lines for livebode, else for the fields of messages of another program.

    Raises
    ------
    SourceError
        If the peer rejects the connection, or nothing arrives.
    """
    kind = named("sources")[parse_address(str(settings.url)).scheme]
    own = make_source(settings.model_copy(update={"timeout_s": seconds}))
    soon = Timer(seconds / 2, lambda: own.stop() if own.unusable and not own.channels else None)
    soon.start()
    try:
        return heard_channels(own, seconds)
    except SourceError:
        if "fields" not in kind.keys or not own.unusable:
            raise
    finally:
        soon.cancel()
    # A path that no message has: each message is retained as it came.
    other = make_source(settings.model_copy(update={"fields": {"?": "?"}, "rate_hz": 1.0, "timeout_s": seconds}))
    other.retains_unusable, other.unusable = True, deque(maxlen=_MESSAGES_MAX)
    try:
        other.open()
    except SourceError:
        if not other.unusable:
            raise
    finally:
        other.close()
    return survey_of(str(settings.url), list(other.unusable), _NEITHER)


def heard_channels(source: LiveSource, seconds: float) -> Survey:
    """What a source gives within some seconds after its first samples; it is opened, and closed again."""
    with source:
        source.open()
        until = time.monotonic() + seconds
        blocks: list[Block] = []
        for block in source.stream(wait_s=_TICK_S):
            blocks += [block] if isinstance(block, Block) else []
            if time.monotonic() > until:
                break
        rate_hz, labels = source.rate_hz, source.channels
    data = np.concatenate([block.data for block in blocks], axis=1) if blocks else np.zeros((len(labels), 0))
    arrived_hz = source.health.measured_hz or rate_hz
    heard = (
        HeardChannel(channel.name, channel.unit, arrived_hz, float(row[-1]) if row.size else float("nan"))
        for channel, row in zip(labels, data)
    )
    settings = source.settings.model_dump(include={"url", "fields", "rate_hz"}, exclude_defaults=True)
    return Survey(tuple(heard), settings, Block(data, labels, rate_hz) if data.size else None)


def survey_of(url: str, messages: Sequence[tuple[float, bytes]], trouble: object) -> Survey:
    """Fields of messages of JSON with the times of their arrival; without any, what is wrong with them."""
    parsed: list[Any] = []
    for _, message in messages:
        try:
            parsed.append(json.loads(message))
        except (ValueError, RecursionError):
            continue
    values: dict[str, list[list[float]]] = {}
    for message in parsed:
        for path, numbers in number_fields(message):
            values.setdefault(path, []).append(numbers)
    values = {path: parts for path, parts in values.items() if all(parts)}
    if not values:
        why = "the messages have no field with numbers" if parsed else trouble
        return Survey((), {"url": url}, None, unusable_words(messages, why))
    began, ended = messages[0][0], messages[-1][0]
    span_s = max(ended - began, 1e-9)
    heard = []
    for path, parts in values.items():
        later = sum(map(len, parts[1:]))
        heard.append(HeardChannel(path, split_unit(path)[1], later / span_s, parts[-1][-1]))
    # Channels of one message have equally many values; the most usual number is that of the samples.
    most = max(map(len, values.values()))
    whole = {path: np.concatenate(parts) for path, parts in values.items() if len(parts) == most}
    sizes = [row.size for row in whole.values()]
    size = max(set(sizes), key=lambda each: (sizes.count(each), each))
    rate_hz = nice_rate((size - size // most) / span_s)
    number = next(
        (path for path, row in whole.items() if row.size == most and _numbers_samples(row, size // most)), None
    )
    rows = {
        path: row for path, row in whole.items() if row.size == size and path != number and not _is_time(row, span_s)
    }
    source: dict[str, Any] = {"url": url, "rate_hz": rate_hz, "fields": channel_names(list(rows))}
    source |= {} if number is None else {"sample_field": number}
    labels = tuple(Channel(*split_unit(name)) for name in source["fields"])
    block = Block(np.array(list(rows.values())), labels, rate_hz) if rows else None
    return Survey(tuple(heard), source, block)


def _numbers_samples(row: NDArray[np.float64], step: int) -> bool:
    """Whether it numbers the first sample of each message; a loss is a larger step."""
    steps = np.diff(row)
    return bool(steps.size and np.all(steps >= step) and np.all(row == np.round(row)) and np.median(steps) == step)


def _is_time(row: NDArray[np.float64], span_s: float) -> bool:
    """Whether it grows by the time of the messages, in s, ms, µs or ns."""
    grown = (row[-1] - row[0]) / span_s
    return bool(np.all(np.diff(row) >= 0) and any(abs(grown / unit - 1) < _NEAR for unit in (1, 1e3, 1e6, 1e9)))


def nice_rate(rate_hz: float) -> float:
    """The usual rate near a measured one: 1, 1.25, 2, 2.5, 4, 5 or 8 times a power of ten; else the measured one.

    >>> nice_rate(998.7), nice_rate(3970.0), nice_rate(731.26)
    (1000.0, 4000.0, 731.3)
    """
    decade = 10.0 ** np.floor(np.log10(rate_hz)) if rate_hz > 0 else 1.0
    usual = min((decade * factor for factor in (*_NICE, 10.0)), key=lambda each: abs(each / rate_hz - 1))
    return float(usual if abs(usual / rate_hz - 1) < _NEAR else f"{rate_hz:.4g}")


def channel_names(paths: Sequence[str]) -> dict[str, str]:
    """A name for each path: its last words that say what is measured, else the last; the whole path if two are alike.

    >>> channel_names(["drive.torque.set", "drive.gen.exc", "axes[0].vel", "axes[1].vel"])
    {'torque_set': 'drive.torque.set', 'exc': 'drive.gen.exc', 'axes_0_vel': 'axes[0].vel', 'axes_1_vel': 'axes[1].vel'}
    """
    short = [_telling(path.split(".")) for path in paths]
    whole = ["_".join(path.replace("[", ".").replace("]", "").split(".")) for path in paths]
    return {
        (last if short.count(last) == 1 and "[" not in last else full): path
        for path, last, full in zip(paths, short, whole)
    }


def _telling(words: Sequence[str]) -> str:
    """The shortest end of a path whose words name a kind of quantity; its last word if none does."""
    ends = ("_".join(words[begin:]) for begin in reversed(range(len(words))))
    return next((end for end in ends if kind_by_name(end)), words[-1])


def unusable_words(messages: Collection[tuple[float, bytes]], trouble: object) -> str:
    """What is wrong with the newest message, and its first bytes.

    >>> unusable_words([(0.0, b"12;34\\n")], "a message is not JSON")
    "a message is not JSON; the newest has 6 bytes and begins with b'12;34\\\\n'"
    """
    if not messages:
        return str(trouble)
    newest = list(messages)[-1][1]
    more = "…" if len(newest) > _BYTES_SHOWN else ""
    return f"{trouble}; the newest has {len(newest)} bytes and begins with {newest[:_BYTES_SHOWN]!r}{more}"
