"""FB_Multisine, parsed by blark and run: the period it was given, to the bit, and never more than its limit."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from livebode.core import Lines
from livebode.excitation import function_block, multisine
from tools.structured_text import Instance, Machine

WINDOW, LIMIT = 40, 2.0
PERIOD = multisine(Lines((1, 3, 7), WINDOW, rate_hz=1000.0), 0.5)
PEAK = float(np.max(np.abs(PERIOD)))


@cache
def machine(ramp_periods: int) -> Machine:
    return Machine(function_block(PERIOD, rate_hz=1000, limit=LIMIT, ramp_periods=ramp_periods))


def fresh(ramp_periods: int = 1, idle_periods: int = 2) -> Instance:
    block = machine(ramp_periods).instance("FB_Multisine")
    for _ in range(idle_periods * WINDOW):
        block()
        assert block["w"] == 0.0
    return block


def played(block: Instance, cycles: int, **given: object) -> tuple[np.ndarray, np.ndarray]:
    """w and steady of so many cycles."""
    found = []
    for _ in range(cycles):
        block(**given)
        found.append((block["w"], block["steady"]))
    w, steady = zip(*found)
    return np.array(w), np.array(steady)


@pytest.mark.parametrize("ramp_periods", [1, 3])
@pytest.mark.parametrize("scale", [1.0, -0.7])
def test_the_block_ramps_up_plays_the_period_to_the_bit_and_ramps_down(ramp_periods: int, scale: float) -> None:
    block, ramp = fresh(ramp_periods), ramp_periods * WINDOW
    played(block, 5)
    w, steady = played(block, WINDOW - 5, enable=True, scale=scale)
    assert not w.any()  # it waits for the period's border
    w, steady = played(block, ramp)
    assert not steady.any()
    np.testing.assert_allclose(w, np.resize(PERIOD, ramp) * scale * np.arange(ramp) / ramp, rtol=1e-14, atol=0)
    w, steady = played(block, 100 * WINDOW)
    assert steady.all()
    np.testing.assert_array_equal(w.reshape(-1, WINDOW), np.tile(PERIOD * scale, (100, 1)))
    w, steady = played(block, 7)
    w, steady = played(block, WINDOW - 7, enable=False)
    assert steady.all()  # the period is played to its end
    w, steady = played(block, ramp)
    assert not steady.any()
    np.testing.assert_allclose(w, np.resize(PERIOD, ramp) * scale * (1 - np.arange(ramp) / ramp), rtol=1e-14, atol=0)
    w, _ = played(block, 3 * WINDOW)
    assert not w.any()
    assert block["sample"] == (2 + 1 + ramp_periods + 100 + 1 + ramp_periods + 3) * WINDOW - 1


def test_no_line_drifts_and_no_power_lies_beside_the_lines() -> None:
    w, _ = played(fresh(), 203 * WINDOW, enable=True)
    spectrum = np.fft.rfft(w[-200 * WINDOW :])
    expected = np.zeros_like(spectrum)
    expected[::200] = np.fft.rfft(PERIOD) * 200
    np.testing.assert_allclose(spectrum, expected, atol=1e-11)


def test_stop_is_silence_at_once_and_a_start_needs_a_border() -> None:
    block = fresh()
    played(block, 3 * WINDOW + 11, enable=True)
    w, _ = played(block, 1, stop=True)
    assert not w.any()
    w, _ = played(block, WINDOW - 12, stop=False)
    assert not w.any()
    assert played(block, 2 * WINDOW)[1].any()


@pytest.mark.parametrize("scale", [LIMIT / PEAK * 1.0001, -1e300, np.nan, np.inf])
def test_a_scale_beyond_the_limit_is_refused_with_the_largest_that_is_not(scale: float) -> None:
    block = fresh()
    w, _ = played(block, 3 * WINDOW, enable=True, scale=scale)
    assert not w.any()
    assert block["refused"]
    assert LIMIT / PEAK * (1 - 2e-12) <= block["allowed"] <= LIMIT / PEAK
    played(block, 3 * WINDOW, scale=block["allowed"])
    assert block["steady"]
    assert not block["refused"]


def test_random_inputs_never_exceed_the_limit_and_periods_remain_on_the_grid() -> None:
    """Inputs at random, every cycle: |w| ≤ limit, steady is the period, and levels change at borders only."""
    rng, block = np.random.default_rng(5), fresh(idle_periods=0)
    inputs = {"enable": False, "stop": False, "scale": 1.0, "w_max": LIMIT}
    seen = set()
    for n in range(30_000):
        if rng.random() < 0.02:
            name = str(rng.choice(["enable", "stop", "scale", "w_max"], p=[0.5, 0.1, 0.2, 0.2]))
            choices = {"scale": [1.0, 2.5, -1.0, np.nan], "w_max": [LIMIT, 0.3, 1.0, -1.0, np.nan]}
            inputs[name] = float(rng.choice(choices[name])) if name in choices else bool(rng.random() < 0.7)
            inputs["stop"] = inputs["stop"] and name == "stop"
        block(**inputs)
        w, limit = block["w"], inputs["w_max"]
        assert abs(w) <= limit or w == 0.0
        assert not (inputs["stop"] and w)
        assert block["sample"] == n
        if block["steady"] and not block["limited"]:
            assert w == PERIOD[n % WINDOW] * block["applied"]
        seen.add((block["steady"], block["limited"], block["refused"]))
    assert len(seen) >= 5
