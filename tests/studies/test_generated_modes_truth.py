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
