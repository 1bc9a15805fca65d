"""LinuxCNC HAL: the samples go through halstreamer into the FIFO of the real-time component `streamer`."""

from __future__ import annotations

import os
import subprocess
import time

import numpy as np
from numpy.typing import NDArray

from livebode.core import MeasurementError
from livebode.dataclass import dataclass
from livebode.excitation import Waveform
from livebode.sources.live import LiveSource, MeasureSection, Player
from livebode_drives.live.hal import HalSource
from livebode_drives.live.hal_wiring import STREAMER_KEY, fifo, halcmd, links, pin_value, program


class Programme:
    """A period that is repeated until `stop`, with linear ramps at both ends; its last sample is zero.

    Parameters
    ----------
    period
        One period, shape (samples,).
    up, down
        Samples of the ramps.

    Examples
    --------
    >>> programme = Programme(np.array([1.0, -1.0]), up=2, down=2)
    >>> programme.stop(4)
    6
    >>> programme.samples(0, 100)
    array([ 0.5, -1. ,  1. , -1. ,  0.5, -0. ])
    """

    def __init__(self, period: NDArray[np.float64], up: int, down: int) -> None:
        self._period, self._up, self._down = period, up, down
        self._stop: int | None = None

    @property
    def length(self) -> int | None:
        """Number of samples; None before `stop`."""
        return None if self._stop is None else self._stop + self._down

    def stop(self, sample: int) -> int:
        """Begin the ramp down with sample `at`; only the first request counts. Returns the length."""
        self._stop = sample if self._stop is None else self._stop
        return self._stop + self._down

    def samples(self, first: int, last: int) -> NDArray[np.float64]:
        """Samples `first` to `last` - 1, fewer at the end."""
        number = np.arange(first, last if self.length is None else min(last, self.length))
        # A ramp up that is stopped does not rise further.
        risen = np.minimum((number if self._stop is None else np.minimum(number, self._stop)) + 1, self._up) / self._up
        played = self._period[number % self._period.size] * risen
        if self.length is not None:
            played *= np.clip((self.length - 1 - number) / self._down, 0.0, 1.0)
        return np.asarray(played)


REACTION_S = 0.3
"""From a sample in HAL to a request here, with the text that halsampler collects."""
_RATE_SHARE = 1e-6
_LOOK_S = 0.05


