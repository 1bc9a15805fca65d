"""The line stage in C gives the bits of its NumPy twin."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.estimation.periods import weights_of
from livebode.kernel import (
    CHANGES,
    MEANS,
    NOISE_LARGER,
    NOISE_MOVING,
    NOISE_SCATTER,
    PLACE,
    SCATTER,
    LineMoments,
    LineSettings,
    LineWindows,
    MachineLines,
    NewestWindows,
    instruction_sets,
    process_lines,
    process_newest,
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
            np.zeros((CHANGES, self.places, self.lines)),
            np.zeros((PLACE, self.places)),
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


def machine(case: Case) -> MachineLines:
    return MachineLines(case.moments(), np.zeros(3), np.full(3, np.inf), False)


def chosen(case: Case) -> tuple[np.ndarray, np.ndarray]:
    return np.array([2, 0, 1]), np.arange(case.lines)[::-1].copy()


@settings(max_examples=60, deadline=None)
@given(cases, st.integers(1, 5), st.sampled_from([1.5, 100.0]))
def test_windows_of_several_machines_have_the_bits_of_each_alone_and_of_the_twin(case, machines, factor):
    numbers, about = Numbers(case), case.settings._replace(noise=NOISE_SCATTER, noise_dof=np.inf)
    each, alone, of_twin = ([machine(case) for _ in range(machines)] for _ in range(3))
    largest, ends = np.zeros(machines), False
    for _ in case.pieces:
        place, due = numbers._rng.integers(0, case.places, machines), numbers.flags(0.8, machines)
        each, alone, of_twin = ([one._replace(ends=ends) for one in every] for every in (each, alone, of_twin))
        sums = numbers.complex_(3, machines, case.lines + case.bins_beside)
        windows = NewestWindows(largest, place, sums, chosen(case), numbers.reals(machines, 3), due)
        found, after, taken = process_newest(about, each, windows, factor)
        expected, expected_after, expected_taken = line_twin.process_newest(about, of_twin, windows, factor)
        assert taken.tolist() == expected_taken.tolist()
        assert after.tobytes() == expected_after.tobytes()
        if taken.any():
            assert_same_bits(found, expected)
        for i in range(machines):
            own = windows._replace(
                largest=largest[[i]],
                place=place[[i]],
                sums=sums[:, [i]].copy(),
                moment=windows.moment[[i]],
                due=due[[i]],
            )
            rows, _, _ = process_newest(about, [alone[i]], own, factor)
            if taken[i]:
                row, joined = int(taken[:i].sum()), found._replace(moment=found.moment.T)
                assert_same_bits(rows._replace(moment=rows.moment.T), type(rows)(*(part[[row]] for part in joined)))
            for other in (of_twin[i], alone[i]):
                assert_same_bits(each[i].moments, other.moments)
                assert each[i].sizes.tobytes() == other.sizes.tobytes()
                assert each[i].limits.tobytes() == other.limits.tobytes()
        largest, ends = after, not ends


@pytest.mark.parametrize(
    "wrong",
    [
        {"place": np.array([0, 2])},
        {"place": np.array([0, -1])},
        {"place": np.array([0])},
        {"largest": np.zeros(3)},
        {"sums": np.zeros((3, 3, 2), np.complex128)},
        {"sums": np.zeros((1, 2, 2), np.complex128)},
        {"sums": np.zeros((3, 2, 1), np.complex128)},
        {"chosen": (np.array([0, 1, 3]), np.array([0, 1]))},
        {"chosen": (np.array([0, 1, -1]), np.array([0, 1]))},
        {"chosen": (np.array([0, 1, 2]), np.array([0, 2]))},
        {"chosen": (np.array([0, 1, 2]), np.array([0]))},
        {"chosen": (np.array([0]), np.array([0, 1]))},
        {"moment": np.zeros((3, 2))},
        {"due": np.ones(3, np.bool_)},
    ],
)
def test_of_several_machines_none_changes_where_an_array_is_refused(wrong):
    case = Case(2, 2, 0, 0.8, False, 1, 2, NOISE_SCATTER, 0.0, False, False, 4.0, 0, (3,), 0)
    each, zeros = [machine(case), machine(case)], np.zeros(2, np.int64)
    due, sums = np.ones(2, np.bool_), Numbers(case).complex_(3, 2, 2)
    windows = NewestWindows(np.zeros(2), zeros, sums, chosen(case), np.zeros((2, 3)), due)
    with pytest.raises(ValueError, match=r"array|few|place|such"):
        process_newest(case.settings, each, windows._replace(**wrong), 1e8)
    other = [machine(case), machine(replace(case, lines=3))]
    with pytest.raises(ValueError, match="array"):
        process_newest(case.settings, other, windows, 1e8)
    for one in (*each, other[0]):
        assert_same_bits(one.moments, case.moments())


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
