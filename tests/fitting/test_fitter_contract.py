"""A Fitter gives the same however its responses arrive, after a snapshot, and says what cannot be."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Event, FitError, GridError, Lines, Parameters, Responses, SignalError, UsageError
from livebode.fitting import EvaluationGrid, Fitter, TwoMass, fit, model_named
from livebode.fitting.weights import epsilon_for
from tests.support.errors import refused
from tests.support.fitted import LINES, TRUTH, noisy
from tests.support.found import with_events

BELT = TwoMass(radius_m=0.019)
ROWS = 70


def run(late_s: float = 0.0) -> Responses:
    """A wandering stiffness, with some rows that hold nothing, and a delay."""
    grid = EvaluationGrid.of(LINES)
    values = np.repeat(TRUTH[np.newaxis], ROWS, axis=0)
    values[:, 2] *= np.linspace(1.0, 1.4, ROWS)
    values[:, -1] = late_s
    found = noisy(BELT.at(values, grid), LINES, 0.01, ROWS)
    value = found.value.copy()
    value[30:34] = np.nan
    value[50] = 1.0
    return Responses(**{**vars(found), "value": value, "valid": np.isfinite(value)})


def same(one: Parameters, other: Parameters) -> None:
    assert list(one.status) == list(other.status)
    assert np.allclose(one.value, other.value, rtol=1e-6, equal_nan=True)
    assert np.allclose(one.sigma, other.sigma, rtol=1e-6, equal_nan=True)
    assert np.allclose(one.epsilon, other.epsilon, rtol=1e-6, atol=1e-9, equal_nan=True)


@given(st.lists(st.integers(1, 40), max_size=12), st.sampled_from([0.0, 4e-4]))
@settings(max_examples=8, deadline=None)
def test_any_way_of_cutting_gives_the_same(cuts: list[int], late_s: float) -> None:
    every = run(late_s)
    expected, events = with_events(Fitter(BELT).process, every)
    edges = [0, *np.minimum(np.cumsum(cuts, dtype=int), ROWS).tolist(), ROWS]
    fitter = Fitter(BELT)
    again: list[Event] = []
    parts = [fitter.process(every[a:b], again.append) for a, b in pairwise(edges)]
    same(Parameters.join(parts), expected)
    assert [e.kind for e in again] == [e.kind for e in events]


@pytest.mark.parametrize("late_s", [0.0, 4e-4])
def test_a_restored_fitter_continues_with_the_same_bits(late_s: float) -> None:
    every = run(late_s)
    expected = Fitter(BELT).process(every)
    first = Fitter(BELT)
    head = first.process(every[:37])
    second = Fitter(BELT)
    second.restore(first.snapshot())
    same(Parameters.join([head, second.process(every[37:])]), expected)


def test_a_delay_is_taken_by_every_row_that_shows_it_and_by_none_where_it_is_held() -> None:
    late = run(4e-4)
    found = Fitter(BELT).process(late)
    assert np.all(np.abs(found["delay"][found.ok] - 4e-4) < 4 * found.sigma[found.ok, -1])
    assert np.all(Fitter(BELT, fixed={"delay": 0.0}).process(late)["delay"][found.ok] == 0.0)
    assert np.all(Fitter(BELT).process(run())["delay"][found.ok] == 0.0)


def test_events_report_when_fits_are_rejected_and_valid_again() -> None:
    _, events = with_events(Fitter(BELT).process, run())
    assert [e.kind for e in events][:3] == ["fit-resumed", "fit-failed", "fit-resumed"]
    assert [e.sample for e in events][:3] == [399, 20 * 30 + 399, 20 * 34 + 399]
    assert events[1].details["status"] == "no response"


@pytest.mark.parametrize(
    ("arguments", "options", "error"),
    [
        (("two-masses",), {}, (UsageError, "unknown-name", {"argument": "model", "value": "two-masses"})),
        (("rigid",), {"inertia_ratio": 2.0}, (UsageError, "conflict", {"argument": "inertia_ratio", "value": 2.0})),
        ((BELT,), {"fixed": {"jS": 1.0}}, (UsageError, "unknown-name", {"argument": "fixed", "value": "jS"})),
        ((BELT,), {"fixed": {"Js": -1.0}}, (UsageError, "out-of-range", {"parameter": "Js", "value": -1.0})),
        ((BELT,), {"free": ["B", "K"]}, (UsageError, "unknown-name", {"argument": "free", "value": "K"})),
        ((BELT,), {"fixed": {"Js": 1.0, "mL": 1.0, "Keff": 1e5, "bs": 1.0}}, (UsageError, "conflict", {})),
        ((BELT,), {"band_hz": (50.0, 90.0)}, (FitError, "too-few-lines", {"lines": 2, "parameters": 4})),
    ],
)
def test_impossible_fits_are_refused(arguments: tuple, options: dict, error: tuple) -> None:
    kind, code, facts = error
    with refused(kind, code, **facts):
        Fitter(*arguments, **options).process(run())


def test_an_unknown_parameter_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(UsageError) as caught:
        Fitter(BELT, fixed={"jS": 1.0}).process(run())
    assert caught.value.remedy.startswith("did you mean 'Js'?")


def test_other_lines_and_other_quantities_are_refused() -> None:
    every = run()
    fitter = Fitter(BELT)
    fitter.process(every[:3])
    with refused(GridError, "not-alike"):
        fitter.process(Responses(**{**vars(every), "lines": Lines.parse("20:140:20", 4000, 800)}))
    with refused(SignalError, "wrong-quantity", quantity="closed loop"):
        Fitter(BELT).process(Responses(**{**vars(every), "quantity": "closed loop"}))
    for bad in ({"output": "force"}, {"side": "left"}, {"radius_m": -1.0}):
        code, (argument, value) = "out-of-range" if "radius_m" in bad else "not-one-of", *bad.items()
        with refused(UsageError, code, argument=argument, value=value):
            model_named("two-mass", **bad)


def test_a_failed_fit_evaluates_to_nothing() -> None:
    nothing = fit(run()[31], BELT)
    assert nothing.status == "no response"
    with refused(FitError, "not-fitted", status="no response"):
        nothing.response(20.0)
    assert np.isnan(nothing["Keff"])
    assert np.isnan(nothing.bound("resonance"))


def test_the_epsilon_of_a_row_does_not_depend_on_the_rows_beside_it() -> None:
    rng = np.random.default_rng(3)
    rest, size = 1.2 * rng.exponential(size=(2, 40, 9))
    noise = rng.uniform(1, 2, (40, 9))
    dof = np.full(40, 14.0)
    together = epsilon_for(rest, noise, size, dof)
    alone = [epsilon_for(*(part[i : i + 1] for part in (rest, noise, size, dof)))[0] for i in range(40)]
    assert together.tolist() == alone
    assert 10 < np.count_nonzero(together) < 40
