"""Bounds of modes from the output alone: short form of `python -m studies.output_only`."""

from __future__ import annotations

import numpy as np

from studies.output_only import CASES, measure, row


def test_a_damped_mode_beside_a_rigid_motion_is_one_curve_whose_bounds_cover() -> None:
    """Six runs: of errors that are covered by 95 %, four or fewer of six are in one case of 500."""
    case = next(case for case in CASES if case.name == "damping 7 %")
    result = measure(case, 6)
    print(row(case, result))
    assert result.curves == [1] * 6
    assert result.found > 0.95
    assert np.all(np.mean(np.abs(result.errors) < 1.96, axis=0) >= 0.7)
