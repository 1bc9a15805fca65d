"""A machine with several inputs that changes within a recording is found, and the bounds cover its response."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import livebode
from livebode.core import Block, Lines, MatrixResponses
from livebode.excitation import MatrixExcitation
from livebode.fitting import MatrixDriftTest, Repetitions, mean_matrix
from livebode_matrix import MatrixSettings, MatrixTracker
from livebode_reports.matrix_report import read_matrix
from tests.support.gantry_runs import (
    DWELL,
    LINES,
    SETTLE,
    SOFTENING,
    gantry_axis,
    gantry_block,
    gantry_log,
    gantry_run,
    softening_block,
)


def plain(values: np.ndarray, noise: float, seed: int, *, memory: int, average: bool) -> MatrixResponses:
    """Two inputs and outputs without dynamics, (repetitions, 2, 2), constant within a repetition."""
    lines = Lines.parse("50:150:50", rate_hz=1000, window=100)
    excitation = MatrixExcitation.orthogonal(lines, 2, dwell=2, settle=1)
    u = excitation.samples
    y = np.concatenate([g @ u for g in values], axis=1)
    y = y + noise * np.random.default_rng(seed).standard_normal(y.shape)
    w = np.tile(u, len(values))
    settings = MatrixSettings(
        lines=lines, output=["y1", "y2"], input=["u1", "u2"], excitation=["w1", "w2"], dwell=2, settle=1, hop=100,
        memory=memory, average=average,
    )  # fmt: skip
    block = Block(np.vstack([y, w, w]), ("y1", "y2", "u1", "u2", "w1", "w2"), rate_hz=1000)
    return MatrixTracker(settings).process(block)


def drift_test(responses: MatrixResponses, cut: int | None = None) -> MatrixDriftTest:
    lines, outputs, inputs = responses.value.shape[1:]
    test = MatrixDriftTest((lines, outputs, inputs), responses.lines.rate_hz, Repetitions.of(responses))
    for at in range(0, len(responses), cut or len(responses)):
        test.add(responses[at : at + (cut or len(responses))])
    return test


@pytest.mark.parametrize("memory", [4, 20])
def test_averages_have_the_drift_of_their_repetitions(memory: int) -> None:
    """While they grow, and when they lose one repetition for each that they gain."""
    values = np.array([[2.0, 1.0], [0.0, 3.0]]) + np.linspace(0, 0.3, 20)[:, np.newaxis, np.newaxis]
    windows = plain(values, 0.01, 1, memory=3, average=False)
    averages = plain(values, 0.01, 1, memory=memory, average=True)
    expected, found = drift_test(windows).result(), drift_test(averages).result(whole=True)
    assert found.significant
    for name in ("value", "change", "begin", "end", "rms"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-9)


def test_parts_give_the_bits_of_the_whole_and_a_gap_begins_again() -> None:
    values = np.array([[2.0, 1.0], [0.0, 3.0]]) + np.linspace(0, 0.3, 20)[:, np.newaxis, np.newaxis]
    averages = plain(values, 0.01, 1, memory=4, average=True)
    assert drift_test(averages).snapshot() == drift_test(averages, cut=3).snapshot()


def test_only_the_entry_that_changes_is_named_though_others_share_its_noise() -> None:
    values = np.tile([[2.0, 1.0], [0.5, 3.0]], (20, 1, 1))
    values[:, 1, 0] += np.linspace(0, 0.1, 20)
    found = drift_test(plain(values, 0.02, 3, memory=3, average=False)).result()
    assert found.lines.reshape(-1, 2, 2).all(axis=0).tolist() == [[False, False], [True, False]]
    assert not found.lines.reshape(-1, 2, 2)[:, [0, 0, 1], [0, 1, 1]].any()


def test_a_mean_of_few_matrices_has_no_known_variation() -> None:
    mean = mean_matrix(plain(np.tile([[2.0, 1.0], [0.0, 3.0]], (4, 1, 1)), 0.02, 3, memory=3, average=False))
    assert np.isnan(mean.variation).all()
    assert np.allclose(mean.sigma**2, mean.noise_variance)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return gantry_log(tmp_path_factory.mktemp("gantry") / "gantry.parquet", softening_block())


@pytest.mark.parametrize("average", [False, True])
def test_a_run_says_which_entry_drifts_and_its_bounds_contain_it(log: Path, tmp_path: Path, average: bool) -> None:
    experiments = {"dwell_periods": DWELL, "settle_periods": SETTLE, "memory": SOFTENING if average else 3}
    axis = gantry_axis(log, experiments=experiments, tracking={"average": average, "hop": 800})
    outcome = gantry_run(axis, tmp_path / "run")
    found = livebode.Run(tmp_path / "run")
    drift, event = found.summary["drift"], next(event for event in found.events if event.kind == "drift")
    most = max(drift["lines"], key=lambda line: line["percent"])
    assert drift["found"]
    assert drift["components"][0]["kind"] == "trend"
    assert f"{most['output']}/{most['input']}: the response drifts" in str(event.message)
    mean = mean_matrix(found.matrix)
    assert np.all(mean.variation[0, LINES.frequency_hz > 50].max(axis=0) > 0)
    assert outcome.matrix is not None
    varied = np.nan_to_num(outcome.matrix.variation) > 0
    assert varied.any() == average
    if average:  # both are of all repetitions
        assert np.allclose(outcome.matrix.sigma, mean.sigma, rtol=0.1)
        entry = livebode.Run(tmp_path / "run", entry=f"{most['output']}/{most['input']}").average
        expected = outcome.matrix.entry(most["output"], most["input"])[0]
        assert np.array_equal(entry.sigma, expected.sigma)
        assert np.array_equal(entry.variation, expected.variation)
        assert read_matrix(tmp_path / "run").newest.equals(outcome.matrix)


def test_a_run_at_rest_has_no_drift(tmp_path: Path) -> None:
    block = gantry_block(repetitions=7)
    gantry_run(gantry_axis(gantry_log(tmp_path / "rest.parquet", block)), tmp_path / "run")
    assert livebode.Run(tmp_path / "run").summary["drift"] == {"found": False, "lines": []}


@pytest.mark.parametrize("average", [False, True])
def test_several_outputs_of_one_input_are_tested_window_by_window(average: bool) -> None:
    lines = Lines.parse("50:150:50", rate_hz=1000, window=100)
    u = np.tile(MatrixExcitation.orthogonal(lines, 1).samples, 40)
    gain = np.array([[2.0], [1.0]]) * (1 + np.array([[0.0], [0.1]]) * np.arange(u.shape[1]) / u.shape[1])
    y = gain * u + 0.01 * np.random.default_rng(2).standard_normal((2, u.shape[1]))
    settings = MatrixSettings(
        lines=lines, output=["y1", "y2"], input="u1", estimator="direct", hop=50, average=average, memory=40
    )
    found = MatrixTracker(settings).process(Block(np.vstack([y, u]), ("y1", "y2", "u1"), rate_hz=1000))
    drift = drift_test(found).result()
    assert drift.significant
    assert drift.lines.reshape(-1, 2).all(axis=0).tolist() == [False, True]
    np.testing.assert_allclose(np.abs(drift.change.reshape(-1, 2)[:, 1]), 0.1, rtol=0.1)
