"""Samples from CAN frames: each sample is one frame of every message that has a channel.

Where a sender sends frames at a regular rate, their numbers follow from the time at which each was received.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from livebode.core import Channel, ConfigError, SourceError, nearest_name
from livebode.sources import split_unit
from livebode_drives.live.counter import Counter, NumberedSample

TOLERANCE = 0.4
"""A frame that is further from its due time than this, in periods, has no certain number."""
PAUSE_PERIODS = 200
"""Longest pause after which numbers are certain: 0.2 % between two clocks are 0.4 periods then."""
_GAIN = 0.05  # of the loop that follows the clock of the sender: the jitter of the bus is averaged


class FrameClock:
    """Follows the sender's clock, so that two clocks of different speed cause neither losses nor repeats.

    Parameters
    ----------
    rate_hz
        Frames per second, within 0.5 % of the true rate: then the due time lags by at most 0.1 periods.
    """

    def __init__(self, rate_hz: float) -> None:
        self._period_s = 1 / rate_hz
        self._due_s: float | None = None
        self.number = 0
        """Number of the newest frame."""

    @property
    def paused_s(self) -> float:
        """Time after the newest frame from which numbers are no longer certain."""
        return PAUSE_PERIODS * self._period_s

    @property
    def newest_s(self) -> float | None:
        """Time at which the newest frame was due, by all before it."""
        return self._due_s

    def add(self, time_s: float) -> bool:
        """Whether a frame at this time has a certain number, which is then `number`."""
        if self._due_s is None:
            self._due_s = time_s
            return True
        steps_exact = (time_s - self._due_s) / self._period_s
        steps = round(steps_exact)
        if steps < 1 or abs(steps_exact - steps) > TOLERANCE:
            return False
        self.number += steps
        self._due_s += steps * self._period_s
        self._due_s += _GAIN * (time_s - self._due_s)
        return True


Identity = tuple[int, bool]
"""Identifier of a frame, and whether it is extended."""
INCOMPLETE_MAX = 256
"""Samples of which some frames have arrived."""
SETTLED = 32
"""Frames of each message after which their order in a period is known."""
UNCERTAIN_MAX = 8
"""Frames without a certain number, one after the other, after which numbering begins again."""
_LISTED = 20


class Signal(NamedTuple):
    """A channel, and the message and the signal in it."""

    channel: Channel
    identity: Identity
    name: str


def signals_of(headings: list[str], messages: Mapping[Identity, Any], dbc: Path | None) -> list[Signal]:
    """The signal of each channel, named Message.Signal, or by the signal alone where one message has it.

    Raises
    ------
    ConfigError
        If no channel is named, or one is not in the DBC, in several messages, or multiplexed.
    """
    by_name: dict[str, list[Signal]] = {}
    for identity, message in messages.items():
        for signal in () if message.is_multiplexed() else message.signals:
            for name in (signal.name, f"{message.name}.{signal.name}"):
                by_name.setdefault(name, []).append(Signal(Channel(name, signal.unit or ""), identity, signal.name))
    full = sorted(name for name in by_name if "." in name)
    if not headings:
        raise ConfigError(
            "key-missing",
            "can needs source.channels, which names signals of the DBC",
            f"choose from {', '.join(full[:_LISTED])}" if full else f"check {dbc}, which defines no signal",
            key="source",
            keys=["channels"],
        )
    return [_signal(heading, by_name, full) for heading in headings]


def _signal(heading: str, by_name: dict[str, list[Signal]], full: list[str]) -> Signal:
    name, unit = split_unit(heading)
    same = by_name.get(name, [])
    if len(same) != 1:
        wrong = f"is a signal of {len(same)} messages" if same else "is not a signal of the DBC, or is multiplexed"
        remedy = f"write {' or '.join(f for f in full if f.endswith('.' + name))}" if same else nearest_name(name, full)
        raise ConfigError(
            "value-invalid", f"source.channels: {name!r} {wrong}", remedy, key="source.channels", channel=name
        )
    return same[0]._replace(channel=Channel(name, unit)) if unit else same[0]


class CanSamples:
    """Puts frames together to samples.

    With a counter, all channels are in its message, and each frame is a sample. Otherwise each message has a clock,
    and a sample consists of frames that belong to the same period.

    Parameters
    ----------
    signals
        A signal for each channel.
    messages
        Those of the DBC.
    rate_hz
        Samples per second.
    counter
        Name of the channel that counts the samples.
    epoch
        Of the first sample.
    """

    def __init__(
        self, signals: list[Signal], messages: Mapping[Identity, Any], rate_hz: float, counter: str | None, epoch: int
    ) -> None:
        self.signals, self._rate_hz, self._epoch = signals, rate_hz, epoch
        self._messages = {signal.identity: messages[signal.identity] for signal in signals}
        self._places: dict[Identity, list[tuple[int, str]]] = {identity: [] for identity in self._messages}
        for place, signal in enumerate(signals):
            self._places[signal.identity].append((place, signal.name))
        self._counted = None if counter is None else counted_signal(signals, counter, self._messages)
        modulus = None if self._counted is None else modulus_of(self._counted, self._messages)
        self._counter = None if modulus is None else Counter(rate_hz, modulus, epoch)
        self.problems: list[object] = []
        """What was wrong with frames since this was cleared."""
        self._begin()

    @property
    def channels(self) -> tuple[Channel, ...]:
        return tuple(signal.channel for signal in self.signals)

    @property
    def identities(self) -> frozenset[Identity]:
        """The messages that belong to a sample."""
        return frozenset(self._messages)

    def described(self) -> str:
        """The messages, for a person."""
        return ", ".join(f"{message.name} (0x{number:X})" for (number, _), message in self._messages.items())

    def restart(self) -> None:
        """The connection was lost: without a counter, the length of the gap is not known."""
        if self._counter is None:
            self._epoch += 1
            self._begin()

    def _begin(self) -> None:
        self._clocks = {identity: FrameClock(self._rate_hz) for identity in self._messages}
        self._frames = dict.fromkeys(self._messages, 0)
        self._uncertain = 0
        self._offsets: dict[Identity, int] | None = None
        self._waiting: dict[int, dict[int, float]] = {}

    def process(self, identity: Identity, data: bytes, time_s: float) -> list[NumberedSample]:
        """The samples that are certain with this frame, which was received at `time_s`.

        Raises
        ------
        SourceError
            If the frame is shorter than the DBC says, or its signals cannot be decoded.
        """
        values = self._decoded(identity, data)
        if self._counter is not None and self._counted is not None:
            row = np.array([values[signal.name] for signal in self.signals], dtype=np.float64)
            samples = self._counter.process(int(values[self._counted.name]), time_s, row)
            if self._counter.damaged:
                self.problems.append(f"{self._counter.damaged} frames had a counter that no other frame confirmed")
                self._counter.damaged = 0
            return samples
        return self._timed(identity, values, time_s)

    def _decoded(self, identity: Identity, data: bytes) -> dict[str, float]:
        message = self._messages[identity]
        if len(data) < message.length:
            raise SourceError(
                "frame-damaged",
                f"a frame of message {message.name} has {len(data)} bytes, the DBC defines {message.length}",
                "check that the DBC belongs to the device",
                bytes=len(data),
            )
        try:
            return dict(message.decode(data[: message.length], decode_choices=False))
        except Exception as error:  # cantools raises many kinds
            raise SourceError(
                "frame-damaged",
                f"a frame of message {message.name} cannot be decoded: {type(error).__name__}",
                "check that the DBC belongs to the device",
            ) from None

    def _timed(self, identity: Identity, values: dict[str, float], time_s: float) -> list[NumberedSample]:
        clock = self._clocks[identity]
        if clock.newest_s is not None and time_s - clock.newest_s > clock.paused_s:
            self.problems.append(f"no {self._messages[identity].name} for {time_s - clock.newest_s:.3g} s")
            self.restart()
            clock = self._clocks[identity]
        if not clock.add(time_s):
            self._doubt(identity)
            return []
        self._uncertain = 0
        self._frames[identity] += 1
        if self._offsets is None:
            self._settle()
            return []
        number = clock.number + self._offsets[identity]
        sample = self._waiting.setdefault(number, {})
        sample.update((place, values[name]) for place, name in self._places[identity])
        return self._complete(number, sample)

    def _doubt(self, identity: Identity) -> None:
        self.problems.append(
            f"a frame of message {self._messages[identity].name} is more than 0.4 periods from its due time: its "
            "number is not certain; check source.rate_hz, or let the device send a counter"
        )
        self._uncertain += 1
        if self._uncertain >= UNCERTAIN_MAX:
            self.restart()

    def _settle(self) -> None:
        """Relate the numbers of all messages, when the clock of each has settled."""
        if min(self._frames.values()) < SETTLED:
            return
        first = next(iter(self._clocks.values()))
        assert first.newest_s is not None
        self._offsets = {}
        for identity, clock in self._clocks.items():
            assert clock.newest_s is not None
            apart = round((clock.newest_s - first.newest_s) * self._rate_hz)
            self._offsets[identity] = apart - (clock.number - first.number)

    def _complete(self, number: int, sample: dict[int, float]) -> list[NumberedSample]:
        if len(sample) < len(self.signals):
            while len(self._waiting) > INCOMPLETE_MAX:
                del self._waiting[min(self._waiting)]
            return []
        # Frames of a bus are in order, so what is incomplete and older is lost.
        self._waiting = {later: values for later, values in self._waiting.items() if later > number}
        row = np.array([sample[place] for place in range(len(self.signals))], dtype=np.float64)
        return [NumberedSample(self._epoch, number, row)]


def counted_signal(signals: list[Signal], counter: str, messages: Mapping[Identity, Any]) -> Signal:
    """The signal of the counter; ConfigError if it is not a channel, or another channel is in another message."""
    counted = next((signal for signal in signals if signal.channel.name == counter), None)
    if counted is None:
        raise ConfigError(
            "value-invalid",
            f"source.counter = {counter!r} is not one of source.channels",
            f"name one of {', '.join(signal.channel.name for signal in signals)}, or remove it",
            key="source.counter",
            value=counter,
        )
    other = next((signal for signal in signals if signal.identity != counted.identity), None)
    if other is not None:
        raise ConfigError(
            "value-invalid",
            f"source.counter = {counter!r} counts the frames of {messages[counted.identity].name}, but the channel "
            f"{other.channel.name!r} is in {messages[other.identity].name}",
            "remove it: frames of several messages are put together by their times",
            key="source.counter",
            value=counter,
        )
    return counted


def modulus_of(signal: Signal, messages: Mapping[Identity, Any]) -> int:
    """Number of values of a counter, by the number of bits in the DBC; ConfigError if it is not of whole numbers."""
    defined = messages[signal.identity].get_signal_by_name(signal.name)
    if defined.is_float or defined.scale != 1 or defined.offset != 0:
        raise ConfigError(
            "value-invalid",
            f"source.counter = {signal.channel.name!r} is not a signal of whole numbers in the DBC",
            "name one without scale, or remove it",
            key="source.counter",
            value=signal.channel.name,
        )
    return 1 << int(defined.length)
