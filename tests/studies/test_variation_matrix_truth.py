"""The study of matrices and of machines under noise that change: bounds cover them, and the change is found."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from studies.variation import linear, rest, step
from studies.variation_matrix import HEADER, lpm, row

RUNS = range(20)


def shares(kind: str, case: Callable[..., Any], *, average: bool) -> dict[str, float]:
    cells = dict(zip(HEADER, row(kind, case, average, RUNS)))
    return {name: float(cell.split()[0]) for name, cell in cells.items() if cell[:1].isdigit()}


@pytest.mark.parametrize("average", [False, True])
@pytest.mark.parametrize(("kind", "reported"), [("matrix", 100), ("lpm", 90)])
def test_bounds_cover_a_machine_that_changes_evenly(kind: str, reported: float, average: bool) -> None:
    """Within 4 and 2.5 points of 63.2 and 98.2 %; with "lpm" some changes are smaller than the noise."""
    found = shares(kind, linear, average=average)
    assert found["reported"] >= reported
    assert abs(found["1 sigma"] - 63.2) < 4
    assert abs(found["2 sigma"] - 98.2) < 2.5
    assert found["width"] < 1.3
    assert abs(found["noise"] - 1) < 0.15
    assert abs(found["variation"] - 1) < 0.15


def test_bounds_cover_a_matrix_that_steps() -> None:
    """Within 1 sigma are more moments than of noise, as of one response."""
    found = shares("matrix", step, average=False)
    assert found["reported"] == 100
    assert found["1 sigma"] > 60
    assert found["2 sigma"] > 95
    assert found["width"] < 1.3


def test_a_step_under_noise_is_dated() -> None:
    """Within a window of the true time."""
    of = lpm(step, np.random.default_rng(7), average=False)
    kinds = {component.kind: component.place for component in of.drift.components}
    at = np.linspace(0, 1, 6001)
    assert abs(kinds["step"] - at[np.argmax(of.course(at) > 0)]) < 1 / 60


@pytest.mark.parametrize("kind", ["matrix", "lpm"])
def test_noise_is_no_change_also_where_outputs_share_it(kind: str) -> None:
    """At 0.5 %, of 20 recordings two or more are reported with a probability of 0.5 %."""
    found = shares(kind, rest, average=False)
    assert found["reported"] <= 5
    assert abs(found["1 sigma"] - 63.2) < 5
