"""The whole program: excitation, plant, spectra, ring, and livebode's ADS source behind it."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from pyads import constants
from pyads.testserver import PLCVariable

from livebode.core import Lines
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.sources.live import SourceSettings, named_channels, open_source
from livebode_drives.live.ads import FILETIME_1970, HEADER, new_rows, read_ring, ring_batch
from livebode_drives.structured_text.project import Project
from tests.support.peers.peer import PATIENCE_S, Feeding
from tests.support.peers.plc import AdsPeer
from tools.structured_text import Instance, Machine
from tools.structured_text.types import ULINT

LINES = Lines((1, 3, 4), 20, rate_hz=1000.0)
PROJECT = Project(multisine(LINES, 0.3), 2.0, LINES, ["w", "u", "y"], "w", ["w", "u", "y"], ring_length=512)
POLE, GAIN, CYCLES = 0.5, 2.0, 2000


class Axis:
    """The generated program on a controller, and the plant y' = POLE·y + GAIN·w that it drives, cycle by cycle."""

    def __init__(self) -> None:
        self._cycle, self._y = 0, 0.0
        machine = Machine(*PROJECT.files().values(), functions={"F_GETSYSTEMTIME": (ULINT, self._clock)})
        self.program = machine.instance("MAIN")
        self.ring = Instance(machine.units["st_livebodering"], self.program.memory.v_livebode)
        self.dft = Instance(machine.units["fb_slidingdft"], self.program.memory.v_fbslidingdft)
        self.program["enable"] = True

    def _clock(self) -> int:
        return FILETIME_1970 + 10_000 * self._cycle + 12_345

    def run(self, cycles: int) -> None:
        for _ in range(cycles):
            # What the drive does is known a cycle later than what is asked of it, as on a fieldbus.
            self.program["u"], self.program["y"] = self.program["w"], self._y
            self._y = POLE * self._y + GAIN * self.program["u"]
            self.program()
            self._cycle += 1


def truth() -> np.ndarray:
    """u to y: a delay of one cycle is in the plant."""
    z = np.exp(2j * np.pi * np.array(LINES.bins) / LINES.window)
    return GAIN / (z - POLE)


def test_spectra_on_the_controller_are_the_plants_response() -> None:
    axis = Axis()
    axis.run(CYCLES)
    u, y = axis.dft["re"][1:] + 1j * axis.dft["im"][1:]
    np.testing.assert_allclose(y / u, truth(), rtol=1e-12)


def test_the_ring_contains_the_samples_of_the_program_and_the_counter_marks_the_periods() -> None:
    axis = Axis()
    axis.run(CYCLES)
    raw = axis.ring.bytes()
    ring, dtype = read_ring(raw, len(raw))
    assert (ring.count, ring.channels, ring.length, ring.rate_hz) == (CYCLES, 4, 512, 1000.0)
    assert ring.epoch == (FILETIME_1970 + 12_345) // 10_000 % (2**32 - 1) + 1
    channels = named_channels(list(PROJECT.columns))
    period = multisine(LINES, 0.3)
    rows = 0
    for first, last in new_rows(ring, None):
        at = HEADER.size + first % ring.length * ring.channels * 8
        batch = ring_batch(raw[at : at + (last - first) * ring.channels * 8], first, ring, ring, dtype, channels)
        w, _, _, sample = batch.data
        np.testing.assert_array_equal(sample, np.arange(first, last))
        np.testing.assert_array_equal(w, period[sample.astype(int) % LINES.window])
        rows += last - first
    assert rows == 511


class Controller(AdsPeer):
    """The program's own memory behind an ADS server."""

    def _prepare(self) -> None:
        self.settings |= {"channels": list(PROJECT.columns)}
        self.axis = Axis()
        self._variable = PLCVariable("MAIN.livebode", self.axis.ring.bytes(), constants.ADST_BIGTYPE, "ST_LivebodeRing")
        self._memory.add_variable(self._variable)

    def play(self, cycles: int) -> None:
        for _ in range(0, cycles, 50):
            self.axis.run(50)
            with self._memory.lock:
                self._variable.value = self.axis.ring.bytes()
            time.sleep(0.005)


def test_livebode_follows_the_program_over_ads(tmp_path: Path) -> None:
    with Controller(tmp_path) as controller:
        settings = SourceSettings(**(controller.settings | {"timeout_s": PATIENCE_S}))
        tracker, responses = Tracker(Settings(lines=LINES, excitation="w", input="u", output="y")), []
        with Feeding(lambda: controller.play(CYCLES)) as feeding, open_source(settings) as source:
            for block in source.blocks(["w", "u", "y", "sample"]):
                responses += list(tracker.process(block))
                if block["sample"][-1] == CYCLES - 1:
                    break
            feeding.join()
    np.testing.assert_allclose(responses[-1].value, truth(), rtol=1e-12)