class HalPlayer(Player):
    """Sends the samples ahead by `lead_s`. When nothing is left, a mux2 in HAL makes the excitation zero."""

    def __init__(self, source: LiveSource, section: MeasureSection, excitation: str) -> None:
        assert isinstance(source, HalSource)
        self.source: HalSource = source
        self.stop_s = REACTION_S + section.lead_s + section.ramp_down_s
        self._section, self._excitation = section, excitation
        self._streamer = f"streamer.{section.streamer}"
        self._process: subprocess.Popen[bytes] | None = None
        self._programme: Programme | None = None
        self._sent, self._lead, self._waiting = 0, 0, b""
        self._guard = StreamerGuard("", "")
        self._off = False

    def check(self, waveform: Waveform) -> str:
        """The streamer is there, alone, and its end makes the excitation zero."""
        try:
            wiring = self.source.wiring()
            self._check_streamer()
            self._guard = self._found_guard()
        except OSError as error:
            raise self._wrong(str(error), "check LinuxCNC on this computer") from None
        rate_hz = waveform.lines.rate_hz
        if abs(wiring.rate_hz - rate_hz) > _RATE_SHARE * rate_hz:
            raise self._wrong(
                f"the thread of HAL runs at {wiring.rate_hz:.9g} Hz, but the excitation is for {rate_hz:.9g} Hz",
                "design it for the rate of the thread",
            )
        return f"{self._streamer} plays {self._excitation!r}; {self._guard.mux} makes it zero when it is empty"

    def _check_streamer(self) -> None:
        ring = fifo(STREAMER_KEY + self._section.streamer)
        if ring is None:
            raise self._wrong(f"no {self._streamer} is loaded", "load it, as in wings/drives/docs/linuxcnc.md")
        if ring.users > 1:
            raise self._wrong(f"another program plays through {self._streamer}", "end the other halstreamer")
        if pin_value(f"{self._streamer}.empty") != "TRUE" or pin_value(f"{self._streamer}.enable") != "TRUE":
            raise self._wrong(
                f"{self._streamer} is not empty, or not enabled", "wait until it has ended, and enable it"
            )

    def _found_guard(self) -> StreamerGuard:
        """The mux2 that makes the excitation zero; a streamer without one would hold its last value."""
        wiring = links()
        by_writer = {link.writer: link for link in wiring.values()}
        empty, played = by_writer.get(f"{self._streamer}.empty"), by_writer.get(f"{self._streamer}.pin.0")
        driver = wiring.get(self._excitation)
        if empty is not None and played is not None and driver is not None:
            mux = driver.writer.removesuffix(".out")
            guarded = f"{mux}.sel" in empty.readers and f"{mux}.in0" in played.readers
            if guarded and float(pin_value(f"{mux}.in1")) == 0.0:
                return StreamerGuard(mux, empty.name)
        raise self._wrong(
            f"the signal {self._excitation!r} does not become zero when {self._streamer} is empty",
            f"connect {self._streamer}.empty to the sel of a mux2 with out {self._excitation!r} and in1 zero, "
            "as in wings/drives/docs/linuxcnc.md",
        )

    def _wrong(self, message: str, remedy: str) -> MeasurementError:
        return MeasurementError("not-connected", message, remedy, player=self._streamer)

    def start(self, waveform: Waveform) -> None:
        """Fill the FIFO by the lead."""
        rate_hz, section = waveform.lines.rate_hz, self._section
        up, down = waveform.ramp_periods * waveform.lines.window, max(2, round(section.ramp_down_s * rate_hz))
        self._programme, self._lead = Programme(waveform.samples, up, down), round(section.lead_s * rate_hz)
        command = [program("halstreamer"), "-c", str(section.streamer)]
        # In a session of its own: Ctrl-C on the terminal must not end it before the ramp.
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )
        assert self._process.stdin is not None
        os.set_blocking(self._process.stdin.fileno(), False)
        self.keep(0)

    def keep(self, played: int) -> None:
        """Send what is due: `lead_s` beyond the last sample that was received."""
        if self._programme is None:
            return
        if (due := played + self._lead) > self._sent:
            text = self._programme.samples(self._sent, due)
            self._sent += text.size
            self._waiting += b"".join(b"%.17g\n" % value for value in text.tolist())
        self._write()

    def _write(self) -> None:
        if self._process is None or self._process.stdin is None or self._process.stdin.closed:
            return
        written = 0
        try:
            if self._waiting:
                written = os.write(self._process.stdin.fileno(), self._waiting)
        except BlockingIOError:
            return
        except BrokenPipeError:
            raise MeasurementError(
                "not-connected", f"halstreamer ended while it played through {self._streamer}",
                "check LinuxCNC; the excitation ended with it", player=self._streamer,
            ) from None  # fmt: skip
        self._waiting = self._waiting[written:]
        length = None if self._programme is None else self._programme.length
        if not self._waiting and length is not None and self._sent >= length:
            self._process.stdin.close()

    def ramp_down(self) -> None:
        """Send the whole ramp: from here on HAL does the rest."""
        if self._programme is None or self._programme.length is not None:
            return
        self.keep(self._programme.stop(self._sent) - self._lead)

    def off(self) -> None:
        """Switch the mux2 to zero; what is in the FIFO is played into nothing."""
        if self._process is None or self._off:
            return
        self._off = True
        try:
            halcmd("unlinkp", f"{self._guard.mux}.sel")
            halcmd("setp", f"{self._guard.mux}.sel", "1")
        except OSError as error:
            raise self._wrong(str(error), "switch the drive off") from None
        finally:
            self._process.terminate()

    def close(self) -> None:
        """Leave a ramp down to halstreamer, which ends when it has sent it."""
        if self._process is None:
            return
        self.ramp_down()
        self._finish(self._process)
        if self._off:
            self._connect_again()

    def _finish(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdin is not None
        try:
            if not process.stdin.closed:
                os.set_blocking(process.stdin.fileno(), True)
                while self._waiting:
                    self._write()
                process.stdin.close()
            process.wait(self.stop_s + 1.0)
        except (MeasurementError, BrokenPipeError):
            process.wait()
        except subprocess.TimeoutExpired:
            process.terminate()
            process.wait()

    def _connect_again(self) -> None:
        """Connect the mux2 as it was, once nothing is left that it would let through."""
        until = time.monotonic() + self.stop_s + 1.0
        try:
            while pin_value(f"{self._streamer}.empty") != "TRUE" and time.monotonic() < until:
                time.sleep(_LOOK_S)
            halcmd("net", self._guard.signal, f"{self._guard.mux}.sel")
        except OSError as error:
            raise self._wrong(
                f"{self._guard.mux}.sel is not connected again: {error}",
                f"halcmd net {self._guard.signal} {self._guard.mux}.sel",
            ) from None


@dataclass(frozen=True)
class StreamerGuard:
    """The mux2 that makes the excitation zero, and the signal at its `sel`."""

    mux: str
    signal: str
