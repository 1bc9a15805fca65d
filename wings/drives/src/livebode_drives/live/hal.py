"""LinuxCNC HAL: samples of the real-time component `sampler`, which the program halsampler writes to a pipe."""

from __future__ import annotations

import os
import re
import select
import subprocess
import time
from collections.abc import Iterator
from itertools import pairwise
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from livebode.core import Channel, ConfigError, SourceError, nearest_name
from livebode.dataclass import dataclass
from livebode.sources.live import SAMPLE_MAX, TICK_S, Address, Batch, LiveSource, Reach, named_channels
from livebode_drives.live.hal_wiring import (
    SAMPLER_KEY,
    Fifo,
    fifo,
    last_line,
    period_ns,
    pin_value,
    program,
    signals_at,
)
from livebode_drives.source_settings import DriveKeys

ALIVE_S = 1.0
"""Silence after which it is checked whether the real-time part still runs."""
_PIECE_BYTES = 1 << 16
_ADDRESS = re.compile(r"sampler\.([0-7])")


@dataclass(frozen=True)
class Wiring:
    """How a sampler is connected.

    Attributes
    ----------
    epoch
        When it was loaded, in seconds since 1970.
    rate_hz
        Rate of its thread.
    pins
        Number of its pins.
    count, rows
        Pin of the counter, and of each channel.
    channels
        The channels.
    """

    epoch: int
    rate_hz: float
    pins: int
    count: int
    rows: tuple[int, ...]
    channels: tuple[Channel, ...]


class HalSource(LiveSource):
    """Signals of HAL at the pins of a `sampler`; one of them counts the periods of the thread.

    The numbers of halsampler count only the samples that it delivers, so they do not show a loss.
    """

    settings: DriveKeys
    format: ClassVar[str] = "hal"
    waits: ClassVar[bool] = True

    def __init__(self, settings: DriveKeys, address: Address) -> None:
        super().__init__(settings, address)
        parts = _ADDRESS.fullmatch(address.path)
        if parts is None:
            raise ConfigError(
                "value-invalid",
                f"source.url = {str(address)[:80]!r} names no sampler of HAL",
                "give one such as hal:sampler.0",
                key="source.url",
            )
        if settings.sample_signal is None:
            raise ConfigError(
                "key-missing",
                "hal needs source.sample_signal, the signal that counts the periods of the thread",
                "add a counter; wings/drives/docs/linuxcnc.md has its four lines",
                key="source",
                keys=["sample_signal"],
            )
        self._number = int(parts[1])
        self._sampler = f"sampler.{self._number}"
        self._wanted = named_channels(settings.channels)

    def wiring(self) -> Wiring:
        """How the sampler is connected now.

        Raises
        ------
        ConnectionError
            If LinuxCNC does not run, or another program reads the sampler.
        SourceError
            With the code "refused" if a signal is missing, or LinuxCNC is not installed.
        """
        memory = self._running(1)
        rate_hz = 1e9 / period_ns(self._sampler)
        signals = signals_at(self._sampler)
        count, rows = self._position(self.settings.sample_signal, signals), self._rows(signals)
        channels = self._wanted or tuple(Channel(signals[row], "") for row in rows)
        return Wiring(memory.created_s, rate_hz, len(signals), count, tuple(rows), channels)

    def reach(self) -> Reach:
        facts = {"address": str(self.address)}
        try:
            wiring = self.wiring()
        except OSError as error:
            return Reach("failed", f"{self.address}: {error}", "check LinuxCNC on this computer", facts)
        names = ", ".join(channel.name for channel in wiring.channels)
        return Reach("ok", f"{self.address} samples {names} at {wiring.rate_hz:.9g} Hz", facts=facts)

    def _receive(self) -> bool:
        wiring = self.wiring()
        # What waited before a record begins is older than it; of one that continues it is a part.
        stale = 0 if self._received or self._resumed is not None else int(pin_value(f"{self._sampler}.curr-depth"))
        command = [program("halsampler"), "-c", str(self._number)]
        # In a session of its own: Ctrl-C on the terminal ends livebode, which then ends it.
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True
        ) as sampler:
            try:
                self._established()
                self._announce(wiring.channels, wiring.rate_hz)
                for values in begun_by_two(self._tables(sampler, SampleText(wiring.pins, stale))):
                    for first, data in self._spans(values, wiring.count):
                        taken = data[list(wiring.rows)]
                        self._deliver(Batch(first, taken, wiring.channels, wiring.rate_hz, wiring.epoch))
            finally:
                sampler.terminate()
        return False

    def _running(self, users: int) -> Fifo:
        """The FIFO with so many users; ConnectionError if the real-time part is not there, or another reads, too."""
        ring = fifo(SAMPLER_KEY + self._number)
        if ring is None:
            raise ConnectionError(f"no {self._sampler} is loaded: start LinuxCNC, or halcmd loadrt sampler")
        if ring.users < users:
            raise ConnectionError(f"the real-time part of LinuxCNC has ended (rtapi_app, which runs {self._sampler})")
        if ring.users > users:
            raise ConnectionError(f"another program reads {self._sampler}: end the other halsampler")
        return ring

    def _position(self, name: str | None, signals: list[str]) -> int:
        if name not in signals:
            named = [signal for signal in signals if signal]
            raise SourceError(
                "refused",
                f"{self._sampler} has no signal {name!r} at its pins; it has {', '.join(named) or 'none'}",
                nearest_name(str(name), named) if named else "connect them: halcmd net SIGNAL sampler.0.pin.0",
                signal=name,
                signals=named,
            )
        return signals.index(name)

    def _rows(self, signals: list[str]) -> list[int]:
        """The pins of the channels; by default of all signals but the counter."""
        if self._wanted:
            return [self._position(channel.name, signals) for channel in self._wanted]
        return [row for row, signal in enumerate(signals) if signal not in ("", self.settings.sample_signal)]

    def _tables(self, sampler: subprocess.Popen[bytes], text: SampleText) -> Iterator[NDArray[np.float64]]:
        """What halsampler prints, shape (pins, samples); ConnectionError when it or the real-time part ended."""
        assert sampler.stdout is not None
        assert sampler.stderr is not None
        heard, number = time.monotonic(), sampler.stdout.fileno()
        while not self._stop.is_set():
            if not select.select([number], [], [], TICK_S)[0]:
                if time.monotonic() - heard > ALIVE_S:
                    self._running(2)
                    self._trouble = f"{self._sampler} takes no samples: halcmd start, and check {self._sampler}.enable"
                    heard = time.monotonic()
                continue
            heard, piece = time.monotonic(), os.read(number, _PIECE_BYTES)
            if not piece:
                why = last_line(sampler.stderr.read().decode("utf-8", "replace"))
                raise ConnectionError(f"halsampler ended{': ' if why else ''}{why}")
            try:
                values = text.table(piece)
            except SourceError as error:
                self._malformed(error)
                continue
            if values.size:
                yield values

    def _spans(self, values: NDArray[np.float64], count: int) -> list[tuple[int, NDArray[np.float64]]]:
        try:
            return consecutive(values, count)
        except SourceError as error:
            self._malformed(error)
            return []


