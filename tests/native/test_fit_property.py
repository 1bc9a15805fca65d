"""The fit in C gives the bits of its NumPy twin, and those of a row alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.fitting import EvaluationGrid, PhysicalModel, Rigid, TwoMass, TwoMassGain
from livebode.fitting.problem import Problem
from livebode.kernel import FitModel, FitRows, fit, fit_epsilon, fit_response
from tests.twins import fit as fit_twin
from tests.twins.elementary import exp, expm1, log, turned

RATE_HZ = 4000.0
BELT = np.array([0.0028, 6.7, 5.0e5, 130.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True)
class Case:
    """A model, what is free, and rows, some of which are not responses of it."""

    model: PhysicalModel
    lines: int
    rows: int
    free_delay: bool
    held: bool
    with_start: bool
    with_epsilon: bool
    noise: float
    strange: float
    dragged: bool
    seed: int

    @property
    def truth(self) -> np.ndarray:
        if isinstance(self.model, Rigid):
            return np.array([0.005, 0.0, 0.0])
        if isinstance(self.model, TwoMassGain):
            return np.array([200.0, 54.0, 76.0, 0.03, 0.02, 0.0])
        return np.delete(BELT, 1) if self.model.inertia_ratio else BELT

    def problem(self) -> tuple[FitModel, np.ndarray, FitRows]:
        rng = np.random.default_rng(self.seed)
        grid = EvaluationGrid(np.sort(rng.uniform(5.0, 400.0, self.lines)), RATE_HZ)
        held = {self.model.names[0]: float(self.truth[0])} if self.held and self.truth.size > 3 else {}
        if self.dragged and self.model.frictions and self.held:
            held[self.model.names[-2]] = 0.02
        problem = Problem(self.model, grid, held, ("delay",) if self.free_delay else ())
        values = self.truth * rng.uniform(0.7, 1.4, (self.rows, self.truth.size))
        values[:, -1] = rng.uniform(-3.0, 20.0, self.rows) / RATE_HZ if self.free_delay else 0.0
        if self.dragged and not isinstance(self.model, TwoMassGain):
            values[:, -2] = rng.uniform(0.3, 40.0 if self.model.names[-2] == "BL" else 0.5, self.rows)
        shape = self.rows, self.lines
        native = problem.native
        assert native is not None
        value = fit_response(native, RATE_HZ, values, grid.frequency_hz)
        sigma = self.noise * np.abs(value)
        value = value + sigma * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape))
        odd = rng.random(shape) < self.strange
        value[odd] = rng.choice([0.0, 1e160, 1.0, -3j, np.nan], np.count_nonzero(odd))
        sigma[rng.random(shape) < self.strange] = np.nan
        use = (rng.random(shape) > 0.1) & np.isfinite(value)
        start = problem.with_held(values * rng.uniform(0.8, 1.25, values.shape)) if self.with_start else None
        if start is not None and self.strange:
            start[0] = np.nan
        epsilon = rng.choice([0.0, 1e-3, 0.1], self.rows) if self.with_epsilon else None
        noise_dof = rng.choice([np.inf, 9.0, 2.0, np.nan], self.rows)
        return native, grid.frequency_hz, FitRows(value, sigma, use, noise_dof, start, epsilon)


MODELS = [
    Rigid(), Rigid(output="position", side="load", radius_m=0.02), TwoMass(radius_m=0.019),
    TwoMass(output="position", radius_m=0.019), TwoMass(side="load", radius_m=0.019, inertia_ratio=0.9),
    TwoMass(radius_m=0.019, inertia_ratio=0.9, output="position"), TwoMassGain(), TwoMassGain(output="position"),
]  # fmt: skip
cases = st.builds(
    Case,
    model=st.sampled_from(MODELS),
    lines=st.sampled_from([5, 8, 13, 21]),
    rows=st.integers(1, 2),
    free_delay=st.booleans(),
    held=st.booleans(),
    with_start=st.sampled_from([True, True, True, False]),
    with_epsilon=st.booleans(),
    noise=st.sampled_from([0.0, 1e-3, 0.03]),
    strange=st.sampled_from([0.0, 0.0, 0.1]),
    dragged=st.booleans(),
    seed=st.integers(0, 2**32 - 1),
)


def same_bits(one: np.ndarray, other: np.ndarray) -> bool:
    if one.dtype.kind not in "fc":
        return bool((one == other).all())
    a, b = (x.view(np.float64) for x in (one, other))
    unknown = np.isnan(a)
    return bool((unknown == np.isnan(b)).all() and (a[~unknown].view(np.int64) == b[~unknown].view(np.int64)).all())


@settings(max_examples=10, deadline=None)
@given(cases)
def test_rows_have_the_bits_of_the_twin(case: Case) -> None:
    native, frequency_hz, rows = case.problem()
    found, expected = fit(native, frequency_hz, RATE_HZ, rows), fit_twin.fit(native, frequency_hz, RATE_HZ, rows)
    for name, one, other in zip(found._fields, found, expected):
        assert same_bits(one, other), (name, one, other)


@settings(max_examples=30, deadline=None)
@given(cases, st.integers(2, 5))
def test_a_row_does_not_depend_on_those_beside_it(case: Case, rows: int) -> None:
    native, frequency_hz, every = replace(case, rows=rows).problem()
    together = fit(native, frequency_hz, RATE_HZ, every)
    for i in range(rows):
        alone = FitRows(*(None if part is None else part[i : i + 1] for part in every))
        found = fit(native, frequency_hz, RATE_HZ, alone)
        assert all(same_bits(one, other[i : i + 1]) for one, other in zip(found, together))


@settings(max_examples=25, deadline=None)
@given(cases, st.floats(-5.0, 40.0), st.sampled_from([1e-9, 0.3, 1.0, 60.0]), st.sampled_from([0.0, 0.01, 3.0]))
def test_responses_have_the_bits_of_the_twin_and_are_those_of_the_model(
    case: Case, ticks: float, damping: float, friction: float
) -> None:
    native, frequency_hz, _ = case.problem()
    values = np.array([case.truth, 1.3 * case.truth])
    if (name := {TwoMass: "bs", TwoMassGain: "resonance_damping"}.get(type(case.model))) is not None:
        values[:, case.model.names.index(name)] *= damping
    for name in case.model.frictions:
        values[:, case.model.names.index(name)] = friction * (100.0 if name == "BL" else 1.0)
    values[:, -1] = ticks / RATE_HZ
    every = np.sort(np.concatenate([frequency_hz, np.geomspace(1.0, 2000.0, 90)]))
    found = fit_response(native, RATE_HZ, values, every)
    assert same_bits(found, fit_twin.fit_response(native, RATE_HZ, values, every))
    assert same_bits(found, fit_response(native, RATE_HZ, values, np.array([every, every])))
    expected = case.model.at(values, EvaluationGrid(every, RATE_HZ))
    assert np.allclose(found, expected, rtol=1e-9, atol=1e-13 * np.abs(expected).max())


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 40), st.floats(0.5, 80.0), st.integers(0, 2**32 - 1))
def test_epsilon_has_the_bits_of_the_twin_and_solves_its_equation(lines: int, dof: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rest, noise, size = rng.exponential(size=(3, 2, lines)) * rng.integers(0, 2, (3, 2, lines))
    size = size + 0.1
    every = np.full(2, dof)
    found = fit_epsilon(rest, noise, size, every)
    assert same_bits(found, fit_twin.fit_epsilon(rest, noise, size, every))
    for row in np.flatnonzero(found):
        assert np.sum(2 * rest[row] / (noise[row] + found[row] ** 2 * size[row])) == pytest.approx(dof)


def test_elementary_functions_are_those_of_numpy() -> None:
    x = np.concatenate([np.linspace(-40, 40, 801), np.geomspace(1e-12, 0.4, 50)])
    assert [exp(v) for v in x] == pytest.approx(np.exp(x), rel=1e-15)
    assert [expm1(v) for v in x] == pytest.approx(np.expm1(x), rel=1e-15, abs=0)
    assert [log(v) for v in np.exp(x)] == pytest.approx(x, rel=1e-14, abs=4e-16)
    cosine, sine = turned(50 * x)
    assert cosine == pytest.approx(np.cos(50 * x), abs=3e-16)
    assert sine == pytest.approx(np.sin(50 * x), abs=3e-16)
    assert [exp(v) for v in np.float64([np.inf, -np.inf, 800.0, -800.0])] == [np.inf, 0.0, np.inf, 0.0]
    assert np.isnan([exp(np.float64(np.nan)), log(np.float64(-1.0)), *turned(np.float64(1e7))]).all()


def test_what_the_kernel_cannot_fit_is_refused() -> None:
    native, frequency_hz, rows = Case(MODELS[0], 8, 1, *[False] * 4, 0.01, 0.0, dragged=False, seed=1).problem()
    with pytest.raises(ValueError, match="type or shape"):
        fit(native, frequency_hz[:-1].copy(), RATE_HZ, rows)
    with pytest.raises(ValueError, match="refused"):
        fit(native, frequency_hz, frequency_hz[-1], rows)
    with pytest.raises(ValueError, match="refused"):
        fit(native._replace(kind=9), frequency_hz, RATE_HZ, rows)
    with pytest.raises(ValueError, match="refused"):
        fit_response(native._replace(integrators=3), RATE_HZ, np.ones((1, 3)), frequency_hz)
