"""What the motion alone does is not taken for nothing where nobody says it."""

import json

import numpy as np
import pytest

from livebode.core import DesignError, UsageError
from livebode.simulation import BeltAxis
from livebode_design import MOTION_KEYS, QUANTITIES, ExperimentSpec, MachineLimits, choose, measured_machine
from tests.support.errors import refused

AXIS = BeltAxis()
PLANT, LOOP = AXIS.linear(0.8).sampled(4000), AXIS.drive.loop()
SPEC = ExperimentSpec(lines="20:140:20", window=400, phases="schroeder", amplitude_n_m=1.0)
MOTION = {
    "torque": (-2.0, 1.5),
    "speed": (-0.4, 0.4),
    "travel": (0.25, 1.6),
    "following error": (-0.01, 0.01),
}
LIMIT = {
    "torque": {"torque_n_m_max": 14.5},
    "speed": {"speed_m_per_s_max": 5.9},
    "travel": {"position_m_max": 1.8},
    "following error": {"following_error_m_max": 0.05},
}


def machine(motion, stroke_s=4.0):
    return measured_machine(PLANT, LOOP, 4000.0, radius_m=0.019, motion=motion, stroke_s=stroke_s)


@pytest.mark.parametrize("name", QUANTITIES)
def test_a_limit_on_an_unknown_part_of_the_motion_is_refused_and_without_it_the_table_notes_it(name):
    known = {key: value for key, value in MOTION.items() if key != name}
    with refused(DesignError, "motion-unknown", quantity=name, key=f"measured.{MOTION_KEYS[name]}"):
        choose(SPEC, machine(known), MachineLimits(**LIMIT[name]))
    others = {key: value for other in known for key, value in LIMIT[other].items()}
    design = choose(SPEC, machine(known), MachineLimits(**others))
    (row,) = [choice for choice in design.choices if choice.what == f"peak {name}"]
    assert "the peak of the motion alone is not specified" in row.why
    assert design.plain()["predicted"][name]["motion_alone"] is None
    whole = choose(SPEC, machine(MOTION), MachineLimits(**LIMIT[name]))
    excited = design.plain()["predicted"][name]
    predicted = whole.plain()["predicted"][name]
    assert predicted["low"] == pytest.approx(excited["low"] + MOTION[name][0])
    assert predicted["high"] == pytest.approx(excited["high"] + MOTION[name][1])


def test_an_axis_at_standstill_has_no_motion_but_an_unknown_position():
    at_standstill = machine({}, stroke_s=None)
    limits = {key: value for name in ("torque", "speed", "following error") for key, value in LIMIT[name].items()}
    predicted = choose(SPEC, at_standstill, MachineLimits(**limits)).plain()["predicted"]
    assert [predicted[name]["motion_alone"] for name in ("torque", "speed", "following error")] == [(0.0, 0.0)] * 3
    with refused(DesignError, "motion-unknown", quantity="travel"):
        choose(SPEC, at_standstill, MachineLimits(position_m_max=1.8))
    choose(SPEC, machine({"travel": (0.8, 0.8)}, stroke_s=None), MachineLimits(position_m_max=1.8))


@pytest.mark.parametrize(
    ("motion", "stroke_s", "code", "argument"),
    [
        ({"speed": (-0.4, 0.4)}, None, "missing", "stroke_s"),
        ({"torque": (2.0, -2.0)}, 4.0, "out-of-range", "motion"),
        ({"torque": (np.nan, 2.0)}, 4.0, "out-of-range", "motion"),
        ({}, 0.0, "out-of-range", "stroke_s"),
    ],
)
def test_a_motion_that_makes_no_sense_is_refused(motion, stroke_s, code, argument):
    with refused(UsageError, code, argument=argument):
        machine(motion, stroke_s)


def test_the_file_contains_null_where_nothing_is_specified():
    design = choose(SPEC, machine({}))
    assert json.loads(json.dumps(design.plain()))["predicted"]["torque"]["motion_alone"] is None
