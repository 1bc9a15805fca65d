"""Margins are those of python-control on the same sampled loop, and their bounds hold."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from livebode.margins import Margins, margins
from livebode.nouns import PID, InputError, Loop
from tests.loops import BELT, MODEL, Case, parameters

BAND_HZ = (20.0, 140.0)


def read(case: Case) -> Margins:
    return margins(parameters(case.belt[np.newaxis]), case.open, BAND_HZ)


@st.composite
def cases(draw: st.DrawFn) -> Case:
    """Resonances from 20 to 400 Hz, hardly damped to well damped, from an idle loop to one that is unstable."""
    js, load = draw(st.floats(5e-4, 2e-2)), draw(st.floats(1.0, 40.0))
    shaft = load * 0.019**2
    omega = 2 * np.pi * draw(st.floats(20.0, 400.0))
    reduced = js * shaft / (js + shaft)
    stiffness = reduced * omega**2
    damping = 2 * draw(st.floats(0.01, 0.3)) * reduced * omega
    crossover = 2 * np.pi * draw(st.floats(3.0, 300.0))
    return Case(
        belt=np.array([js, load, stiffness / 0.019**2, damping / 0.019**2]),
        gain=(js + shaft) * crossover,
        integral_time_s=draw(st.sampled_from([1.0, 0.2, 0.02])),
        position_gain=draw(st.sampled_from([1.0, 10.0])),
        delay_ticks=draw(st.integers(0, 4)),
    )


@settings(max_examples=25, deadline=None)
@given(cases())
def test_margins_are_those_of_python_control(case: Case) -> None:
    assume(abs(case.largest_pole - 1) > 1e-5)
    found = read(case)
    assert found.ok[0] == (case.largest_pole < 1)
    if not found.ok[0]:
        return
    # Its polynomial method finds crossings that are none, from the poles near z = 1; on a fine response it is right.
    omega = 2 * np.pi * np.geomspace(0.05, 1999.9, 6000)
    measured = control.frd(case.response(omega / 2 / np.pi), omega, smooth=True)
    gains, turns, distances, _, at_gain, _ = control.stability_margins(measured, returnall=True)
    end = case.response(np.array([2000.0])).real
    gains = np.append(gains, -1 / end[end < 0])
    up, down = gains[gains > 1], gains[gains < 1]
    late = np.radians(turns % 360) / at_gain
    one = dict(zip(found.names, found.value[0]))
    assert one["gain_margin"] == pytest.approx(20 * np.log10(up.min()) if up.size else np.inf, rel=1e-4)
    assert one["gain_reduction"] == pytest.approx(-20 * np.log10(down.max()) if down.size else np.inf, rel=1e-4)
    assert abs(one["phase_margin"]) == pytest.approx(np.abs(turns).min(), rel=1e-4)
    assert one["delay_margin"] == pytest.approx(1e3 * late.min(), rel=1e-4)
    inside = 1 / np.append(distances, np.abs(1 + end))
    assert one["peak_sensitivity"] == pytest.approx(inside.max(), rel=1e-4)


@settings(max_examples=25, deadline=None)
@given(cases())
def test_peak_and_bandwidth_are_those_of_a_fine_comb(case: Case) -> None:
    found = read(case)
    assume(found.ok[0])
    f = np.geomspace(1e-2, 2000, 100_000)
    value = case.open.at(parameters(case.belt[np.newaxis]).value, f)[0]
    assert found.of("peak_sensitivity")[0] == pytest.approx(np.max(1 / np.abs(1 + value)), rel=1e-5)
    below = np.flatnonzero(np.abs(value / (1 + value)) < 10 ** (-3 / 20))
    assert found.of("bandwidth")[0] == pytest.approx(f[below[0]], rel=3e-4)
