"""The line stage in C gives the bits of its NumPy twin."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.estimation.periods import weights_of
from livebode.kernel import (
    MEANS,
    NOISE_LARGER,
    NOISE_MOVING,
    NOISE_SCATTER,
    SCATTER,
    LineMoments,
    LineSettings,
    LineWindows,
    NewestWindows,
    instruction_sets,
    process_each,
    process_lines,
)
from tests.twins import lines as line_twin

SPECIAL = np.array([np.nan, np.inf, -np.inf, 0.0, -0.0, 1e-300, 1e160, -1e5])


@dataclass(frozen=True)
class Case:
    """Sizes, settings, and how often numbers are special or parts are missing."""

    lines: int
    places: int
    bins_beside: int
    forgetting: float
    averages: bool
    denominator: int
    reference: int
    noise: int
    special: float
    with_aside: bool
    with_repeating: bool
    dof_repeating: float
    set: int
    pieces: tuple[int, ...]
    seed: int

    @property
    def settings(self) -> LineSettings:
        table = weights_of(self.forgetting).table
        signals = self.denominator, self.reference
        return LineSettings(self.forgetting, table, self.averages, *signals, self.noise, 3.5, self.set)

    def moments(self) -> LineMoments:
        return LineMoments(
            np.zeros(self.places, np.int64),
            np.zeros((MEANS, self.places, self.lines)),
            np.zeros((SCATTER, self.places, self.lines)),
            np.zeros((3, self.places)),
        )


cases = st.builds(
    Case,
    lines=st.sampled_from([1, 2, 3, 6, 8, 9, 21, 31]),
    places=st.integers(1, 5),
    bins_beside=st.integers(0, 3),
    forgetting=st.sampled_from([1.0, 0.8, 0.3]),
    averages=st.booleans(),
    denominator=st.integers(0, 2),
    reference=st.integers(1, 2),
    noise=st.sampled_from([NOISE_SCATTER, NOISE_MOVING, NOISE_LARGER]),
    special=st.sampled_from([0.0, 0.0, 0.02, 0.3]),
    with_aside=st.booleans(),
    with_repeating=st.booleans(),
    dof_repeating=st.sampled_from([4.0, np.inf]),
    set=st.integers(0, len(instruction_sets())),
    pieces=st.lists(st.integers(0, 12), min_size=1, max_size=4).map(tuple),
    seed=st.integers(0, 2**32 - 1),
)


class Numbers:
    """Random numbers of a case, some of them special."""

    def __init__(self, case: Case) -> None:
        self._case, self._rng = case, np.random.default_rng(case.seed)

    def reals(self, *shape: int) -> np.ndarray:
        found = self._rng.standard_normal(shape)
        special = self._rng.random(shape) < self._case.special
        found[special] = self._rng.choice(SPECIAL, np.count_nonzero(special))
        return found

    def complex_(self, *shape: int) -> np.ndarray:
        found = np.empty(shape, np.complex128)
        found.real, found.imag = self.reals(*shape), self.reals(*shape)
        return found

    def flags(self, share: float, *shape: int) -> np.ndarray:
        return self._rng.random(shape) < share

    def windows(self, rows: int, place: int, largest: float) -> LineWindows:
        case = self._case
        shape = rows, case.lines
        clean = self.flags(0.8, rows)
        repeats, verdicts = case.with_repeating, 1 + rows // 3
        return LineWindows(
            largest,
            place,
            self.complex_(3, rows, case.lines + case.bins_beside),
            None if case.noise == NOISE_SCATTER else np.abs(self.reals(*shape)),
            clean | self.flags(0.5, rows),
            clean,
            self.flags(0.2, rows) if case.with_aside else None,
            self.flags(0.3, rows) if case.noise else None,
            np.abs(self.reals(verdicts, case.lines)) if repeats else None,
            self.flags(0.2, verdicts, case.lines) if repeats else None,
            self._rng.integers(0, verdicts, rows) if repeats else None,
            case.dof_repeating,
            self.reals(3, rows),
        )


def assert_same_bits(one: tuple, other: tuple) -> None:
    for name, a, b in zip(type(one)._fields, one, other):
        assert a.dtype == b.dtype
        assert a.shape == b.shape
        both = [part.view(np.float64) if part.dtype.kind == "c" else part for part in (a, b)]
        if both[0].dtype.kind == "f":
            unknown = np.isnan(both[0])
            assert (unknown == np.isnan(both[1])).all(), name
            both = [np.where(unknown, 0.0, part).view(np.int64) for part in both]
        assert (both[0] == both[1]).all(), name


@settings(max_examples=120, deadline=None)
@given(cases)
def test_rows_and_moments_have_the_bits_of_the_twin(case):
    numbers, moments, of_twin, place, largest = Numbers(case), case.moments(), case.moments(), 0, 0.0
    for rows in case.pieces:
        windows = numbers.windows(rows, place, largest)
        found, largest = process_lines(case.settings, moments, windows)
        expected, expected_largest = line_twin.process_lines(case.settings, of_twin, windows)
        assert_same_bits(found, expected)
        assert_same_bits(moments, of_twin)
        assert largest == expected_largest or np.isnan([largest, expected_largest]).all()
        place = (place + rows) % case.places


@settings(max_examples=60, deadline=None)
@given(cases)
def test_any_division_of_the_windows_gives_the_same_bits(case):
    whole, parts = case.moments(), case.moments()
    every = Numbers(case).windows(sum(case.pieces), 0, 0.0)
    expected, _ = process_lines(case.settings, whole, every)
    begun, largest, found = 0, 0.0, []
    for rows in case.pieces:
        at = slice(begun, begun + rows)
        part = [None if array is None else array[at] for array in (every.noise, every.whole, every.clean, every.aside)]
        more = [None if array is None else array[at] for array in (every.moving, every.verdict)]
        spectrum, moment = np.ascontiguousarray(every.spectrum[:, at]), np.ascontiguousarray(every.moment[:, at])
        place = begun % case.places
        repeating = more[0], every.distortion, every.invalid, more[1], every.dof_repeating
        windows = LineWindows(largest, place, spectrum, *part, *repeating, moment)
        one, largest = process_lines(case.settings, parts, windows)
        found.append(one)
        begun += rows
    axis = dict.fromkeys(expected._fields, 0) | {"moment": 1}
    joined = [np.concatenate([getattr(one, name) for one in found], axis=axis[name]) for name in axis]
    assert_same_bits(expected, type(expected)(*joined))
    assert_same_bits(whole, parts)


@settings(max_examples=60, deadline=None)
@given(cases, st.integers(1, 5))
def test_windows_of_several_machines_have_the_bits_of_each_alone_and_of_the_twin(case, machines):
    numbers, about = Numbers(case), case.settings._replace(noise=NOISE_SCATTER, noise_dof=np.inf)
    each, alone, of_twin = ([case.moments() for _ in range(machines)] for _ in range(3))
    largest = np.zeros(machines)
    for _ in case.pieces:
        place = numbers._rng.integers(0, case.places, machines)
        windows = NewestWindows(largest, place, numbers.complex_(3, machines, case.lines), numbers.reals(machines, 3))
        found, after = process_each(about, each, windows)
        expected, expected_after = line_twin.process_each(about, of_twin, windows)
        assert_same_bits(found, expected)
        assert after.tobytes() == expected_after.tobytes()
        yes = np.ones(1, np.bool_)
        for i in range(machines):
            spectrum, moment = windows.spectrum[:, [i]].copy(), windows.moment[[i]].T.copy()
            one = LineWindows(largest[i], place[i], spectrum, None, yes, yes, *[None] * 5, np.inf, moment)
            rows, _ = process_lines(about, alone[i], one)
            own = found._replace(moment=found.moment.T)
            assert_same_bits(rows._replace(moment=rows.moment.T), type(own)(*(part[[i]] for part in own)))
            assert_same_bits(each[i], of_twin[i])
            assert_same_bits(each[i], alone[i])
        largest = after


@pytest.mark.parametrize(
    "wrong",
    [
        {"place": np.array([0, 2])},
        {"place": np.array([0, -1])},
        {"place": np.array([0])},
        {"largest": np.zeros(3)},
        {"spectrum": np.zeros((3, 3, 2), np.complex128)},
        {"spectrum": np.zeros((1, 2, 2), np.complex128)},
        {"spectrum": np.zeros((3, 2, 1), np.complex128)},
        {"moment": np.zeros((3, 2))},
    ],
)
def test_of_several_machines_none_changes_where_an_array_is_refused(wrong):
    case = Case(2, 2, 0, 0.8, False, 1, 2, NOISE_SCATTER, 0.0, False, False, 4.0, 0, (3,), 0)
    each, zeros = [case.moments(), case.moments()], np.zeros(2, np.int64)
    windows = NewestWindows(np.zeros(2), zeros, Numbers(case).complex_(3, 2, 2), np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"array|few|place"):
        process_each(case.settings, each, windows._replace(**wrong))
    other = [case.moments(), replace(case, lines=3).moments()]
    with pytest.raises(ValueError, match="array"):
        process_each(case.settings, other, windows)
    for moments in (*each, other[0]):
        assert_same_bits(moments, case.moments())


@pytest.mark.parametrize(
    "wrong",
    [
        {"place": 2},
        {"place": 1 << 40},
        {"whole": np.ones(4, np.bool_)},
        {"whole": np.ones(3, np.uint8)},
        {"clean": np.ones((3, 1), np.bool_)},
        {"spectrum": np.zeros((3, 3, 1), np.complex128)},
        {"spectrum": np.zeros((3, 3, 2), np.complex64)},
        {"spectrum": np.zeros((1, 3, 2), np.complex128)},
        {"spectrum": np.zeros((3, 3, 4), np.complex128)[:, :, ::2]},
        {"distortion": np.zeros((3, 3)), "verdict": np.zeros(3, np.int64)},
        {"distortion": np.zeros((3, 2)), "invalid": np.zeros((2, 2), np.bool_), "verdict": np.zeros(3, np.int64)},
        {"distortion": np.zeros((3, 2)), "verdict": np.array([0, 3, 0])},
        {"distortion": np.zeros((3, 2)), "verdict": np.array([0, -1, 0])},
        {"distortion": np.zeros((3, 2)), "verdict": None},
        {"invalid": np.zeros((0, 2), np.bool_)},
        {"moment": np.zeros((2, 3))},
    ],
)
def test_arrays_of_another_shape_or_type_are_refused_and_nothing_changes(wrong):
    case = Case(2, 2, 0, 0.8, False, 1, 2, NOISE_SCATTER, 0.0, False, False, 4.0, 0, (3,), 0)
    moments, windows = case.moments(), Numbers(case).windows(3, 0, 0.0)
    with pytest.raises(ValueError, match=r"array|few|refused|contiguous"):
        process_lines(case.settings, moments, windows._replace(**wrong))
    assert_same_bits(moments, case.moments())
