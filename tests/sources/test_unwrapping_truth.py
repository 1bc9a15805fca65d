"""An angle or a counter that wraps is recognised by its jumps, and unwrapped; a sawtooth or a real jump is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from livebode.core import Channel
from livebode.sources import Unwrapping, Wrap, WrapSearch, open_log
from livebode.sources.expressions import parse_expression
from tests.support.command import write_parquet

TURNS = {"rad": 2 * np.pi, "": 360.0, "counts": 65536.0}
SEEDS = st.integers(0, 2**32 - 1)


def angle(seed: int, turns: float, samples: int = 2000) -> np.ndarray:
    """A smooth motion over so many turns with noise of a thousandth of a turn, in turns."""
    rng = np.random.default_rng(seed)
    t = np.arange(samples) / samples
    return rng.random() + turns * t + 0.02 * np.sin(40 * t) + 1e-3 * rng.standard_normal(samples)


def wrapped(x: np.ndarray, turn: float, *, signed: bool) -> np.ndarray:
    """The angle as a sensor has it; counts are whole numbers."""
    y = (x + 0.5) % 1 - 0.5 if signed else x % 1
    return np.floor(y * turn) if turn == round(turn) and turn != 360 else y * turn


def found(x: np.ndarray, unit: str = "", size: int = 137, kind: str = "position") -> Wrap | None:
    search = WrapSearch()
    for start in range(0, x.size, size):
        search.process(x[start : start + size])
    return search.finish(Channel("angle", unit, kind))  # type: ignore[arg-type]


@given(SEEDS, st.sampled_from(list(TURNS)), st.booleans(), st.floats(-40, 40), st.integers(1, 3000))
@settings(max_examples=60, deadline=None)
def test_an_angle_that_wraps_is_recognised_and_unwrapped(
    seed: int, unit: str, signed: bool, turns: float, size: int
) -> None:
    turn, x = TURNS[unit], angle(seed, turns)
    y = wrapped(x, turn, signed=signed)
    jumps = np.count_nonzero(np.abs(np.diff(y)) > turn / 2)
    assume(jumps)
    assert found(y, unit, size) == Wrap(turn, jumps)
    parts = Unwrapping(turn)
    whole = np.concatenate([parts.process(y[i : i + size]) for i in range(0, y.size, size)])
    expected = x * turn - (x[0] * turn - y[0])
    assert np.abs(whole - expected).max() <= 1e-9 * turn + (1 if turn > 400 else 0)
    assert np.array_equal(whole[:1], y[:1])


@given(SEEDS, st.integers(8, 32), st.booleans(), st.sampled_from([0.0, 1.0, -3.0]))
@settings(max_examples=50, deadline=None)
def test_counters_of_each_width_are_recognised_also_around_the_end_of_their_range(
    seed: int, bits: int, signed: bool, turns: float
) -> None:
    x = angle(seed, turns)
    x += (0.5 if signed else 0.0) - x[1000]  # at the border in the middle
    y = (
        wrapped(x, float(1 << bits), signed=signed)
        if bits > 8
        else np.floor(((x + 0.5) % 1 - 0.5 if signed else x % 1) * 256)
    )
    jumps = np.count_nonzero(np.abs(np.diff(y)) > (1 << bits) / 2)
    assume(jumps)
    assert found(y, "counts") == Wrap(float(1 << bits), jumps)


@given(SEEDS, st.floats(0.01, 1e4), st.integers(20, 700), st.integers(0, 2))
@settings(max_examples=60, deadline=None)
def test_a_sawtooth_is_no_angle(seed: int, size: float, period: int, kind: int) -> None:
    # Any size, and those of a turn; jumps end at its lowest value.
    size = [size, 1.0, 360.0][kind]
    t = np.arange(4 * period)
    assert found(size * (t % period) / period) is None
    noisy = size * (t % period) / period + 1e-3 * size * np.random.default_rng(seed).standard_normal(t.size)
    assert found(noisy, "m") is None


@given(SEEDS, st.floats(-1e5, 1e5), st.floats(0.1, 1e5))
@settings(max_examples=60, deadline=None)
def test_a_position_that_is_set_once_is_no_angle(seed: int, start: float, moved: float) -> None:
    rng = np.random.default_rng(seed)
    x = start + moved * np.linspace(0, 1, 1000) + 1e-3 * moved * rng.standard_normal(1000)
    homed = np.concatenate([x, x - x[-1]])
    jump = float(np.abs(np.diff(homed)).max())
    assume(min(abs(jump / turn - 1) for turn in (1.0, 2 * np.pi, 360.0)) > 0.05)  # else nothing tells them apart
    assert found(homed) is None
    assert found(homed, "m") is None
    counts = np.round(homed)
    assume(min(abs(jump / (1 << bits) - 1) for bits in range(8, 33)) > 0.05)
    assert found(counts, "counts") is None


@given(SEEDS, st.floats(0.1, 1e3))
@settings(max_examples=50, deadline=None)
def test_a_signal_that_switches_and_noise_are_no_angles(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    two = size * rng.integers(0, 2, 1000)
    assert found(two) is None
    assert found(np.round(two)) is None
    noisy = two + 0.02 * size * rng.standard_normal(1000)
    assert found(noisy) is None or min(abs(size / turn - 1) for turn in (1.0, 2 * np.pi, 360.0)) < 0.12
    assert found(size * rng.standard_normal(1000)) is None
    assert found(wrapped(angle(seed, 5.0), 256.0, signed=False), "rad/s", kind="velocity") is None


@pytest.mark.parametrize("block", [1, 3, 100])
def test_an_expression_unwraps_over_blocks_gaps_and_missing_samples(block: int, tmp_path: Path) -> None:
    x = angle(1, 6.0, 400)
    y = wrapped(x, 360.0, signed=False)
    y[50] = np.nan
    t = np.arange(400) / 1000.0
    keep = (np.arange(400) < 200) | (np.arange(400) >= 203)
    path = write_parquet(tmp_path / "a.parquet", {"t": t[keep], "angle": y[keep]})
    log = open_log(path)
    names = ["unwrap(angle, 360)", "diff(unwrap(angle, 360))"]
    blocks = list(log.blocks(names, block_samples=block))
    samples = np.concatenate([np.arange(one.start, one.stop) for one in blocks])
    unwrapped, speed = np.concatenate([one.data for one in blocks], axis=1)
    expected = np.where(np.isnan(y), np.nan, 360 * x)
    shift = unwrapped[0] - expected[samples[0]]
    assert shift % 360 == pytest.approx(0, abs=1e-6) or shift % 360 == pytest.approx(360)
    assert np.allclose(unwrapped, expected[samples] + shift, equal_nan=True)
    steps = np.diff(expected, prepend=np.nan)[samples] * 1000
    assert np.allclose(speed, steps, equal_nan=True)


def test_the_log_unwraps_a_column_where_it_is_used(tmp_path: Path) -> None:
    x = angle(2, -7.0)
    columns = {"t": np.arange(2000) / 1000.0, "phi [deg]": wrapped(x, 360.0, signed=True), "u": x}
    log = open_log(write_parquet(tmp_path / "a.parquet", columns))
    wraps = log.search_wraps(["2*phi", "u", "absent"])
    assert wraps == {"phi": Wrap(pytest.approx(2 * np.pi), wraps["phi"].count)}
    phi = log.unwrapping(wraps)["2*phi"]
    assert np.allclose(np.diff(phi), 4 * np.pi * np.diff(x))
    assert log.search_wraps(["unwrap(phi, 6.283185307179586)"]) == {}
    assert parse_expression("unwrap(phi, 6.28)").unwraps
