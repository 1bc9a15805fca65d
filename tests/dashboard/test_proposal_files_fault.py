"""The files of `livebode tune` that the sliders start from, also damaged or of another controller."""

from __future__ import annotations

from pathlib import Path

import pytest

from livebode.core import PID, Cascade, PositionPD
from livebode.dashboard.proposal_files import proposed_controller
from livebode.margins import notch
from livebode.tuning.code_text import c_header
from livebode.tuning.gains_text import gains_toml

RATE_HZ = 4000.0
VELOCITY = PID(gain=-0.2, integral_time_s=0.1, derivative_time_s=1e-3, derivative_filter_s=1e-3, rate_hz=RATE_HZ)
CASCADE = Cascade(VELOCITY, PID(gain=5.0, rate_hz=RATE_HZ))
POSITION_PD = PositionPD(position_gain=3.0, velocity_gain=-0.2, rate_hz=RATE_HZ)
NOTCH = notch(60.0, 20.0, 0.5, RATE_HZ)


@pytest.mark.parametrize("controller", [VELOCITY, CASCADE, POSITION_PD])
def test_gains_without_filters_are_a_proposal(tmp_path: Path, controller: PID | Cascade | PositionPD) -> None:
    (tmp_path / "filters.h").write_text(c_header([]), encoding="ascii")
    assert proposed_controller(tmp_path, controller) is None
    (tmp_path / "gains.toml").write_text(gains_toml(controller), encoding="ascii")
    found = proposed_controller(tmp_path, controller)
    assert found is not None
    assert found["gains"]["gain"] == -0.2
    assert found["notches"] == found["low_passes_hz"] == []


@pytest.mark.parametrize(
    "text",
    [
        "", "[loop", "loop = 1", "[loop.velocity]\ngain = 'x'", gains_toml(PID(gain=0.2, rate_hz=RATE_HZ)),
        gains_toml(CASCADE).replace("-0.2", "0.2"), gains_toml(CASCADE).replace("-0.2", "nan"), "\u00e4",
    ],
)  # fmt: skip
def test_damaged_gains_and_those_of_another_controller_are_not_used(tmp_path: Path, text: str) -> None:
    """As are those with another sign. The filters are."""
    (tmp_path / "filters.h").write_text(c_header([NOTCH]), encoding="ascii")
    (tmp_path / "gains.toml").write_text(text, encoding="utf-8")
    found = proposed_controller(tmp_path, CASCADE)
    assert found is not None
    assert found["gains"] is None
    assert found["notches"][0]["hz"] == pytest.approx(60.0)


@pytest.mark.parametrize(
    ("old", "new"), [("/* F", "f"), ("4000 Hz", "0 Hz"), ("    {", "    {1, "), ("FILTERS 1", "FILTERS 2")]
)
def test_without_its_filters_nothing_is_proposed(tmp_path: Path, old: str, new: str) -> None:
    (tmp_path / "gains.toml").write_text(gains_toml(CASCADE), encoding="ascii")
    (tmp_path / "filters.h").write_text(c_header([NOTCH]).replace(old, new), encoding="ascii")
    assert proposed_controller(tmp_path, CASCADE) is None
