"""Discrete rational models against systems that are known, and their covariance against the scatter of many fits."""

from __future__ import annotations

import control
import numpy as np
import pytest

from livebode.core import FitError, Lines, Responses, UsageError
from livebode.fitting import EvaluationGrid, Rational, TwoMass, fit_rational, rational_of
from livebode.fitting.transfer import to_discrete
from tests.support.errors import refused
from tests.support.fitted import TRUTH, noisy

RATE_HZ = 2000.0
LINES = Lines.parse("20:120:5", rate_hz=RATE_HZ, window=400)
BELT = TwoMass(radius_m=0.019)
B, A = to_discrete(BELT.continuous(TRUTH), RATE_HZ)
COEFFICIENTS = np.concatenate([B[::-1], A[1:][::-1]])
METHODS = ("levy", "sanathanan-koerner", "maximum likelihood")


def held() -> np.ndarray:
    """By python-control."""
    transfer = BELT.continuous(TRUTH)
    system = control.sample_system(
        control.ss(control.tf(transfer.numerator, [*transfer.denominator, 0.0])), 1 / RATE_HZ
    )
    return np.array([complex(system(z)) for z in LINES.z])


@pytest.mark.parametrize("method", METHODS)
def test_without_noise_the_system_is_found(method: str) -> None:
    exact = noisy(held(), LINES, 1e-9, 3)
    found = fit_rational(exact, order=3, method=method)
    assert list(found.status) == ["ok"] * 3
    assert np.allclose(found.value, COEFFICIENTS, rtol=1e-4)
    model = rational_of(found, 1, RATE_HZ)
    assert np.allclose(model.response(LINES.frequency_hz), held(), rtol=1e-6)
    assert complex(model.to_tf()(LINES.z[3])) == pytest.approx(held()[3], rel=1e-6)
    poles = model.continuous().poles()
    assert np.abs(poles[-1]) / (2 * np.pi) == pytest.approx(BELT.derived(TRUTH)[0], rel=1e-3)


@pytest.mark.parametrize("method", METHODS)
def test_the_covariance_is_the_scatter_of_many_fits(method: str) -> None:
    found = fit_rational(noisy(held(), LINES, 1e-3, 600), order=3, method=method)
    assert found.ok.all()
    scatter = found.value.std(axis=0) / np.sqrt(np.mean(found.sigma**2, axis=0))
    bias = (found.value.mean(axis=0) - COEFFICIENTS) / found.value.std(axis=0)
    print(f"{method}: scatter over sigma {scatter.round(3)}, bias over scatter {bias.round(2)}")
    assert np.allclose(scatter, 1, atol=0.12)
    if method == "maximum likelihood":
        assert np.abs(bias).max() < 4 / np.sqrt(600) + 0.05
        assert np.mean(found.chi2 / found.dof) == pytest.approx(1, abs=0.05)


def test_maximum_likelihood_scatters_least() -> None:
    spread = {}
    for method in METHODS:
        found = fit_rational(noisy(held(), LINES, 3e-3, 400), order=3, method=method)
        model = np.array([rational_of(found, i, RATE_HZ).response(LINES.frequency_hz) for i in range(len(found))])
        spread[method] = float(np.sqrt(np.mean(np.abs(model / held() - 1) ** 2)))
    print(spread)
    assert spread["maximum likelihood"] < min(spread["levy"], spread["sanathanan-koerner"])


def test_every_order_and_numerator_order_is_fitted() -> None:
    poles = 0.9 * np.exp(1j * np.array([0.1, -0.1, 0.25, -0.25]))
    system = Rational(np.array([0.3, -0.2]), np.poly(poles).real, RATE_HZ)
    lines = Lines.parse("20:300:10", rate_hz=RATE_HZ, window=400)
    exact = noisy(system.response(lines.frequency_hz), lines, 1e-9, 1)
    for method in METHODS:
        found = fit_rational(exact, order=4, numerator_order=1, method=method)
        assert found.names == ("b0", "b1", "a0", "a1", "a2", "a3")
        assert np.allclose(
            found.value[0], [*system.numerator[::-1], *system.denominator[1:][::-1]], rtol=1e-4, atol=1e-6
        )


def test_a_fit_of_too_low_an_order_has_a_large_epsilon() -> None:
    found = fit_rational(noisy(held(), LINES, 1e-3, 1), order=1, method="maximum likelihood")
    assert found.epsilon[0] > 0.1
    assert found.chi2[0] > 100 * found.dof[0]


def test_impossible_orders_are_refused_and_lines_without_a_response_are_left_out() -> None:
    good = noisy(held(), LINES, 1e-3, 2)
    for argument, options in (
        ("order", {"order": 0}),
        ("order", {"order": 3, "numerator_order": 3}),
        ("method", {"order": 3, "method": "arx"}),
    ):
        code = "out-of-range" if argument == "order" else "not-one-of"
        with refused(UsageError, code, argument=argument, value=options[argument]):
            fit_rational(good, **options)
    with refused(FitError, "too-few-lines", lines=7):
        fit_rational(noisy(np.ones(7) + 0j, Lines.parse("20:140:20", 4000, 400), 0.1, 1), order=20)
    valid = good.valid.copy()
    valid[0, 3:] = False
    found = fit_rational(Responses(**{**vars(good), "valid": valid}), order=3)
    assert list(found.status) == ["no response", "ok"]
    assert np.isnan(found.value[0]).all()


def test_a_discrete_model_has_the_response_of_the_held_continuous_one() -> None:
    grid = EvaluationGrid.of(LINES)
    assert np.allclose(Rational(B, A, RATE_HZ).response(LINES.frequency_hz), BELT.at(TRUTH, grid), rtol=1e-8)
