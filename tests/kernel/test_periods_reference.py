"""Periods of a signal: every instruction set has the bits of NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.kernel import (
    PERIODS_MAX,
    PeriodDrift,
    instruction_sets,
    period_levels,
    period_reach,
    straight_periods,
    typical_period,
)
from tests.twins import periods as twin

KINDS = ("noise", "steps", "heavy tails", "one value", "not finite")


def drawn(seed: int, kind: str, shape: tuple[int, int]) -> np.ndarray:
    rng = np.random.default_rng(seed)
    x = rng.standard_cauchy(shape) if kind == "heavy tails" else rng.standard_normal(shape)
    if kind == "steps":
        x = np.round(x) + 0.0  # -0.0 and 0.0 have no order
    elif kind == "one value":
        x = np.full(shape, 0.1)
    elif kind == "not finite":
        at = tuple(rng.integers(0, shape, (3, 2)).T)
        x[at] = rng.choice([np.nan, np.inf, -np.inf], 3)
    return x


@pytest.mark.parametrize("instruction_set", instruction_sets())
@given(st.integers(0, 2**32 - 1), st.sampled_from(KINDS), st.integers(1, PERIODS_MAX), st.integers(1, 600))
@settings(deadline=None, max_examples=60)
def test_periods_have_the_bits_of_numpy(instruction_set: str, seed: int, kind: str, count: int, window: int) -> None:
    x, typical = drawn(seed, kind, (count, window)), drawn(seed + 1, "noise", (1, window))[0]
    level, before, behind = drawn(seed + 2, "noise", (3, count))
    drift = PeriodDrift(np.linspace(-0.5, 0.5, window), window // 2, level, before, behind, 0.3)
    with pytest.MonkeyPatch.context() as patch, np.errstate(all="ignore"):
        patch.setenv("LIVEBODE_INSTRUCTION_SET", instruction_set)
        np.testing.assert_array_equal(typical_period(x), twin.typical_period(x))
        np.testing.assert_array_equal(period_levels(x), np.median(x, axis=1))
        np.testing.assert_array_equal(period_levels(x, typical), twin.period_levels(x, typical))
        np.testing.assert_array_equal(straight_periods(x, drift), twin.straight_periods(x, drift))
        np.testing.assert_array_equal(period_reach(x, typical), twin.period_reach(x, typical))


@pytest.mark.parametrize("kind", ["noise", "steps", "one value"])
def test_the_middle_of_many_numbers_is_that_of_numpy(kind: str) -> None:
    x = drawn(1, kind, (3, 100_001))
    assert period_levels(x).tobytes() == np.median(x, axis=1).tobytes()


def test_numbers_that_mislead_every_choice_are_sorted() -> None:
    """Each choice of a number to compare with is the smallest but one of those that remain."""
    x = 2.0 ** -np.arange(900)[np.newaxis]
    assert period_levels(x) == np.median(x, axis=1)


def test_samples_may_name_their_byte_order() -> None:
    x = drawn(1, "noise", (5, 7))
    assert np.array_equal(typical_period(x.view(np.dtype(np.float64).newbyteorder("<"))), np.median(x, axis=0))


def test_more_periods_than_the_most_are_refused() -> None:
    with pytest.raises(ValueError, match="refused"):
        typical_period(np.zeros((PERIODS_MAX + 1, 3)))
