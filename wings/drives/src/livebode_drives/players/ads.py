"""Beckhoff ADS: the program of `livebode plc` plays; livebode sets its variables."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, TypeVar

from livebode.core import MeasurementError
from livebode.excitation import Waveform
from livebode.sources.live import LiveSource, MeasureSection, Player
from livebode_drives.live.ads import AdsSource, import_pyads

EVERY_S = 0.1
REACTION_S = 0.3
_RATE_SHARE = 1e-6
T = TypeVar("T")


class AdsPlayer(Player):
    """Sets `enable` of the program that contains the ring. Its `watch` ends the excitation without livebode."""

    def __init__(self, source: LiveSource, section: MeasureSection, excitation: str) -> None:  # noqa: ARG002
        assert isinstance(source, AdsSource)
        self.source, self.stop_s = source, 0.0
        self._watch_s = section.silence_s
        self._pyads: Any = import_pyads()
        settings = source.settings
        self._symbol = settings.symbol or ""
        self._program = self._symbol.rpartition(".")[0]
        address = f"{source.address.host}:{source.address.port}"
        self._plc: Any = self._pyads.Connection(settings.net_id, settings.ams_port, address)
        self._opened = self._started = False
        self._watch, self._written_s = 0, 0.0

    def check(self, waveform: Waveform) -> str:
        """The program is that of `livebode plc`, at rest, and its task has the rate of the design."""
        self._open()
        try:
            rate_hz = float(self._read(f"{self._symbol}.rate_hz", "LREAL"))
            busy = [name for name in ("enable", "stop") if self._read(f"{self._program}.{name}", "BOOL")]
            self._read(f"{self._program}.watch", "UDINT")
        finally:
            self._close()
        lines = waveform.lines
        if abs(rate_hz - lines.rate_hz) > _RATE_SHARE * lines.rate_hz:
            raise self._wrong(
                f"the task of the PLC runs at {rate_hz:.9g} Hz, but the excitation is for {lines.rate_hz:.9g} Hz",
                "design it for the rate of the task",
            )
        if busy:
            raise self._wrong(f"{self._program}.{busy[0]} is TRUE", "set it to FALSE in the PLC")
        self._watch = max(1, round(self._watch_s * rate_hz))
        # To the end of the period, and the ramp of the function block.
        self.stop_s = REACTION_S + (1 + waveform.ramp_periods) * lines.window / lines.rate_hz
        return f"{self._program} plays its table; it ramps down {self._watch_s:g} s after livebode's last sign of life"

    def start(self, waveform: Waveform) -> None:  # noqa: ARG002
        """The function block begins at the border of a period."""
        self._open()
        self._started = True
        self._write("watch", self._watch, "UDINT")
        self._write("enable", True, "BOOL")

    def keep(self, played: int) -> None:  # noqa: ARG002
        """A sign of life."""
        if self._started and time.monotonic() - self._written_s > EVERY_S:
            self._write("watch", self._watch, "UDINT")
            self._written_s = time.monotonic()

    def ramp_down(self) -> None:
        """The function block plays the period to its end, then its ramp."""
        if self._started:
            self._started = False
            self._write("enable", False, "BOOL")

    def off(self) -> None:
        """The excitation is zero in the next cycle."""
        if self._opened:
            self._write("stop", True, "BOOL")

    def close(self) -> None:
        """`stop` is reset: without `enable` the excitation stays zero."""
        if not self._opened:
            return
        try:
            self._started = True
            self.ramp_down()
            self._write("stop", False, "BOOL")
        finally:
            self._close()

    def _open(self) -> None:
        self._asked(self._plc.open)
        self._opened = True

    def _close(self) -> None:
        self._opened = False
        self._plc.close()

    def _read(self, name: str, kind: str) -> Any:
        return self._asked(lambda: self._plc.read_by_name(name, getattr(self._pyads, f"PLCTYPE_{kind}")), name)

    def _write(self, name: str, value: object, kind: str) -> None:
        name = f"{self._program}.{name}"
        self._asked(lambda: self._plc.write_by_name(name, value, getattr(self._pyads, f"PLCTYPE_{kind}")), name)

    def _asked(self, ask: Callable[[], T], name: str = "the PLC") -> T:
        try:
            return ask()
        except (self._pyads.ADSError, RuntimeError, OSError) as error:
            raise self._wrong(
                f"{name}: {' '.join(str(error).split())}"[:200],
                "check the connection, and that the program was written by this version of `livebode plc`",
            ) from None

    def _wrong(self, message: str, remedy: str) -> MeasurementError:
        return MeasurementError("not-connected", message, remedy, player=self._program)
