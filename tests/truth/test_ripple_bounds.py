"""Torque ripple that meets a line: the bounds of a tracked and of a corrected response contain it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from livebode.estimation import RippleOrder, Settings, Tracker, ripple_power
from livebode.excitation import multisine
from livebode.motion import MotionCorrection
from livebode.nouns import Block, InputError, Lines, Responses
from livebode.simulation import BeltAxis, Drive, Sensor, SimulatedAxis, Strokes
from studies.monitoring_axis import LINES, RADIUS_M, RandomStrokes
from studies.motion import SETTINGS, cruising, truth_at

COGGING_PER_M = 24 / (2 * np.pi * RADIUS_M)
MEETING_M_PER_S = 0.2985  # 24 a turn are 60.01 Hz there
AT = LINES.frequency_hz.tolist().index(60.0)
TOLD = replace(SETTINGS, ripple=(RippleOrder(COGGING_PER_M, 0.05),))


def recorded(motion: Strokes | RandomStrokes, seconds: float) -> tuple[BeltAxis, Block]:
    axis = BeltAxis(
        motion=motion, excitation_n_m=multisine(LINES), sensor=Sensor(noise_rad_per_s=0.1), seconds=seconds,
        drive=Drive(torque_ripple_n_m=0.05), seed=1,
    )  # fmt: skip
    block, _ = SimulatedAxis(axis).run()
    names = ("w", "u", "velocity", "x")
    return axis, Block(block.data[[block.index(name) for name in names]], names, block.rate_hz)


@cache
def meeting() -> tuple[BeltAxis, Block]:
    """A stroke at the speed at which the ripple meets the line at 60 Hz."""
    return recorded(Strokes(speed_m_per_s=MEETING_M_PER_S), 5.0)


def corrected(block: Block, settings: Settings) -> tuple[Responses, MotionCorrection]:
    correction = MotionCorrection(settings, radius_m=RADIUS_M, chunk_samples=16000)
    return Responses.join([correction.process(block), correction.finish()]), correction


def covered(axis: BeltAxis, responses: Responses, after_s: float = 0.0) -> float:
    """Share of the errors at 60 Hz within bound(2)."""
    rows = np.flatnonzero(cruising(axis, responses.sample) & (responses.time_s > after_s))[::10]
    some = responses[rows]
    error = np.abs(some.value - truth_at(axis, some.schedule))[:, AT]
    return float(np.mean(error <= some.bound(2)[:, AT]))


def test_a_tracked_line_that_a_known_ripple_meets_has_a_bound_that_holds() -> None:
    axis, block = meeting()
    assert covered(axis, Tracker(SETTINGS).process(block)) < 0.6, "a tone on a line is invisible beside it"
    assert covered(axis, Tracker(TOLD).process(block)) > 0.98


def test_a_corrected_line_that_a_known_ripple_meets_has_a_bound_that_holds() -> None:
    axis, block = meeting()
    assert covered(axis, corrected(block, SETTINGS)[0]) < 0.4
    assert covered(axis, corrected(block, TOLD)[0]) > 0.95


def test_a_correction_finds_the_ripple_in_strokes_that_differ() -> None:
    motion = RandomStrokes((0.38, 0.36, 0.34, 0.32, 0.37, MEETING_M_PER_S))
    axis, block = recorded(motion, float(motion.edges_s[-1]))
    responses, correction = corrected(block, SETTINGS)
    strongest, *others = correction.found()["motion"]["ripple"]
    assert strongest == {"cycles": pytest.approx(COGGING_PER_M, abs=0.4), "amplitude": pytest.approx(0.05, rel=0.25)}
    assert all(order["amplitude"] < 0.01 for order in others)
    assert covered(axis, responses, after_s=float(motion.edges_s[-2])) > 0.95


def test_speed_that_changes_within_a_window_counts_where_it_is_nearest() -> None:
    lines = Lines.parse("20:60:20", rate_hz=4000, window=400)
    order = (RippleOrder(200.0, 0.1),)
    steady = ripple_power(order, lines, np.array([[0.2], [0.2]]))
    faster = ripple_power(order, lines, np.array([[0.15, 0.2], [0.25, 0.2]]))
    assert np.all(faster[0] >= steady[0])
    assert faster[1] == pytest.approx(steady[0])
    assert ripple_power(order, lines, np.full((2, 1), np.nan)).max() == 0.0


def test_what_a_ripple_needs_is_reported() -> None:
    with pytest.raises(InputError, match="name the channel of the position"):
        replace(TOLD, schedule=None)
    with pytest.raises(InputError, match="amplitude = 0 is not a positive number"):
        RippleOrder(COGGING_PER_M, 0)
