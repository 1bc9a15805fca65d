"""The bounds of corrected responses hold what they promise, and windows that dry friction holds are not valid.

Statistical bounds: three seeds of two strokes at a speed are 200 … 800 windows that share no sample, of seven lines:
a coverage of 63 % to ± 1.3 … 0.7 % (one standard deviation) and one of 98 % to ± 0.4 … 0.2 %.
"""

from __future__ import annotations

import numpy as np
import pytest

from livebode import MotionCorrection, Responses, Tracker
from livebode.core import Block, Event
from livebode.simulation import BeltAxis, Friction, Sensor, SimulatedAxis, Standstill, Strokes
from tests.support.axes import MULTISINE
from tests.support.moving import SETTINGS, axis, corrected, truth_at


def hits(run: BeltAxis, found: Responses) -> np.ndarray:
    """Whether the truth lies within bound(1) and bound(2), shape (2, windows, lines)."""
    rows = np.flatnonzero(found.valid.all(axis=1) & np.isfinite(found.dof))
    error = np.abs(found.value[rows] - truth_at(run, found.schedule[rows]))
    return np.array([error <= found.bound(c)[rows] for c in (1, 2)])


@pytest.mark.parametrize("speed_m_per_s", [0.1, 0.2, 0.38])
def test_bounds_cover_the_truth_over_strokes_as_often_as_stated(speed_m_per_s: float) -> None:
    each = []
    for seed in range(3):
        run = axis(0.1, strokes=2, seed=seed, motion=Strokes(speed_m_per_s=speed_m_per_s))
        found = corrected(run, SimulatedAxis(run).run()[0])
        assert found.valid[found.sample >= 399].all()
        each.append(hits(run, found))
    within = np.concatenate(each, axis=1)
    one, two = within.mean(axis=(1, 2))
    print(f"{speed_m_per_s} m/s: within 1 sigma {one:.3f}, within 2 {two:.3f}; lines {within[0].mean(axis=0).round(3)}")
    assert one == pytest.approx(0.632, abs=0.03)
    assert two == pytest.approx(0.982, abs=0.01)


def test_the_tracker_alone_counts_the_motion_as_noise() -> None:
    run = axis(0.1, strokes=2)
    block = SimulatedAxis(run).run()[0]
    ours, plain = corrected(run, block), Tracker(SETTINGS).process(block)
    rows = np.flatnonzero(ours.valid.all(axis=1) & np.isfinite(ours.dof) & np.isfinite(plain.dof))
    assert np.median(plain.sigma[rows] / ours.sigma[rows]) > 2


def at_standstill(friction_n: float) -> tuple[BeltAxis, Block]:
    """Two strokes with dwells of 1 s."""
    motion, friction = Strokes(dwell_s=1.0), Friction(load_coulomb_n=friction_n)
    seconds = (motion.cycle(4000)[0].size + 400) / 4000
    sensor = Sensor(noise_rad_per_s=0.1)
    run = BeltAxis(motion=motion, friction=friction, sensor=sensor, excitation_n_m=MULTISINE, seconds=seconds, seed=5)
    return run, SimulatedAxis(run).run()[0]


@pytest.mark.parametrize("friction_n", [0.0, 5.0, 15.0])
def test_standstill_is_invalid_where_dry_friction_holds_and_only_there(friction_n: float) -> None:
    run, block = at_standstill(friction_n)
    correction = MotionCorrection(SETTINGS, radius_m=0.019, chunk_samples=run.motion.cycle(4000)[0].size // 2)
    events: list[Event] = []
    found = Responses.join([correction.process(block, events.append), correction.finish(events.append)])
    speed = np.abs(run.motion.cycle(4000)[1])[np.arange(len(block)) % run.motion.cycle(4000)[1].size]
    moved = np.concatenate([[0], np.cumsum(speed > 0.19)])
    share = (moved[found.sample + 1] - moved[np.maximum(found.first, 0)]) / 400  # of a window, spent in motion
    valid, whole = found.valid.all(axis=1), found.sample >= 399
    if friction_n == 0:
        assert valid[whole].all()
        assert not events
        return
    assert not valid[whole & (share < 0.5)].any()
    assert valid[whole & (share == 1)].mean() > 0.9
    assert [event.kind for event in events] == ["held"] * 3  # at the start, and at either end
    for event in events:
        assert event.details["unexplained"] > 0.03
        assert event.time_s == pytest.approx(event.sample / 4000, abs=1e-9)
        assert speed[event.sample] < 0.19
    error = 20 * np.log10(np.abs(found.value / truth_at(run, np.nan_to_num(found.schedule, nan=0.5))))
    raw = Tracker(SETTINGS).process(block)
    before = 20 * np.log10(np.abs(raw.value / truth_at(run, np.nan_to_num(found.schedule, nan=0.5))))
    held = whole & (share == 0)
    print(
        f"{friction_n} N: {np.abs(before[held]).max():.1f} dB wrong while held, {np.nanmax(np.abs(error)):.1f} dB left"
    )
    assert np.sqrt(np.nanmean(error**2)) < 0.25


def test_a_machine_that_never_moves_is_not_judged() -> None:
    run = BeltAxis(motion=Standstill(position_m=0.8), excitation_n_m=MULTISINE, seconds=1.5)
    block = SimulatedAxis(run).run()[0]
    correction = MotionCorrection(SETTINGS, radius_m=0.019, chunk_samples=4000)
    events: list[Event] = []
    found = Responses.join([correction.process(block, events.append), correction.finish(events.append)])
    assert found.valid[found.sample >= 399].all()
    assert events == []
