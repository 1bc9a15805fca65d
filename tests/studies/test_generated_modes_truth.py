"""Many modes in one search: structures of `studies.generated_modes`, and sixteen modes at little noise."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.core import Lines
from livebode.fitting import fit_common_poles
from studies.common_modes import machine, measured, sampled
from studies.generated_modes import generated, judged


def test_the_permitted_modes_of_generated_structures_are_found() -> None:
    """At least 95 % of all; `python -m studies.generated_modes` has 200 structures."""
    found = [judged(generated(seed)) for seed in (5, 8, 24)]
    permitted = sum(one.permitted for one in found)
    assert permitted > 10
    assert sum(one.found for one in found) >= 0.95 * permitted
    assert sum(one.false for one in found) <= 1


def test_sixteen_modes_of_little_noise_are_found_without_an_order() -> None:
    """The first orders hardly lower the misfit: their cost rises until most of the modes are in the model."""
    rng = np.random.default_rng(5)
    frequency = 3.0 * 3.4 ** (np.arange(16) / 15 + rng.uniform(-0.02, 0.02, 16))
    modes = tuple(zip(frequency.tolist(), rng.uniform(0.004, 0.012, 16).tolist()))
    lines = Lines.parse("200:1500:5", rate_hz=10000.0, window=10000)
    system = machine(tuple((100 * f, z) for f, z in modes), rng.choice([-1.0, 1.0], (1, 16)))
    found = fit_common_poles(measured(lines, sampled(system, lines), 2e-4, 0))
    assert (found.status, found.order, found.complete) == ("ok", 16, True)
    for i, (f, _) in enumerate(sorted(modes)):
        assert found[f"frequency_{i + 1}"] == pytest.approx(100 * f, abs=4 * found.bound(f"frequency_{i + 1}", 0.68))


def test_seven_modes_of_an_aircraft_are_found_in_a_model_error_of_six_percent() -> None:
    """As of a weakly nonlinear structure: an error of the response that is alike at neighbouring lines, not noise."""
    modes = ((3.48, 0.013), (3.97, 0.016), (5.19, 0.009), (6.60, 0.0054), (7.07, 0.010), (7.32, 0.0046), (9.17, 0.0072))
    lines = Lines.parse("2:15:0.05", rate_hz=100.0, window=2000)
    truth = sampled(machine(modes, np.array([[1.0, -0.8, 0.9, 1.0, -0.6, 2.0, 1.2]])), lines)
    window = np.hanning(9) / np.linalg.norm(np.hanning(9))
    parts = [np.convolve(x, window, "same") for x in np.random.default_rng(0).standard_normal((2, len(lines)))]
    error = 0.06 * (parts[0] + 1j * parts[1]) / np.sqrt(2)
    found = fit_common_poles(measured(lines, truth * (1 + error), 1e-3, 0))
    assert (found.status, found.order, found.complete) == ("ok", 7, False)
    assert "further modes do not explain" in found.about_bounds
    for i, (frequency, _) in enumerate(modes):
        assert found[f"frequency_{i + 1}"] == pytest.approx(frequency, rel=0.005)


def test_a_specified_order_does_not_say_that_further_modes_were_tried() -> None:
    lines = Lines.parse("2:120:2", rate_hz=1000.0, window=1000)
    system = machine(((12.0, 0.02), (60.0, 0.05)), np.array([[1.0, 0.5]]))
    found = fit_common_poles(measured(lines, sampled(system, lines), 0.005, 0), order=1)
    assert "further modes were not tried, because the order is specified" in found.about_bounds
