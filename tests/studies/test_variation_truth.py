"""The study of a machine that changes within a recording: its simulation is found, in size and time."""

from __future__ import annotations

import numpy as np
import pytest

from studies.variation import (
    HEADER,
    averaged,
    periodic,
    recorded,
    row,
    step,
)


def test_a_step_is_dated_and_both_ends_are_measured() -> None:
    """Within a window of the true time, and 4 standard deviations (1e-7) of the true ends."""
    of = recorded(step, np.random.default_rng(7))
    _, drift = averaged(of, average=True)
    at = float(np.random.default_rng(7).uniform(0.1, 0.9))
    kinds = {component.kind: component.place for component in drift.components}
    assert abs(kinds["step"] - at) < 1 / 60
    begin, end = of.response(np.array([0.0, 1.0]))
    assert np.all(np.abs(drift.begin - begin) < 4 * drift.begin_sigma + 0.02 * np.abs(of.change))
    assert np.all(np.abs(drift.end - end) < 4 * drift.end_sigma + 0.02 * np.abs(of.change))


def test_a_periodic_change_has_its_frequency() -> None:
    of = recorded(periodic, np.random.default_rng(8))
    _, drift = averaged(of, average=False)
    cycles = float(np.random.default_rng(8).uniform(1.5, 15))
    assert drift.components[0].kind == "periodic"
    assert 1 / drift.components[0].place == pytest.approx(cycles, abs=0.1)


def test_a_row_has_all_columns() -> None:
    cells = row(step, True, range(2))
    assert (len(cells), cells[0], cells[2]) == (len(HEADER), "step", "100.0 %")
