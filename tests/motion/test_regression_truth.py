"""The covariance of the friction's regression, against noise of known correlation."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.motion.robust_regression import regress

RUNS, SAMPLES = 1500, 300
LAGS = np.exp(-(np.arange(6.0) ** 2) / 4)


@pytest.mark.parametrize("lags", [np.ones(1), LAGS], ids=["white", "smoothed"])
def test_the_mean_covariance_is_the_true_one_also_where_few_samples_determine_a_value(lags: np.ndarray) -> None:
    rng = np.random.default_rng(4)
    used = np.arange(SAMPLES) % 60 < 53
    bursts = np.where(np.arange(SAMPLES) % 75 < 4, 1.0, 0.0) * np.sign(np.sin(np.arange(SAMPLES) / 24))
    columns = np.stack([bursts, np.sin(np.arange(SAMPLES) / 12), np.ones(SAMPLES)], axis=1)
    correlation = sum(
        (size * (np.eye(SAMPLES, k=lag) + (lag > 0) * np.eye(SAMPLES, k=-lag)) for lag, size in enumerate(lags)),
        start=np.zeros((SAMPLES, SAMPLES)),
    )
    root = np.linalg.cholesky(correlation + 1e-3 * np.eye(SAMPLES))
    found = [regress(columns, root @ rng.standard_normal(SAMPLES), used, lags) for _ in range(RUNS)]
    true = np.linalg.pinv(columns[used]) @ correlation[np.ix_(used, used)] @ np.linalg.pinv(columns[used]).T
    variance = np.array([np.diag(one.covariance) for one in found])
    # The mean of 1,500 variances of few degrees of freedom is known to 5 % (three sigma).
    np.testing.assert_allclose(variance.mean(axis=0), np.diag(true), rtol=0.05)
    # Their scatter is that of chi-square with the stated degrees of freedom.
    stated = 2 / found[0].dof
    np.testing.assert_allclose(variance.var(axis=0) / variance.mean(axis=0) ** 2, stated, rtol=0.3)
