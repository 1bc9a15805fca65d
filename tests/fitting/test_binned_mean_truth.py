"""Means over spans of time cover the plant as often as stated, also where windows overlap, in any pieces."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.fitting import BinnedMeans, binned_means, combined, mean_response
from tests.support.long_runs import PLANT, noisy_responses

STATED = {1.0: 1 - np.exp(-1.0), 2.0: 1 - np.exp(-4.0)}
"""Probability of a bound for c, as documented for `dof`."""


def coverage(found: BinnedMeans, c: float) -> float:
    dof = found.means.dof[:, np.newaxis]
    bound = found.means.sigma * np.sqrt(dof * (np.exp(c**2 / dof) - 1))
    return float(np.mean(np.abs(found.means.value - PLANT) <= bound))


@pytest.mark.parametrize("bin_s", [1.0, 3.0, 10.0, 60.0])
def test_the_bounds_of_means_cover_the_plant_as_often_as_stated(bin_s: float) -> None:
    responses = noisy_responses(12_000, seed=1)
    whole = binned_means(responses, bin_s)
    parts = [binned_means(responses[begin : begin + 300], bin_s) for begin in range(0, len(responses), 300)]
    pieces = combined(BinnedMeans.join(parts), bin_s)  # as if segments of 75 s were closed
    later = combined(whole, 120.0)
    for found in (whole, pieces, later):
        for c, stated in STATED.items():
            of_chance = 4 * np.sqrt(stated * (1 - stated) / (len(found) * 3))
            assert coverage(found, c) >= stated - of_chance
    if bin_s >= 10.0:  # with some windows in each the bound is not larger than necessary
        for found in (whole, pieces, later):
            error = np.sqrt(np.mean(np.abs(found.means.value - PLANT) ** 2))
            assert np.median(found.means.sigma) == pytest.approx(error, rel=0.12)


def test_one_span_of_the_whole_run_is_the_mean_of_its_responses() -> None:
    responses = noisy_responses(50, seed=2)
    one, reference = binned_means(responses, 1e9), mean_response(responses)
    assert len(one) == 1
    for name in ("value", "sigma", "dof", "coherence", "valid", "first", "sample", "time_s"):
        np.testing.assert_allclose(getattr(one.means, name), getattr(reference, name), rtol=1e-9, err_msg=name)


def test_responses_that_are_not_valid_or_not_ready_are_counted_and_not_in_a_mean() -> None:
    responses = noisy_responses(20, seed=3)
    responses.valid[:8] = False
    responses.value[:8] = np.nan
    responses.ready[10:12] = False
    found = binned_means(responses, 10.0)
    assert found.responses.sum() == len(responses)
    assert (found.count.sum(axis=0) == len(responses) - 10).all()
    kept = np.r_[8:10, 12 : int(found.responses[0])]
    np.testing.assert_allclose(found.means.value[0], responses.value[kept].mean(axis=0))
    invalid = binned_means(responses[:8], 10.0)
    assert not invalid.means.valid.any()
    assert np.isnan(invalid.means.value).all()
