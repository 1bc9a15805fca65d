"""Errors that lines share: the rate of false alarms of a comparison of matrices, by rows made without a machine."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.core import Lines, MatrixResponses
from livebode_matrix import compare_matrices
from livebode_matrix.line_correlation import LineCorrelation, RowSteps

LINES = Lines.parse("8:92:4", rate_hz=4000, window=1000)
REPETITIONS, MEMORY, DWELL = 24, 6, 4


def matrices(
    rng: np.random.Generator, repetitions: int, share: float, count: int = MEMORY, *, state: bool = True
) -> MatrixResponses:
    """Rows of two outputs and inputs, one after each experiment, as a tracker with `average` and `memory` gives them.

    `share` of the power of the first output's noise is leakage: the same at all lines of an experiment, but for its
    phase against the excitation. Leakage of a `state` is a real number times a phase; else it is complex.
    """
    lines, slots = len(LINES), 2 * repetitions
    noise = rng.standard_normal((slots, lines, 2, 2)) @ np.array([1, 1j]) / np.sqrt(2)
    leak = rng.standard_normal((slots, 2)) @ (np.array([1, 0j]) if state else np.array([1, 1j]) / np.sqrt(2))
    noise[:, :, 0] = np.sqrt(1 - share) * noise[:, :, 0] + np.sqrt(share) * leak[:, np.newaxis]
    turned = np.exp(2j * np.pi * rng.random(lines))  # of the excitation, alike in all repetitions
    errors = noise * turned[:, np.newaxis]
    last = np.arange(2 * count - 1, slots)
    value, scatter = [], []
    for newest in last:
        own = errors[newest - 2 * count + 1 : newest + 1].reshape(count, 2, lines, 2)
        order = [0, 1] if newest % 2 else [1, 0]  # experiment e is input e
        mean = own.mean(axis=0)[order]
        apart = own - own.mean(axis=0)
        value.append(np.moveaxis(mean, 0, 2) + np.eye(2))
        scatter.append(np.einsum("xylo,xylp->lop", apart, apart.conj()) / (2 * (count - 1)))
    rows, one = len(last), np.ones((len(last), lines, 2, 2))
    sample = DWELL * LINES.window * (last + 1) - 1
    return MatrixResponses(
        LINES, ("y1", "y2"), ("u1", "u2"), np.array(value), np.array(scatter),
        np.tile(np.eye(2, dtype=np.complex128) / count, (rows, lines, 1, 1)), np.full(rows, 2.0 * (count - 1)),
        one[..., 0], one[:, :, 0, 0], np.zeros((rows, lines, 2), dtype=np.int8),
        sample - 2 * count * DWELL * LINES.window + 1, sample, sample / LINES.rate_hz, (),
    )  # fmt: skip


def probabilities(rng: np.random.Generator, runs: int, share: float, changed: float = 0.0) -> np.ndarray:
    found = []
    for _ in range(runs):
        after = matrices(rng, MEMORY, share)
        after = after[-1:]
        after.value[...] += changed
        found.append(compare_matrices(matrices(rng, REPETITIONS, share), after).probability)
    return np.array(found)


@pytest.mark.parametrize("share", [0.0, 0.7])
def test_false_alarms_are_no_more_than_stated_whatever_the_lines_share(share: float) -> None:
    """80 comparisons, with two standard deviations of chance; 3e-6 is one alarm in 30 days of matrices of 8 s."""
    p = probabilities(np.random.default_rng(1), 80, share)
    for alpha in (0.1, 0.05, 0.01):
        assert np.mean(p < alpha) <= alpha + 2 * np.sqrt(alpha / p.size)
    assert p.min() > 3e-6
    assert 0.3 < np.median(p) < 0.7


def test_a_change_of_twice_the_noise_is_found() -> None:
    p = probabilities(np.random.default_rng(2), 20, 0.5, changed=2.0)
    assert (p < 3e-6).all()


@pytest.mark.parametrize(("share", "state"), [(0.0, False), (0.5, False), (0.5, True)])
def test_the_cumulants_are_those_of_the_errors_or_larger(share: float, *, state: bool) -> None:
    """Of two outputs one has leakage: 1 + s²·(lines − 1)/2 times the variance of independent lines.

    Of a state it is 1 + s²·(lines − 1/2): each error has the same covariance with the conjugate of another one too.
    """
    rng, lines = np.random.default_rng(3), len(LINES)
    unit, every = np.tile(np.eye(2), (lines, 1, 1)), np.ones(lines, dtype=np.bool_)
    made = [matrices(rng, REPETITIONS, share, state=state) for _ in range(20)]
    found = [RowSteps.of(one).correlation(every, unit, unit).second for one in made]
    true = 1 + share**2 * ((2 * lines - 1) if state else (lines - 1)) / 2
    print(true, np.round(found, 2))
    assert np.mean(np.array(found) >= 0.6 * true) >= 0.95


def test_a_line_that_is_too_noisy_in_some_rows_costs_its_rows_or_itself_alone() -> None:
    """Before, a line that was valid in any row had to be so in all, else no row counted."""
    rows = matrices(np.random.default_rng(5), REPETITIONS, 0.0)
    whole, last = len(RowSteps.of(rows).step), len(rows) - 1
    of_mean = np.arange(last % (2 * MEMORY), last + 1, 2 * MEMORY)
    for line, disturbed in ((0, [last - 1]), (1, of_mean)):
        rows.reason[disturbed, line] = 3
        rows.value[disturbed, line] = np.nan
    assert len(RowSteps.of(rows).step) == whole - 1


def test_too_few_rows_take_half_of_the_noise_as_shared() -> None:
    rows = matrices(np.random.default_rng(4), MEMORY + 2, 0.0)
    unit = np.tile(np.eye(2), (len(LINES), 1, 1))
    every = np.ones(len(LINES), dtype=np.bool_)
    assert RowSteps.of(rows).correlation(every, unit, unit) == LineCorrelation.largest(len(LINES))
