"""Modes common to several outputs: the truth is in state space, sampled by SciPy behind its zero-order hold."""

from __future__ import annotations

import control
import numpy as np
import pytest
from scipy import signal

from livebode.core import FitError, GridError, Lines, UsageError
from livebode.fitting import CommonPoles, fit_common_poles
from studies.common_modes import CASES, PROBABILITIES, RATE_HZ, covered, fitted, machine, measured, sampled

DAMPED = ((12.0, 0.02), (60.0, 0.05))


def of(system: control.StateSpace, words: str, share: float, seed: int = 0, **options: object) -> CommonPoles:
    lines = Lines.parse(words, rate_hz=RATE_HZ, window=1000)
    return fit_common_poles(measured(lines, sampled(system, lines), share, seed), **options)  # type: ignore[arg-type]


def test_bounds_of_common_modes_cover() -> None:
    """6 fits, 24 values: 63 and 98 % within four deviations of the binomial; `make common-modes` has 200 of each."""
    _, shares = covered(CASES[0], 6, order=2)
    for share, probability in zip(shares, PROBABILITIES):
        assert abs(share - probability) < 4 * np.sqrt(probability * (1 - probability) / 24)


def test_the_number_of_modes_is_found() -> None:
    found = fitted(CASES[0], seed=1)
    assert (found.order, found.complete) == (2, True)


def test_modes_of_a_fifth_of_a_percent_of_damping_over_decades() -> None:
    """The slowest is between two lines 1 Hz apart: its damping is hardly seen, and may by noise be below zero."""
    modes = ((1.3, 0.002), (25.4, 0.002), (26.3, 0.004), (310.6, 0.002))
    system = machine(modes, np.array([[1.0, 1.0, 0.8, 0.3], [0.5, -0.4, 1.0, 0.2]]))
    found = of(system, "1:40:1,60:300:20,301:320:1", 0.003)
    assert found.order == 4
    for i, (frequency, damping) in enumerate(modes):
        for name, truth in ((f"frequency_{i + 1}", frequency), (f"damping_{i + 1}", damping)):
            assert found[name] == pytest.approx(truth, abs=4 * found.bound(name, 0.68))
        assert found.bound(f"frequency_{i + 1}") < 5e-3 * frequency


def test_few_lines_show_one_mode_of_a_single_output() -> None:
    found = of(machine(((12.0, 0.05),), np.array([[1.0]])), "6,9,11,12,13,15,20", 0.002)
    assert (found.status, found.order) == ("ok", 1)
    assert found["frequency_1"] == pytest.approx(12.0, abs=4 * found.bound("frequency_1", 0.68))


def test_real_poles_and_a_double_integrator_are_found_as_rational() -> None:
    s = control.tf("s")
    system = control.ss(4e4 * (s / 30 + 1) / (s**2 * (s / 50 + 1) * (s**2 / 1e4 + 0.06 * s / 100 + 1)))
    found = of(system, "1:40:1", 0.003, model="rational")
    assert found.order == 3
    assert found["pole_1"] == pytest.approx(50 / (2 * np.pi), abs=4 * found.bound("pole_1", 0.68))
    assert found["frequency_1"] == pytest.approx(100 / (2 * np.pi), abs=4 * found.bound("frequency_1", 0.68))
    assert found["1/s² y1"] == pytest.approx(4e4, abs=4 * found.bound("1/s² y1", 0.68))


def test_noise_alone_shows_no_mode() -> None:
    lines = Lines.parse("2:40:2", rate_hz=RATE_HZ, window=1000)
    found = fit_common_poles(measured(lines, np.full((1, len(lines)), 1e-6 + 0j), 1e6, 0))
    assert found.status == "not seen"
    assert "neither a pole nor an integrator" in found.sentence


def test_residues_agree_with_partial_fractions_of_scipy() -> None:
    system = machine(DAMPED, np.array([[1.0, 0.5]]))
    below, above = control.tfdata(control.tf(system))[::-1]
    residues, poles, _ = signal.residue(above[0][0], below[0][0])
    found = of(system, "2:120:2", 1e-6)
    for i, (frequency, _) in enumerate(DAMPED):
        at = np.argmin(np.abs(poles - 2j * np.pi * frequency))
        assert found[f"residue_{i + 1} y1"] == pytest.approx(abs(residues[at]), rel=1e-4)
        assert found[f"phase_{i + 1} y1"] == pytest.approx(np.degrees(np.angle(residues[at])), abs=0.01)


def test_an_order_that_is_specified_is_fitted_and_its_misfit_is_reported() -> None:
    found = of(machine(DAMPED, np.array([[1.0, 0.5]])), "2:120:2", 0.005, order=1)
    assert found.order == 1
    assert found.specified
    assert not found.complete
    assert found.epsilon[0] > 0.02


def test_wrong_arguments_and_different_lines_are_refused() -> None:
    lines = [Lines.parse(words, rate_hz=RATE_HZ, window=1000) for words in ("2:40:2", "2:42:2")]
    system = machine(DAMPED, np.array([[1.0, 0.5]]))
    one, other = (measured(of_these, sampled(system, of_these), 0.01, 0)[0] for of_these in lines)
    with pytest.raises(GridError, match="different lines"):
        fit_common_poles([one, other])
    with pytest.raises(UsageError, match="order=99"):
        fit_common_poles([one], order=99)
    with pytest.raises(UsageError, match="not supported"):
        fit_common_poles([one], "physical")  # type: ignore[arg-type]
    with pytest.raises(FitError, match="has no lines"):
        fit_common_poles([one], band_hz=(400.0, 450.0))
    few = fit_common_poles([one], band_hz=(10.0, 14.0), order=3)
    assert few.status == "no response"
    with pytest.raises(FitError, match="no fit to evaluate"):
        few.response([10.0])
