"""The verdicts on lines in C have the bits of their NumPy twin, and do not depend on which periods come together."""

from __future__ import annotations

from dataclasses import dataclass
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Lines, QuantityKind
from livebode.estimation.verdicts import Judge, by_chance
from livebode.kernel import (
    ADDED,
    FORGOTTEN,
    JUDGED,
    MEANS,
    NEWS,
    NEWS_GONE,
    NEWS_INVALID,
    REASONS,
    SCATTER,
    PeriodSpectra,
    PeriodState,
    PeriodVerdicts,
    RepeatingPlan,
    RepeatingSettings,
    judge_periods,
)
from tests.twins import repeating as repeating_twin

SPECIAL = np.array([np.nan, np.inf, -np.inf, 0.0, -0.0, 1e-300, 1e160, -1e5])
LINES = {
    "one": Lines.of_bins([5], 40, 1000.0),
    "even and odd": Lines.of_bins(range(2, 15, 2), 400, 4000.0),
    "odd, at the mains": Lines.of_bins([5, 7, 15, 17, 25, 33, 39], 200, 2000.0),
    "odd": Lines.of_bins([3, 5, 9, 11, 17, 21, 27, 29, 35, 37, 41], 100, 4000.0),
    "many": Lines.of_bins([*range(3, 100, 6), *range(101, 330, 2)], 700, 35000.0),
}


@dataclass(frozen=True)
class Case:
    """A judge, and what the periods are like."""

    lines: str
    signals: tuple[int, int, int]
    instrument: bool
    hann: bool
    differenced: bool
    output: QuantityKind
    noise: float
    distortion: float
    hum: float
    step: float
    special: float
    moving: float
    left_out: float
    pieces: tuple[int, ...]
    seed: int

    def judge(self) -> Judge:
        flags, ticks = np.array([self.differenced, False, False]), np.array([0, 2 * self.differenced, 0])
        return Judge(LINES[self.lines], self.signals, self.instrument, self.hann, flags, ticks, self.output)


cases = st.builds(
    Case,
    lines=st.sampled_from([*LINES, "odd, at the mains", "odd"]),
    signals=st.sampled_from([(0, 1, 2), (0, 2, 2), (0, 1, 1)]),
    instrument=st.booleans(),
    hann=st.sampled_from([False, False, False, True]),
    differenced=st.booleans(),
    output=st.sampled_from(["velocity", "position", "acceleration", "other"]),
    noise=st.sampled_from([1e-6, 0.01, 0.5]),
    distortion=st.sampled_from([0.0, 0.1, 2.0]),
    hum=st.sampled_from([0.0, 3.0]),
    step=st.sampled_from([0.0, 1e-3, 0.5]),
    special=st.sampled_from([0.0, 0.0, 0.0, 1e-4, 0.02]),
    moving=st.sampled_from([0.0, 0.0, 0.05]),
    left_out=st.sampled_from([0.0, 0.1]),
    pieces=st.lists(st.integers(0, 30), min_size=1, max_size=5).map(tuple),
    seed=st.integers(0, 2**32 - 1),
)


def empty_state(judge: Judge) -> PeriodState:
    bins, lines = judge.bins.size, judge.lines
    return PeriodState(
        0.0,
        0.0,
        np.zeros(1, np.int64),
        np.zeros((MEANS, 1, bins)),
        np.zeros((SCATTER, 1, bins)),
        np.zeros(judge.mains.bins.size, np.complex128),
        np.full((9, lines), np.nan),
        np.zeros(lines),
        np.zeros(lines),
        np.zeros(2),
        np.zeros((REASONS, lines), np.bool_),
    )


def excited(rng: np.random.Generator, count: int) -> np.ndarray:
    """Amplitude and phase of the excitation in each period: pauses, and another phase now and then."""
    changes = rng.random(count) < 0.06
    kind = np.cumsum(changes) % 4
    return np.where(kind == 1, 0.0, np.exp(1j * (kind == 3)))


