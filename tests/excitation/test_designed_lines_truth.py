"""The designed lines are found in references that are quantised, truncated or have mains hum beside them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebode.core import Lines, SignalError, step_of
from livebode.excitation import multisine, recognise
from livebode.records import RunRecord
from tests.support.command import livebode

RATE_HZ = 4000.0


@given(
    st.lists(st.integers(-500, 500), min_size=40, max_size=300),
    st.floats(1e-6, 1e3),
    st.floats(-10.0, 10.0),
)
def test_the_step_is_the_greatest_common_divisor_of_the_differences(counts: list[int], step: float, offset: float):
    common = int(np.gcd.reduce(np.diff(np.unique(counts)))) if len(set(counts)) > 1 else 0
    samples = step * (np.array(counts, dtype=float) + offset)
    assert step_of(samples) == pytest.approx(common * step, rel=1e-6)


@pytest.mark.parametrize("bits", [8, 12, 16])
@pytest.mark.parametrize("rounding", [np.round, np.trunc])
def test_the_designed_lines_of_a_quantised_reference_are_found(bits: int, rounding) -> None:
    """63 odd lines, 47 dB and more above the error of rounding, which repeats with them at all odd bins."""
    lines = Lines(tuple(range(1, 127, 2)), 2000, RATE_HZ)
    reference = multisine(lines)
    step = np.abs(reference).max() / 2 ** (bits - 1)
    found = recognise(np.tile(step * rounding(reference / step), 4), RATE_HZ)
    assert (found.period, found.lines.bins) == (2000, lines.bins)


def test_a_quantised_sine_is_one_line() -> None:
    sine = np.sin(2 * np.pi * np.arange(2000) / 200)
    found = recognise(np.round(sine, 2), RATE_HZ)
    assert (found.period, found.lines.bins) == (200, (1,))


def test_a_ternary_sequence_keeps_all_its_lines() -> None:
    """Its three levels are the design: nothing of it is the error of rounding."""
    period = np.random.default_rng(3).integers(-1, 2, 127).astype(float)
    assert len(recognise(np.tile(period, 6), RATE_HZ).lines) > 60


def with_hum(periods: int) -> np.ndarray:
    """A Schroeder multisine of 1,024 samples with hum of 2 %, which repeats together after 5,120 samples."""
    period = multisine(Lines(tuple(range(1, 101)), 1024, RATE_HZ))
    time_s = np.arange(periods * 1024) / RATE_HZ
    return np.tile(period, periods) + 0.02 * np.abs(period).max() * np.cos(2 * np.pi * 50 * time_s)


def test_the_period_of_an_excitation_is_found_in_mains_hum() -> None:
    found = recognise(with_hum(20), RATE_HZ)
    assert (found.period, found.lines.bins) == (1024, tuple(range(1, 101)))


def test_a_design_with_a_line_at_the_mains_keeps_it() -> None:
    lines = Lines.parse("20,40,60,80,100,120,140,50", RATE_HZ, 400)
    found = recognise(np.tile(multisine(lines), 6), RATE_HZ)
    assert (found.period, found.lines.bins) == (400, lines.bins)


def recorded(path: Path, w: np.ndarray) -> Path:
    """A recording of a plant with gain 0.5 and a lag, without feedback."""
    y = np.zeros_like(w)
    for n in range(1, w.size):
        y[n] = 0.9 * y[n - 1] + 0.05 * w[n - 1]
    pq.write_table(pa.table({"t": np.arange(w.size) / RATE_HZ, "w": w, "u": w + 1e-6 * y, "y": y}), path)
    return path


ROLES = ("--excitation", "w", "--input", "u", "--output", "y", "--accept-roles")


def test_a_specified_window_is_not_rejected_because_of_a_longer_common_period(tmp_path: Path) -> None:
    log = recorded(tmp_path / "log.parquet", with_hum(20))
    done = livebode("run", log, *ROLES, "--window", "1024", "--out", tmp_path / "run")
    assert done.code == 0, done.err
    run = RunRecord.open(tmp_path / "run")
    assert run.lines.bins == tuple(range(1, 101))
    assert "window-doubtful" not in {event.kind for event in run.events()}


def test_a_window_that_is_wrong_by_a_sample_is_reported_with_what_changes_and_the_run_continues(tmp_path: Path) -> None:
    period = multisine(Lines(tuple(range(1, 11)), 1024, RATE_HZ))
    log = recorded(tmp_path / "log.parquet", np.tile(period, 8))
    done = livebode("run", log, *ROLES, "--lines", "k=1:10", "--window", "1023", "--out", tmp_path / "run")
    assert done.code == 0, done.err
    (doubt,) = (event for event in RunRecord.open(tmp_path / "run").events() if event.kind == "window-doubtful")
    assert doubt.details["period"] == 1024
    change = np.mean((np.roll(period, 1) - period) ** 2) / np.var(period) / 2
    assert doubt.details["share_that_changes"] == pytest.approx(change, rel=0.05)
    assert "every 1024 samples rather than every 1023" in doubt.message


def test_a_window_of_one_period_and_a_half_is_reported(tmp_path: Path) -> None:
    period = multisine(Lines((1, 2, 3, 5), 200, RATE_HZ))
    log = recorded(tmp_path / "log.parquet", np.tile(period, 30))
    done = livebode("run", log, *ROLES, "--window", "300", "--out", tmp_path / "run")
    assert done.code == 0, done.err
    (doubt,) = (event for event in RunRecord.open(tmp_path / "run").events() if event.kind == "window-doubtful")
    assert (doubt.details["period"], doubt.details["window"]) == (200, 300)


def test_inspect_names_the_design(tmp_path: Path) -> None:
    lines = Lines(tuple(range(1, 250, 4)), 1000, RATE_HZ)
    log = recorded(tmp_path / "log.parquet", np.tile(multisine(lines), 4))
    done = livebode("inspect", log, "--excitation", "w", "--json")
    assert json.loads(done.out)["excitation"]["design"] == "odd-odd, k=1:249:4"


def with_second(ratio: float, first: int = 3, second: int = 6, noise: float = 1e-3) -> np.ndarray:
    """A measured sine with another one of this relative amplitude; ten periods of 256 samples."""
    n = np.arange(2560)
    w = np.cos(2 * np.pi * first * n / 256) + ratio * np.cos(2 * np.pi * second * n / 256)
    return np.asarray(w + noise * np.random.default_rng(0).standard_normal(n.size))


def test_a_sine_with_a_strong_harmonic_is_ambiguous_and_both_candidates_are_commands(tmp_path: Path) -> None:
    """A drive of 10 % distortion, or two lines 20 dB apart: nothing in the recording tells."""
    log = recorded(tmp_path / "log.parquet", with_second(0.1))
    with pytest.raises(SignalError) as caught:
        recognise(with_second(0.1), RATE_HZ)
    assert (caught.value.code, caught.value.period) == ("signal.lines-ambiguous", 256)
    refused = livebode("run", log, *ROLES, "--out", tmp_path / "run")
    assert refused.code != 0
    assert all(candidate in refused.err for candidate in caught.value.candidates)
    shown = livebode("inspect", log, "--excitation", "w")
    assert shown.code == 0
    assert caught.value.candidates[1] in shown.out
    for number, candidate in enumerate(caught.value.candidates, 1):
        done = livebode("run", log, *ROLES, *candidate.split(), "--out", tmp_path / str(number))
        assert done.code == 0, done.err
        assert len(RunRecord.open(tmp_path / str(number)).lines.bins) == number


def test_weak_harmonics_of_a_sine_are_distortion() -> None:
    found = recognise(with_second(0.03), RATE_HZ)
    assert (found.lines.bins, found.distortion) == ((3,), (6,))


def test_a_weak_line_that_is_no_harmonic_of_the_strong_one_was_designed() -> None:
    assert recognise(with_second(0.1, 5, 27), RATE_HZ).lines.bins == (5, 27)


def test_a_line_near_a_high_harmonic_of_the_mains_is_not_hum() -> None:
    """1864 Hz is 4 Hz beside the 31st harmonic of 60 Hz; without it the recording would repeat after 125 samples."""
    n = np.arange(5000)
    w = np.cos(2 * np.pi * 176 * n / 500) + 0.316 * np.cos(2 * np.pi * 233 * n / 500)
    assert recognise(w, RATE_HZ).lines.bins == (176, 233)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize(("times", "whole"), [(3, 500), (3, 1000), (4, 1001)])
def test_a_period_that_is_no_whole_number_of_samples_gives_a_window_of_several(
    noise: float, times: int, whole: int
) -> None:
    """2000 Hz / 12 samples at 2 kHz is 166.67 samples: three periods are 500."""
    n = np.arange(8 * whole)
    w = sum(np.cos(2 * np.pi * k * times * n / whole + k * k) for k in (1, 2, 5))
    found = recognise(w + noise * np.random.default_rng(1).standard_normal(n.size), 2000.0)
    assert (found.period, found.lines.bins) == (whole, (times, 2 * times, 5 * times))


def test_lines_far_below_the_others_that_the_output_does_not_show_are_left_out() -> None:
    """The reference repeats exactly, with products of its own computation 40 dB below; the output is noisy."""
    lines, junk = Lines(tuple(range(1, 126, 2)), 1000, RATE_HZ), Lines(tuple(range(2, 400, 2)), 1000, RATE_HZ)
    w = np.tile(multisine(lines) + 0.01 * multisine(junk) * np.sqrt(len(junk.bins) / len(lines.bins)), 8)
    y = 0.5 * w + 0.3 * np.abs(w).max() * np.random.default_rng(2).standard_normal(w.size)
    assert len(recognise(w, RATE_HZ).lines.bins) > 200
    assert recognise(w, RATE_HZ, y).lines.bins == lines.bins


def test_hum_far_below_the_lines_on_both_sides_is_no_line_of_a_sloping_design() -> None:
    """50 and 150 Hz fit the period; the weakest line is weaker than the hum."""
    bins = np.array([3, 9, 21, 24, 33, 41, 60, 70, 81, 90, 120, 200])
    n = np.arange(2000)
    amplitude = 10 ** (-np.arange(bins.size) / 6)
    w = sum(a * np.cos(2 * np.pi * k * n / 2000 + k * k) for a, k in zip(amplitude, bins))
    hum = 0.02 * np.cos(2 * np.pi * 25 * n / 2000) + 0.004 * np.cos(2 * np.pi * 75 * n / 2000)
    assert recognise(np.tile(w + hum, 4), RATE_HZ).lines.bins == tuple(bins)
    assert recognise(np.tile(w + 10 * hum, 4), RATE_HZ).lines.bins == tuple(sorted({*bins.tolist(), 25, 75}))