def begun_by_two(tables: Iterator[NDArray[np.float64]]) -> Iterator[NDArray[np.float64]]:
    """The tables, the first joined with those behind it until it has two samples: one does not show that it counts.

    >>> one, three = np.zeros((4, 1)), np.zeros((4, 3))
    >>> [table.shape for table in begun_by_two(iter([one, three, one]))]
    [(4, 4), (4, 1)]
    """
    begun: list[NDArray[np.float64]] = []
    for table in tables:
        begun.append(table)
        if sum(part.shape[1] for part in begun) > 1:
            break
    if begun:
        yield np.concatenate(begun, axis=1)
    yield from tables


class SampleText:
    r"""The text of halsampler as numbers: a line for each sample, a number for each pin.

    Parameters
    ----------
    pins
        Number of pins.
    stale
        Number of samples at the beginning that are left out.

    Examples
    --------
    >>> text = SampleText(2)
    >>> text.table(b"overrun\n0.5 1 \n0.25 2"), text.table(b" \n")
    (array([[0.5],
           [1. ]]), array([[0.25],
           [2.  ]]))
    """

    def __init__(self, pins: int, stale: int = 0) -> None:
        self._pins, self._stale, self._rest = pins, stale, b""

    def table(self, piece: bytes) -> NDArray[np.float64]:
        """The samples that `piece` completes, shape (pins, samples); SourceError if they are not numbers.

        A line "overrun" is left out: halsampler prints it when it starts, and not where samples are missing.
        """
        ready, newline, remainder = piece.rpartition(b"\n")
        if not newline:
            ready, remainder = b"", self._rest + remainder
        else:
            ready = self._rest + ready
        self._rest = remainder[-_PIECE_BYTES:]
        words = ready.replace(b"overrun", b"").split()
        try:
            values = np.array([float(word) for word in words], dtype=np.float64).reshape(-1, self._pins)
        except ValueError:
            raise SourceError(
                "batch-shape",
                f"a line of halsampler does not have {self._pins} numbers",
                "load the sampler again, and start livebode after it",
                channels=self._pins,
            ) from None
        skipped = min(self._stale, len(values))
        self._stale -= skipped
        return values[skipped:].T


def consecutive(values: NDArray[np.float64], count: int) -> list[tuple[int, NDArray[np.float64]]]:
    """Spans without a gap: number of the first sample, and the samples. Row `count` has the number of each.

    >>> [(first, data.shape) for first, data in consecutive(np.array([[5.0, 6.0, 9.0]]), 0)]
    [(5, (1, 2)), (9, (1, 1))]

    Raises
    ------
    SourceError
        If these are not whole numbers, or do not count.
    """
    numbers = values[count]
    whole = bool(np.all((numbers >= 0) & (numbers < SAMPLE_MAX) & (np.floor(numbers) == numbers)))
    steps = np.diff(numbers) if whole else np.empty(0)
    if not whole or (steps.size and not steps.any()):
        raise SourceError(
            "value-invalid",
            "the signal that counts the periods does not count, or is not a whole number",
            "connect source.sample_signal to a counter, and call it in the same thread",
            key="source.sample_signal",
        )
    cuts = [0, *(np.flatnonzero(steps != 1) + 1).tolist(), numbers.size]
    return [(int(numbers[a]), values[:, a:b]) for a, b in pairwise(cuts)]