def tones_of(judge: Judge) -> np.ndarray:
    """Bins at multiples of the mains."""
    mains = judge.mains
    places = [group.tones for group in mains.free] + [mains.excited.tones[mains.lines.any(axis=0)] if mains.any else []]
    return mains.bins[np.concatenate(places).astype(np.int64)]


def periods_of(case: Case, judge: Judge) -> PeriodSpectra:
    """Periods of all pieces, after nothing was known."""
    rng, count = np.random.default_rng(case.seed), sum(case.pieces)
    shape = 3, count, judge.window // 2 + 1
    spectra = case.noise * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape))
    lines = judge.bins[: judge.lines]
    excitation = excited(rng, count)[:, np.newaxis]
    spectra[1:] *= np.where(excitation == 0, 1e-9, 1.0)
    spectra[..., lines] += rng.normal(size=(3, 1, lines.size)) * excitation
    spectra[0][:, judge.bins[judge.lines :]] += case.distortion
    spectra[0][:, tones_of(judge)] += case.hum * (np.arange(count) // 40 % 3 != 1)[:, np.newaxis]
    special = rng.random((*shape, 2)) < case.special
    spectra.view(np.float64).reshape(*shape, 2)[special] = rng.choice(SPECIAL, np.count_nonzero(special))
    steps = case.step * rng.integers(0, 2, count)
    return PeriodSpectra(
        spectra,
        rng.random(count) >= case.left_out,
        rng.random(count) < case.moving,
        np.full(judge.lines, np.nan),
        np.zeros((REASONS, judge.lines), np.bool_),
        lambda period: float(steps[period]),
        by_chance,
    )


def some(periods: PeriodSpectra, first: int, last: int, before: PeriodVerdicts | None) -> PeriodSpectra:
    now = periods if before is None else periods._replace(distortion=before.distortion[-1], against=before.against[-1])
    return now._replace(
        spectra=np.ascontiguousarray(periods.spectra[:, first:last]),
        usable=periods.usable[first:last],
        moves=periods.moves[first:last],
        step_of=lambda period: periods.step_of(first + period),
    )


def without_unjudged(found: PeriodVerdicts) -> PeriodVerdicts:
    """What explains a verdict is not specified where there is none."""
    judged = found.happened & JUDGED > 0
    pair = np.where(judged[:, np.newaxis, np.newaxis], found.pair, 0.0)
    return found._replace(pair=pair, steps=np.where(judged[:, np.newaxis], found.steps, 0.0))


def assert_same_bits(one: tuple, other: tuple) -> None:
    for name, a, b in zip(type(one)._fields, one, other):
        both = [np.asarray(part) for part in (a, b)]
        both = [part.view(np.float64) if part.dtype.kind == "c" else part for part in both]
        assert both[0].shape == both[1].shape
        if both[0].dtype.kind == "f":
            unknown = np.isnan(both[0])
            assert (unknown == np.isnan(both[1])).all(), name
            both = [np.where(unknown, 0.0, part).view(np.int64) for part in both]
        assert (both[0] == both[1]).all(), name


def judged_in_pieces(case: Case, judge: Judge, periods: PeriodSpectra) -> tuple[PeriodVerdicts, PeriodState]:
    state, before, begun, every = empty_state(judge), None, 0, []
    for count in case.pieces:
        before, *numbers = judge.process(state, some(periods, begun, begun + count, before))
        state = state._replace(largest=numbers[0], step=numbers[1])
        every.append(before)
        begun += count
    first = (len(part.distortion) - len(part.happened) for part in every)
    skip = [0 if i == 0 else n for i, n in enumerate(first)]
    rows = [
        np.concatenate([getattr(part, name)[n if i < 3 else 0 :] for part, n in zip(every, skip)])
        for i, name in enumerate(PeriodVerdicts._fields)
    ]
    return without_unjudged(PeriodVerdicts(*rows)), state


@settings(max_examples=150, deadline=None)
@given(cases)
def test_verdicts_and_state_have_the_bits_of_the_twin_however_the_periods_are_divided(case):
    judge = case.judge()
    periods = periods_of(case, judge)
    found, state = judged_in_pieces(case, judge, periods)
    of_twin = empty_state(judge)
    expected, largest, step = repeating_twin.process(judge, of_twin, periods)
    assert_same_bits(found, without_unjudged(expected))
    assert_same_bits(state, of_twin._replace(largest=largest, step=step))


def test_the_cases_contain_everything_that_can_happen():
    news, happened, against = set(), set(), np.zeros(REASONS, np.bool_)
    for distortion in (0.0, 2.0):
        about = True, False, False, "velocity", 0.01, distortion, 3.0, 0.5, 0.0, 0.02, 0.02
        case = Case("odd, at the mains", (0, 1, 2), *about, (600,), 1)
        found, _ = judged_in_pieces(case, case.judge(), periods_of(case, case.judge()))
        news, happened = news | set(found.news.ravel().tolist()), happened | set(found.happened.tolist())
        against |= found.against.any(axis=(0, 2))
    assert news == {0, NEWS_INVALID, NEWS_GONE}
    assert against.all()
    assert {0, ADDED, ADDED | JUDGED, ADDED | JUDGED | NEWS, FORGOTTEN, FORGOTTEN | NEWS} <= happened


def test_an_error_in_what_is_rarely_needed_is_raised():
    case = Case("odd", (0, 1, 2), True, False, False, "velocity", 0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, (3,), 1)
    judge = case.judge()

    def failing(_: int) -> float:
        raise ArithmeticError("no step")

    with pytest.raises(ArithmeticError, match="no step"):
        judge.process(empty_state(judge), periods_of(case, judge)._replace(step_of=failing))


def settings_of(judge: Judge) -> RepeatingSettings:
    """What the plan of a judge was made from."""
    with patch("livebode.estimation.verdicts.RepeatingPlan", lambda made: made):
        return judge._plan_of(3)


@pytest.mark.parametrize(
    "wrong",
    [
        {"bins": np.array([51] * 25)},
        {"bins": np.array([-1] * 25)},
        {"bins": np.zeros(3, np.int64)},
        {"of_signal": (0, 1, 3)},
        {"judged_every": 0},
        {"left": np.full(14, 11)},
        {"beside": np.full((2, 11, 4), 14)},
        {"share": np.zeros(14, np.float32)},
        {"after": np.zeros((2, 25), np.complex128)},
        {"multiples": np.zeros((3, 11), np.bool_)},
    ],
)
def test_places_outside_of_the_arrays_are_refused(wrong):
    made = settings_of(Case("odd", (0, 1, 2), True, False, False, "velocity", 0, 0, 0, 0, 0, 0, 0, (3,), 1).judge())
    assert (len(made.bins), len(made.left)) == (25, 14), "the sizes above"
    RepeatingPlan(made)
    with pytest.raises(ValueError, match=r"array|refused"):
        RepeatingPlan(made._replace(**wrong))


@pytest.mark.parametrize(
    "wrong",
    [
        {"spectra": np.zeros((3, 2, 50), np.complex128)},
        {"spectra": np.zeros((2, 2, 51), np.complex128)},
        {"spectra": np.zeros((3, 2, 51), np.complex64)},
        {"usable": np.ones(3, np.bool_)},
        {"moves": np.ones(2, np.uint8)},
        {"distortion": np.zeros(10)},
        {"against": np.zeros((2, 11), np.bool_)},
    ],
)
def test_periods_of_another_shape_or_type_are_refused_and_nothing_changes(wrong):
    case = Case("odd", (0, 1, 2), True, False, False, "velocity", 0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, (2,), 1)
    judge = case.judge()
    state, plan = empty_state(judge), RepeatingPlan(settings_of(judge))
    with pytest.raises(ValueError, match=r"array|refused"):
        judge_periods(plan, state, periods_of(case, judge)._replace(**wrong))
    assert_same_bits(state, empty_state(judge))
