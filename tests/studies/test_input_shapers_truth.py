"""Input shapers: their residual by simulation, over the whole range of a mode, and in the simulated belt axis."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from livebode.simulation import BeltAxis, Drive, Friction, Limits, SimulatedAxis, Strokes
from livebode_control.tuning.input_shaper import InputShaper, ModeRange, chosen, ei, optimised, shapers, zv, zvd
from livebode_control.tuning.shaper_text import c_header, klipper_text, structured_text

RATE_HZ = 4000.0


def simulated_residual(shaper: InputShaper, frequency_hz: float, damping: float) -> float:
    """Vibration after the last impulse, over that of one impulse at that time: from the decaying oscillation itself."""
    omega = 2 * np.pi * frequency_hz
    end = shaper.duration_s
    t = end + np.linspace(0, 2 / frequency_hz, 4001)
    turn = omega * np.sqrt(1 - damping**2)
    y = sum(
        a * np.exp(-damping * omega * (t - at)) * np.exp(1j * turn * (t - at))
        for a, at in zip(shaper.amplitudes, shaper.times_s)
    )
    alone = np.exp(-damping * omega * (t - end))
    return float(np.max(np.abs(np.real(y)) / alone))


@given(st.floats(5, 200), st.floats(0, 0.2), st.floats(0.8, 1.25))
@settings(max_examples=30, deadline=None)
def test_the_residual_is_that_of_the_oscillation(frequency_hz: float, damping: float, ratio: float) -> None:
    for kind in (zv, zvd, ei):
        one = kind(frequency_hz, damping)
        assert sum(one.amplitudes) == pytest.approx(1)
        found = float(one.residual(ratio * frequency_hz, damping))
        assert simulated_residual(one, ratio * frequency_hz, damping) == pytest.approx(found, abs=1e-4)
    assert float(zv(frequency_hz, damping).residual(frequency_hz, damping)) < 1e-9
    assert float(zvd(frequency_hz, damping).residual(frequency_hz, damping)) < 1e-9


@pytest.mark.parametrize("mode", [ModeRange(40, 46, 0.03, 0.05), ModeRange(33, 60, 0.02, 0.06)])
def test_the_optimised_shaper_keeps_the_tolerance_over_the_range_and_is_the_shortest(mode: ModeRange) -> None:
    best = optimised(mode)
    rng = np.random.default_rng(0)
    f = rng.uniform(mode.low_hz, mode.high_hz, 2000)
    d = rng.uniform(mode.low_damping, mode.high_damping, 2000)
    assert best.residual(f, d).max() <= 0.0525
    found = shapers(mode)
    assert chosen(found).kind == "optimised"
    assert all(one.duration_s > best.duration_s for one in found if one.worst <= 0.05 and one.kind != "optimised")


@dataclass(frozen=True)
class Shaped:
    """A motion whose references pass through a shaper."""

    strokes: Strokes
    shaper: InputShaper

    def cycle(self, rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
        taps = self.shaper.taps(rate_hz)
        rows = self.strokes.cycle(rate_hz)
        return tuple(row[0] + signal.lfilter(taps, 1.0, row - row[0]) for row in rows)  # type: ignore[return-value]

    def check(self, limits: Limits) -> None:
        self.strokes.check(limits)


def test_in_the_simulated_axis_the_load_swings_no_more_than_predicted() -> None:
    """A stiff drive moves the motor; the load swings at the antiresonance, 53 Hz at 0.5 m … 43 Hz at 0.8 m."""
    drive = Drive(velocity_gain_n_m_s=4.0, integral_time_s=0.05, position_gain_per_s=100.0, position_rate_hz=RATE_HZ)
    axis = BeltAxis(drive=drive, friction=Friction(motor_coulomb_n_m=0.05, load_viscous_n_s_per_m=2.0))
    hz = [float(np.sqrt(axis.mechanics.stiffness_at(x) / 6.7) / 2 / np.pi) for x in (0.8, 0.5)]
    mode = ModeRange(0.98 * hz[0], 1.02 * hz[1], 0.03, 0.05)
    one = chosen(shapers(mode))
    for end in (0.5, 0.65, 0.8):
        swings = []
        plain = Strokes(start_m=1.0, end_m=end, speed_m_per_s=1.0, acceleration_m_per_s2=40.0, dwell_s=0.25)
        for motion in (plain, Shaped(plain, one)):
            position, _ = motion.cycle(RATE_HZ)
            until = position.size // 2 + round(0.24 * RATE_HZ)  # before the return stroke
            _, truth = SimulatedAxis(replace(axis, motion=motion, seconds=until / RATE_HZ)).run()
            stop = int(np.flatnonzero(np.abs(np.diff(position[:until])) > 1e-12)[-1]) + 2
            later = stop + round(0.05 * RATE_HZ)  # after five time constants of the position controller
            swing = (truth.position_m - 0.019 * truth.states[0])[later : later + round(0.1 * RATE_HZ)]
            swings.append(np.ptp(swing))
        assert swings[1] < (one.worst + 0.02) * swings[0]


def test_the_header_and_the_printer_text_have_the_impulses(tmp_path: Path) -> None:
    one = ei(43.0, 0.04)
    assert "shaper_type_y: ei\nshaper_freq_y: 43.00\ndamping_ratio_y: 0.0400" in klipper_text(one, "y")
    assert "MOD" in structured_text(one, RATE_HZ)
    gcc = shutil.which("gcc")
    if gcc is None:
        pytest.skip("gcc is not installed")
    (tmp_path / "shaper.h").write_text(c_header(one, RATE_HZ))
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "shaper.h"\nint main(void) {\n'
        "double m[LIVEBODE_SHAPER_SAMPLES] = {0};\nint n = 0;\n"
        'for (int i = 0; i < 200; i++) {\nprintf("%.17g\\n", livebode_shape(m, &n, i * i));\n}\nreturn 0;\n}\n'
    )
    built = tmp_path / "main"
    subprocess.run(
        [gcc, "-std=c99", "-Wall", "-Wextra", "-Werror", str(tmp_path / "main.c"), "-o", str(built)], check=True
    )
    found = np.array(subprocess.run([str(built)], check=True, capture_output=True, text=True).stdout.split(), float)
    np.testing.assert_allclose(found, signal.lfilter(one.taps(RATE_HZ), 1.0, np.arange(200.0) ** 2), rtol=1e-12)
