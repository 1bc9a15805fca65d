"""Responses to chirps and noise against the truth, against `welch`, and against the Tracker on what repeats."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from livebode.core import Block, Lines, UsageError
from livebode.estimation import NonPeriodicTracker, Settings, Tracker, welch
from livebode.excitation import multisine
from studies.nonperiodic import RATE_HZ, Case, Machine, bias, coverage, estimated, recorded
from tests.support.errors import refused


@pytest.mark.parametrize("masses", [1, 2])
@pytest.mark.parametrize("closed", [False, True], ids=["open", "closed"])
@pytest.mark.parametrize("kind", ["chirp", "noise"])
def test_bounds_of_the_local_polynomial_method_hold_the_promised_share(masses: int, closed: bool, kind: str) -> None:
    # 6 runs of 84 lines, of which neighbours share no bins: ± 2.6 % is one and a half standard deviations of 63 %.
    one, two, _ = coverage(Case(masses, closed, kind, 1), "lpm", runs=6)  # type: ignore[arg-type]
    assert one == pytest.approx(0.632, abs=0.065)
    assert two == pytest.approx(0.982, abs=0.02)


def test_bounds_of_an_average_over_windows_hold_the_promised_share() -> None:
    one, two, _ = coverage(Case(2, True, "chirp", 8), "lpm", runs=3)
    assert one == pytest.approx(0.632, abs=0.09)
    assert two == pytest.approx(0.982, abs=0.03)


@pytest.mark.parametrize("closed", [False, True], ids=["open", "closed"])
@pytest.mark.parametrize("kind", ["chirp", "noise"])
@pytest.mark.parametrize(("samples", "most"), [(65_536, 0.001), (16_384, 0.02)])
def test_bias_at_a_sharp_resonance_is_below_a_third_of_welch(
    samples: int, most: float, kind: str, closed: bool
) -> None:
    found = bias(kind, closed=closed, samples=samples)  # type: ignore[arg-type]
    assert found["lpm"] < found["welch"] / 3
    assert found["lpm"] < most


def test_lines_at_the_ends_of_a_chirp_are_not_valid_in_open_loop() -> None:
    block = recorded(Machine(2), "chirp", 8192, 1, closed=False, noise=0.1)
    found = estimated(block, Lines((350, 360, 800, 1630, 1640), 8192, RATE_HZ), "lpm", closed=False)
    assert found.valid.tolist() == [False, False, True, False, False]


@cache
def noisy() -> Block:
    return recorded(Machine(2), "noise", 2400, 3, closed=True, noise=0.1)


@pytest.mark.parametrize("excitation", ["w", None])
def test_welch_of_eight_windows_equals_the_offline_reference(excitation: str | None) -> None:
    names = ["w", "u", "y"] if excitation else ["u", "y"]
    expected = welch(*(noisy()[name] for name in names), fs=noisy().rate_hz, window=300)
    settings = Settings(
        lines=expected.lines, output="y", input="u", excitation=excitation, estimator="welch", hop=2400,
    )  # fmt: skip
    found = NonPeriodicTracker(settings).process(noisy())
    assert len(found) == 1
    valid = found[0].valid
    for name in ("value", "sigma"):
        np.testing.assert_allclose(getattr(found[0], name)[valid], getattr(expected, name)[valid], rtol=1e-9)
    unexplained = (1 - expected.coherence) * (expected.dof + 1) / expected.dof  # without the bias of few windows
    unbiased = expected.coherence / (expected.coherence + unexplained)
    np.testing.assert_allclose(found[0].coherence[valid], unbiased[valid], rtol=1e-9)
    assert found[0].dof == pytest.approx(expected.dof)
    assert (found[0].first, found[0].sample, found[0].time_s) == (expected.first, expected.sample, expected.time_s)


@pytest.mark.parametrize("estimator", ["lpm", "welch"])
def test_average_over_all_windows_equals_one_estimate_from_all_their_equations(estimator: str) -> None:
    window = 1200 if estimator == "lpm" else 150
    lines = Lines(tuple(range(20, 60, 7)), window, RATE_HZ)
    average = estimated(noisy(), lines, estimator, closed=True, windows=2)
    singles = [
        estimated(noisy().cut(i * 1200, (i + 1) * 1200), lines, estimator, closed=True) for i in range(2)
    ]  # fmt: skip
    between = np.abs(singles[0].value - singles[1].value)
    for single in singles:  # a weighted mean of the two is between them
        assert np.all(np.abs(average.value - single.value) <= 1.05 * between)
    assert average.dof > sum(single.dof for single in singles)
    assert average.first == 0


def test_on_a_periodic_recording_without_noise_the_tracker_and_the_local_polynomial_agree_to_rounding() -> None:
    lines = Lines.parse("20:140:20", RATE_HZ, 500)
    w = np.tile(multisine(lines), 10)
    block = Machine(2).run(w, np.zeros(w.size), closed=True)
    settled = Block(block.data[:, -500:], block.channels, RATE_HZ)
    tracked, polynomial = (
        kind(Settings(lines=lines, output="y", input="u", excitation="w", estimator=name)).process(settled)[-1]
        for kind, name in ((Tracker, "joint"), (NonPeriodicTracker, "lpm"))
    )
    np.testing.assert_allclose(polynomial.value, tracked.value, rtol=1e-6)


def test_with_noise_both_agree_within_their_bounds() -> None:
    lines = Lines.parse("20:140:20", RATE_HZ, 500)
    w = np.tile(multisine(lines), 40)
    noise = 0.02 * np.random.default_rng(4).standard_normal(w.size)
    block = Machine(2).run(w, noise, closed=True).cut(5000, w.size)  # settled
    options = {"lines": lines, "output": "y", "input": "u", "excitation": "w", "average": True, "forgetting": 1.0}
    both = [
        kind(Settings(**options, estimator=name)).process(block)[-1]  # type: ignore[arg-type]
        for kind, name in ((Tracker, "joint"), (NonPeriodicTracker, "lpm"))
    ]
    assert np.all(np.abs(both[0].value - both[1].value) < both[1].bound(1))
    assert np.median(both[1].sigma / both[0].sigma) == pytest.approx(1.0, abs=0.5)


def test_lines_that_the_chirp_does_not_reach_are_not_valid_in_closed_loop() -> None:
    block = recorded(Machine(2), "chirp", 8192, 1, closed=True, noise=0.1)
    lines = Lines(tuple(range(2500, 3500, 50)), 8192, RATE_HZ)
    found = estimated(block, lines, "lpm", closed=True)
    assert not found.valid.any()
    assert np.isnan(found.value).all()


def test_a_gap_and_a_sample_that_is_not_finite_begin_a_new_window() -> None:
    data = noisy().data.copy()
    data[1, 700] = np.nan
    settings = Settings(
        lines=Lines((20, 30), 300, RATE_HZ), output="y", input="u", excitation="w", estimator="lpm", hop=100
    )
    tracker = NonPeriodicTracker(settings)
    found = tracker.process(Block(data, ("w", "u", "y"), RATE_HZ))
    valid = found.sample[found.valid.all(axis=1)]
    np.testing.assert_array_equal(valid, [*range(299, 700, 100), *range(1000, 2400, 100)])
    assert tracker.counts["non-finite"] == 1


@pytest.mark.parametrize(
    "option",
    [{"hann": True}, {"spikes": ("y",)}, {"noise": "quiet"}, {"dtype": "float32"}],
    ids=lambda o: next(iter(o)),
)
def test_options_for_a_periodic_excitation_are_refused(option: dict) -> None:
    with refused(UsageError, "conflict"):
        Settings(lines=Lines((20,), 300, RATE_HZ), output="y", input="u", estimator="lpm", **option)


def test_a_window_with_too_few_bins_is_refused() -> None:
    settings = Settings(lines=Lines((3,), 20, RATE_HZ), output="y", input="u", estimator="lpm")
    with refused(UsageError, "out-of-range"):
        NonPeriodicTracker(settings)
