"""Two masses joined by a belt, in C, give the bits of their NumPy twin."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.kernel import (
    BeltCourse,
    BeltGrid,
    BeltMasses,
    BeltNormal,
    BeltRows,
    BeltSplines,
    belt_each,
    belt_replay,
    belt_response,
    belt_together,
)
from tests.twins import belt as belt_twin

RATE_HZ = 4000.0
USUAL = np.log([0.0028, 2.4e-3, 180.0, 0.05])  # of a belt with a resonance at 60 Hz
SPECIAL = np.array([np.nan, np.inf, -np.inf, 0.0, -0.0, 1e-300, 1e160])


class Case:
    """A grid, parameters that swing or not, and measured rows; some of them special."""

    def __init__(self, lines: int, rows: int, spread: float, special: float, seed: int) -> None:
        rng = np.random.default_rng(seed)
        bins = np.sort(rng.choice(np.arange(1, 190), lines, replace=False))
        self.grid = BeltGrid.of(np.exp(2j * np.pi * bins / 400), RATE_HZ)
        self.parameters = self._some(rng, USUAL + spread * rng.normal(size=(rows, 4)), special)
        value = np.asarray(rng.normal(size=(rows, lines)) + 1j * rng.normal(size=(rows, lines)))
        self.rows = BeltRows(value, self._some(rng, rng.uniform(0, 3, size=(rows, lines)), special))
        self.splines = BeltSplines(self._shares(rng, rows, 8), self._shares(rng, rows, int(rng.choice([1, 4]))))
        with np.errstate(invalid="ignore"):  # the mean of infinities of both signs
            middle = self.parameters.mean(axis=0) if rows else USUAL
        belt = np.repeat(middle[2:], (8, self.splines.damping.shape[1]))
        self.unknowns = np.concatenate([middle[:2], belt, [rng.normal()]])
        ticks = int(rng.integers(0, 40))
        course = rng.uniform(0.5, 1.5, size=(2, ticks)) * np.array([[5e5], [10.0 ** rng.uniform(0, 4)]])
        self.course = BeltCourse(RATE_HZ, *course, self._some(rng, rng.normal(size=ticks), special))
        self.masses = BeltMasses(*(np.array([0.003, 6.7, 0.019]) * np.exp(rng.normal(size=3))).tolist())

    @staticmethod
    def _shares(rng: np.random.Generator, rows: int, splines: int) -> np.ndarray:
        return rng.dirichlet(np.ones(splines), size=rows) * (rng.uniform(size=(rows, splines)) < 0.6)

    @staticmethod
    def _some(rng: np.random.Generator, numbers: np.ndarray, special: float) -> np.ndarray:
        return np.where(rng.uniform(size=numbers.shape) < special, rng.choice(SPECIAL, numbers.shape), numbers)


cases = st.builds(
    Case,
    lines=st.integers(1, 20),
    rows=st.integers(0, 6),
    spread=st.sampled_from([0.1, 1.0, 5.0]),
    special=st.sampled_from([0.0, 0.0, 0.05]),
    seed=st.integers(0, 2**32 - 1),
)


def bits(array: np.ndarray) -> bytes:
    """The sign and payload of NaN are not specified."""
    parts = array.view(np.float64) if array.dtype == np.complex128 else array
    return np.where(np.isnan(parts), np.nan, parts).tobytes()


def assert_same_normal(found: BeltNormal, twin: BeltNormal) -> None:
    for one, other in zip(found, twin, strict=True):
        assert bits(one) == bits(other)


@settings(max_examples=60, deadline=None)
@given(case=cases)
@np.errstate(invalid="ignore", over="ignore", divide="ignore")
def test_c_has_the_bits_of_the_twin(case: Case) -> None:
    assert bits(belt_response(case.grid, case.parameters)) == bits(belt_twin.response(case.grid, case.parameters))
    found = belt_each(case.grid, case.rows, case.parameters)
    assert_same_normal(found, belt_twin.each(case.grid, case.rows, case.parameters))
    together = belt_together(case.grid, case.rows, case.splines, case.unknowns)
    assert_same_normal(together, belt_twin.together(case.grid, case.rows, case.splines, case.unknowns))
    for one, other in zip(belt_replay(case.masses, case.course), belt_twin.replay(case.masses, case.course)):
        assert bits(one) == bits(other)


def test_arrays_of_other_shapes_are_refused() -> None:
    case = Case(7, 3, 0.1, 0.0, 1)
    short = case.rows._replace(weight=case.rows.weight[:, :-1].copy())
    with pytest.raises(ValueError, match="another type or shape"):
        belt_each(case.grid, short, case.parameters)
    with pytest.raises(ValueError, match="another type or shape"):
        belt_together(case.grid, case.rows, case.splines, case.unknowns[:-1])
    with pytest.raises(ValueError, match="another type or shape"):
        belt_replay(case.masses, case.course._replace(torque_n_m=np.zeros(99)))
