"""Short form of `python -m studies fits`: at standstill and along a stroke."""

from __future__ import annotations

import numpy as np

from studies.fits import AFTER_S, TRUTH, fitted_at_standstill, least_variance, moving


def test_fits_at_standstill_reach_the_cramer_rao_bound_and_their_bounds_cover_the_truth() -> None:
    found = fitted_at_standstill(120)
    assert found.ok.all()
    ratio = np.mean(np.log(found.value[:, :4] / TRUTH[:4]) ** 2, axis=0) / least_variance()
    cover = np.mean(np.abs(found.value - TRUTH)[:, :4] <= found.bound()[:, :4], axis=0)
    print(f"over the Cramér–Rao bound {ratio.round(2)}, coverage {cover.round(3)}")
    assert ratio.max() <= 1.2 + 3 * np.sqrt(2 / 120)
    assert cover.min() >= 0.95 - 3 * np.sqrt(0.05 * 0.95 / 120)


def test_fits_along_a_corrected_stroke_are_within_the_targets() -> None:
    found, axis = moving(1)
    assert AFTER_S < 0.2
    assert found.ok.all()
    keff = found["Keff"] / axis.mechanics.stiffness_at(found.schedule) - 1
    js = found["Js"] / axis.mechanics.inertia_kg_m2 - 1
    assert np.sqrt(np.mean(keff**2)) <= 0.0065
    assert np.sqrt(np.mean(js**2)) <= 0.004
