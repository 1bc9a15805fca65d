"""The proposal of `livebode tune` that the sliders start from, also damaged or of another controller."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from livebode.core import PID, Cascade, PositionPD
from livebode_control.trial.loop_trials import proposed_controller
from livebode_control.tuning import LoopSpecification

RATE_HZ = 4000.0
VELOCITY = PID(gain=-0.2, integral_time_s=0.1, derivative_time_s=1e-3, derivative_filter_s=1e-3, rate_hz=RATE_HZ)
CASCADE = Cascade(VELOCITY, PID(gain=5.0, rate_hz=RATE_HZ))
POSITION_PD = PositionPD(position_gain=3.0, velocity_gain=-0.2, rate_hz=RATE_HZ)
NOTCH = {"frequency_hz": 60.0, "depth_db": 20.0, "damping": 0.5}


def store(run: Path, controller: Any, **changed: Any) -> None:
    values = controller if isinstance(controller, dict) else asdict(controller)
    specification = asdict(LoopSpecification())
    stored = {"specification": specification, "controller": values, "notches": [], "low_passes_hz": [], "entry": None}
    (run / "tune.json").write_text(json.dumps(stored | changed), encoding="utf-8")


@pytest.mark.parametrize("controller", [VELOCITY, CASCADE, POSITION_PD])
def test_gains_without_filters_are_a_proposal(tmp_path: Path, controller: PID | Cascade | PositionPD) -> None:
    assert proposed_controller(tmp_path, controller) is None
    store(tmp_path, {})
    assert proposed_controller(tmp_path, controller) is None
    store(tmp_path, controller)
    found = proposed_controller(tmp_path, controller)
    assert found is not None
    assert found["gains"]["gain"] == -0.2
    assert found["notches"] == found["low_passes_hz"] == []


@pytest.mark.parametrize(
    "values",
    [
        {}, {"velocity": 1}, {"velocity": {"gain": "x"}}, asdict(PID(gain=0.2, rate_hz=RATE_HZ)),
        {**asdict(CASCADE), "velocity": {**asdict(VELOCITY), "gain": 0.2}},
        {**asdict(CASCADE), "velocity": {**asdict(VELOCITY), "gain": None}}, {"\u00e4": 1},
    ],
)  # fmt: skip
def test_damaged_gains_and_those_of_another_controller_are_not_used(tmp_path: Path, values: dict[str, Any]) -> None:
    """As are those with another sign. The filters are."""
    store(tmp_path, values, notches=[NOTCH])
    found = proposed_controller(tmp_path, CASCADE)
    assert found is not None
    assert found["gains"] is None
    assert found["notches"] == [{"hz": 60.0, "depth_db": 20.0, "damping": 0.5}]


@pytest.mark.parametrize(
    "changed",
    [
        {"notches": "none"}, {"notches": [NOTCH | {"frequency_hz": 0.0}]}, {"notches": [NOTCH | {"depth_db": "deep"}]},
        {"low_passes_hz": [-1.0]}, {"entry": "velocity2/u1"},
    ],
)  # fmt: skip
def test_without_its_filters_nothing_is_proposed_nor_for_another_entry(tmp_path: Path, changed: dict[str, Any]) -> None:
    store(tmp_path, CASCADE, **changed)
    assert proposed_controller(tmp_path, CASCADE) is None
