"""The program of `livebode plc` on a controller that runs in time, with a first-order plant, behind an ADS server."""

from __future__ import annotations

import struct
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pyads import constants
from pyads.testserver import PLCVariable

from livebode.core import Lines
from livebode.sources.live import Batch
from livebode_drives.live.ads import FILETIME_1970
from livebode_drives.structured_text.project import Project
from tests.support.peers.plc import AdsPeer
from tools.structured_text import Instance, Machine
from tools.structured_text.types import ULINT

RATE_HZ = 1000.0
POLE, GAIN, NOISE = 0.5, 2.0, 0.01
FEEDBACK = 0.1
CYCLES = 20
"""That run together."""


def plant(frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
    """From u to y: y(n) is known a cycle after u."""
    z = np.exp(2j * np.pi * np.asarray(frequency_hz) / RATE_HZ)
    return np.asarray(GAIN / (z - POLE))


class PlcProgram(AdsPeer):
    """MAIN, cycle by cycle; `enable`, `stop` and `watch` can be written over ADS."""

    def __init__(self, folder: Path, period: NDArray[np.float64], lines: Lines, ramp_periods: int) -> None:
        super().__init__(folder)
        self._project = Project(
            period, 10.0, lines, ["w", "u", "y"], "w", ["w", "u", "y"], ring_length=1024, ramp_periods=ramp_periods
        )
        self.fault = 0.0
        """Added to y: what leads to a limit."""
        self.excitation: list[float] = []

    def _prepare(self) -> None:
        self.settings |= {"channels": ["w [N m]", "u [N m]", "y [rad/s]", "sample"]}
        self._cycle, self._y, self._ended = 0, 0.0, threading.Event()
        self._noise = np.random.default_rng(5)
        machine = Machine(
            *self._project.files().values(),
            functions={"F_GETSYSTEMTIME": (ULINT, lambda: FILETIME_1970 + 10_000 * self._cycle)},
        )
        self.program = machine.instance("MAIN")
        self._ring = Instance(machine.units["st_livebodering"], self.program.memory.v_livebode)
        self._image = self._variable("MAIN.livebode", self._ring.bytes(), constants.ADST_BIGTYPE)
        self._variable("MAIN.livebode.rate_hz", struct.pack("<d", RATE_HZ), constants.ADST_REAL64)
        self._written = {
            name: self._variable(f"MAIN.{name}", struct.pack(form, 0), kind)
            for name, form, kind in (
                ("enable", "<?", constants.ADST_BIT),
                ("stop", "<?", constants.ADST_BIT),
                ("watch", "<I", constants.ADST_UINT32),
            )
        }
        self._runner = threading.Thread(target=self._run, daemon=True)

    def _variable(self, name: str, value: bytes, kind: int) -> PLCVariable:
        # A group of its own: the ring's addresses would contain the other variables.
        group = 20_000 + len(self._memory._data)
        variable = PLCVariable(name, value, kind, "", index_group=group, index_offset=0)
        self._memory.add_variable(variable)
        return variable

    def __enter__(self) -> PlcProgram:
        super().__enter__()
        self._runner.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        self._runner.join()
        super().__exit__(*error)

    def _run(self) -> None:
        began = time.monotonic()
        while not self._ended.wait(0.005):
            while self._cycle + CYCLES <= (time.monotonic() - began) * RATE_HZ:
                with self._memory.lock:
                    self._take()
                    for _ in range(CYCLES):
                        self._one_cycle()
                    self._give()
                time.sleep(0.001)  # the server needs the lock

    def _one_cycle(self) -> None:
        self.program["y"] = self._y + self.fault
        self.program["u"] = self.program["w"] - FEEDBACK * self._y
        self._y = POLE * self._y + GAIN * self.program["u"] + float(self._noise.normal(0, NOISE))
        self.program()
        self.excitation.append(self.program["w"])
        self._cycle += 1

    def _take(self) -> None:
        self.program["enable"] = any(self._written["enable"].value)
        self.program["stop"] = any(self._written["stop"].value)
        self.program["watch"] = struct.unpack("<I", self._written["watch"].value)[0]

    def _give(self) -> None:
        self._image.value = self._ring.bytes()
        self._written["enable"].value = struct.pack("<?", self.program["enable"])
        self._written["watch"].value = struct.pack("<I", self.program["watch"])

    def write(self, name: str, value: bytes) -> None:
        """Set a variable of MAIN, as a client does."""
        with self._memory.lock:
            next(v for v in self._memory._data.values() if v.name == f"MAIN.{name}").value = value

    def send(self, batch: Batch) -> None:
        raise NotImplementedError

    def lose(self, lost: Sequence[Batch]) -> None:
        raise NotImplementedError
