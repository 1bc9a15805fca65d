"""Means of matrices over time cover the plant as often as stated, and a long run is read and shown from them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from livebode.configuration import Axis
from livebode.core import Lines, MatrixResponses, Responses
from livebode.dashboard.run_feed import views_of
from livebode.excitation import MatrixExcitation
from livebode.fitting import SharedWindows, binned_means, combined
from livebode.records import RunRecord, query, thinned
from livebode.runtime import Destination, run
from tests.support.command import write_parquet

RATE_HZ, WINDOW, DWELL, SETTLE, HOP = 1000.0, 20, 5, 2, 5
LINES = Lines.parse("100, 200, 350", rate_hz=RATE_HZ, window=WINDOW)
GAIN = np.array([[2.0, 1.0], [0.5, 3.0]])
SECONDS = 160
STATED = {1.0: 1 - np.exp(-1.0), 2.0: 1 - np.exp(-4.0)}
ENTRIES = [(f"y{o}", f"u{i}") for o in (1, 2) for i in (1, 2)]
SHARED = SharedWindows(WINDOW, DWELL * WINDOW, 2)


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run in segments of a plant without dynamics, whose outputs have white noise."""
    folder = tmp_path_factory.mktemp("means")
    once = MatrixExcitation.orthogonal(LINES, 2, dwell=DWELL, settle=SETTLE).samples
    u = np.tile(once, round(SECONDS * RATE_HZ / once.shape[1]))
    y = GAIN @ u + np.random.default_rng(7).standard_normal(u.shape)
    write_parquet(
        folder / "log.parquet",
        {"t [s]": np.arange(u.shape[1]) / RATE_HZ, "u1": u[0], "u2": u[1], "y1": y[0], "y2": y[1]},
    )
    axis = Axis.of(
        {
            "source": {"log": folder / "log.parquet"},
            "signals": {"output": ["y1", "y2"], "input": ["u1", "u2"]},
            "lines": {"frequencies": "100, 200, 350", "window": WINDOW},
            "tracking": {"estimator": "direct", "hop": HOP},
            "experiments": {"dwell_periods": DWELL, "settle_periods": SETTLE, "memory": 8},
            "record": {"segment_s": 20.3},
        },
        "test",
    )
    return run(axis, Destination(folder / "run", lambda *_: None)).directory


def entry_of(matrix: MatrixResponses, output: int, input: int) -> Responses:
    """An entry from the first matrix of all experiments on."""
    return matrix[np.flatnonzero(matrix.valid.all(axis=(1, 2)))].entry(output, input)


def test_the_bounds_of_means_cover_each_entry_as_often_as_stated(directory: Path) -> None:
    """Bounds of windows that are taken as independent from one experiment to the next are too small."""
    matrix = RunRecord.open(directory, matrix=True).matrix()
    ratios = {}
    for shared in (SHARED, None):
        errors, sigmas, inside = [], [], dict.fromkeys(STATED, 0.0)
        for o, i in np.ndindex(2, 2):
            found = binned_means(entry_of(matrix, o, i), 2.0, shared).means
            error, dof = np.abs(found.value - GAIN[o, i]), found.dof[:, np.newaxis]
            errors.append(error)
            sigmas.append(found.sigma)
            for c in STATED:
                inside[c] += float(np.mean(error <= found.sigma * np.sqrt(dof * (np.exp(c**2 / dof) - 1)))) / 4
        ratios[shared] = float(np.median(sigmas) / np.sqrt(np.mean(np.square(errors))))
        if shared is not None:
            for c, stated in STATED.items():
                assert inside[c] >= stated - 4 * np.sqrt(stated * (1 - stated) / np.size(errors))
    assert ratios[SHARED] == pytest.approx(1.0, rel=0.1)
    assert ratios[None] < 0.85


def test_means_of_ten_seconds_of_a_record_are_those_of_all_responses_in_it(directory: Path) -> None:
    whole = RunRecord.open(directory, matrix=True)
    assert {segment.table for segment in whole.segments} >= {"responses_1s", "responses_1min"}
    for output, input in ENTRIES:
        entry = whole.matrix().entry(output, input)
        found = thinned(whole.entry(output, input), 10.0)
        assert found is not None
        found = found[np.flatnonzero(found.valid.all(axis=1))]
        assert (len(found), found.unit) == (SECONDS / 10, entry.unit)
        for row in (0, 7, len(found) - 1):
            within = entry[np.flatnonzero((entry.time_s // 10 == row) & entry.valid.all(axis=1))]
            np.testing.assert_allclose(found.value[row], within.value.mean(axis=0), rtol=1e-9)
        expected = combined(binned_means(entry, 1.0, SHARED), 10.0).means  # without the cuts of the segments
        np.testing.assert_allclose(np.median(found.sigma), np.nanmedian(expected.sigma), rtol=0.05)


def test_a_query_has_a_row_of_each_entry_and_line_for_each_mean(directory: Path) -> None:
    sql = "SELECT output, input, count(*), sum(responses) FROM responses_1s GROUP BY ALL ORDER BY ALL"
    found = query(RunRecord.open(directory, matrix=True), sql, 10).rows
    matrices = len(RunRecord.open(directory, matrix=True).matrix())
    assert [row[:2] for row in found] == ENTRIES
    for row in found:
        assert SECONDS * len(LINES) <= row[2] < 1.1 * SECONDS * len(LINES)  # cut where segments end
        assert row[3] == matrices * len(LINES)


def test_the_page_of_an_entry_has_means_of_a_long_run(directory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("livebode.dashboard.run_feed._LONG_BYTES", 1)
    monkeypatch.setattr("livebode.dashboard.run_feed._MEANS", SECONDS // 2)
    monkeypatch.setattr("livebode.dashboard.run_feed._RECENT_S", 10.0)
    views = views_of(directory)
    assert [state.entry for state, _ in views] == [f"{output}/{input}" for output, input in ENTRIES]
    state = views[2][0]
    matrices = RunRecord.open(directory, matrix=True).matrix()
    assert state.health()["responses"] == len(matrices)
    shown = state.overview.responses()
    past = shown[np.flatnonzero(shown.valid.all(axis=1) & (shown.time_s < SECONDS - 20))]
    assert 60 < len(past) < SECONDS
    assert np.abs(past.value - GAIN[1, 0]).max() < 6 * np.median(past.sigma)
    group = state.group
    assert group is not None
    for time_s in (None, 70.0, 1e6):
        found = group.at(directory, True, time_s)
        expected = matrices.time_s[-1 if time_s is None else np.argmin(np.abs(matrices.time_s - time_s))]
        assert found.time_s == [expected]
        assert np.isfinite(found.noise).all()
