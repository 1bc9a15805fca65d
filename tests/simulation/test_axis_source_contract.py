"""The simulated axis is a source like any other: cutting, seeds, channels, pace; and physics keeps its sums."""

from __future__ import annotations

import itertools
from math import inf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.core import Block, SignalError, UsageError
from livebode.simulation import (
    BeltAxis,
    Drive,
    Friction,
    LoadChange,
    Mechanics,
    Sensor,
    SimulatedAxis,
    SoftSpot,
    Standstill,
    Strokes,
    StrokeSequence,
    TensionLoss,
)
from tests.support.axes import MULTISINE, RATE_HZ, fast_stroke
from tests.support.errors import refused


def busy(**options: object) -> SimulatedAxis:
    """A short run in which everything is at work."""
    axis = {
        "motion": fast_stroke(dwell_s=0.05), "excitation_n_m": MULTISINE, "friction": Friction(load_coulomb_n=15.0),
        "sensor": Sensor(noise_rad_per_s=0.1, encoder_counts_per_turn=1 << 20), "drive": Drive(delay_ticks=1),
        "faults": (TensionLoss(start_s=0.1, ramp_s=0.2, loss=0.2), SoftSpot(position_m=0.6, width_m=0.1, loss=0.1)),
        "seconds": 0.5, "seed": 7,
    }  # fmt: skip
    return SimulatedAxis(BeltAxis(**(axis | options)))


WHOLE, WHOLE_TRUTH = busy().run()


@settings(max_examples=20, deadline=None)
@given(block_samples=st.integers(1, 3000))
def test_cutting_changes_no_sample_and_no_truth(block_samples: int) -> None:
    pairs = list(busy().pairs(block_samples))
    assert [block.start for block, _ in pairs] == list(range(0, 2000, block_samples))
    assert np.array_equal(np.hstack([block.data for block, _ in pairs]), WHOLE.data)
    assert np.array_equal(np.hstack([truth.states for _, truth in pairs]), WHOLE_TRUTH.states)
    stiffness = np.concatenate([truth.stiffness_n_per_m for _, truth in pairs])
    assert np.array_equal(stiffness, WHOLE_TRUTH.stiffness_n_per_m)


def test_blocks_have_the_channels_asked_for_and_their_units() -> None:
    blocks = list(busy().blocks(["x", "u"], 300))
    assert [(c.name, c.unit) for c in blocks[0].channels] == [("x", "m"), ("u", "N m")]
    assert np.array_equal(np.hstack([block.data for block in blocks])[1], WHOLE["u"])
    assert WHOLE.names == tuple(c.name for c in busy().channels)
    with refused(SignalError, "channel-unknown", channel="velocitty"):
        busy().blocks(["velocitty"])
    for wrong in (0, -1, 1.5, True):
        with refused(UsageError, "out-of-range", argument="block_samples"):
            busy().pairs(wrong)


def test_a_run_in_equals_a_longer_standstill_before_the_first_sample() -> None:
    options = {"excitation_n_m": MULTISINE, "friction": Friction(load_coulomb_n=15.0)}
    longer, _ = SimulatedAxis(BeltAxis(seconds=0.5, **options)).run()
    # 0.3999 s are made whole repetitions of the position loop: 1600 ticks, four periods of the excitation.
    block, truth = SimulatedAxis(BeltAxis(seconds=0.1, run_in_s=0.3999, **options)).run()
    assert np.array_equal(block.data, longer.data[:, 1600:])
    assert (block.start, truth.start) == (0, 0)


def test_a_run_in_has_noise_of_its_own() -> None:
    noise = []
    for run_in_s in (0.0, 0.1):
        axis = BeltAxis(run_in_s=run_in_s, seconds=0.1, seed=3, sensor=Sensor(noise_rad_per_s=0.1))
        block, truth = SimulatedAxis(axis).run()
        noise.append(block["velocity"] - truth.states[1])
        assert (abs(truth.states[1, 0]) > 0) == (run_in_s > 0)
    assert np.allclose(noise[0], noise[1], atol=1e-14)


@pytest.mark.parametrize("value", [-1.0, inf, 1e4])
def test_a_run_in_has_a_limit(value: float) -> None:
    with refused(UsageError, "out-of-range", argument="run_in_s"):
        BeltAxis(run_in_s=value)


def test_every_iteration_of_a_seed_gives_the_same_noise() -> None:
    source = busy()
    assert np.array_equal(source.run()[0].data, source.run()[0].data)
    assert not np.array_equal(busy(seed=8).run()[0]["velocity"], WHOLE["velocity"])
    assert np.array_equal(busy(seed=8).run()[0]["w"], WHOLE["w"])


def test_an_endless_run_continues_and_is_refused_as_one_block() -> None:
    endless = busy(seconds=inf)
    assert endless.samples is None
    first = list(itertools.islice(endless.blocks(block_samples=1000), 3))
    assert np.array_equal(np.hstack([b.data for b in first])[:, :2000], WHOLE.data)
    with refused(UsageError, "out-of-range", argument="seconds"):
        endless.run()


def test_real_time_waits_for_the_last_sample_of_each_block_and_not_for_late_ones() -> None:
    now, slept = [100.0], []

    def sleep(seconds: float) -> None:
        slept.append(seconds)
        now[0] += seconds

    arrived = []
    for block in busy().blocks(["u"], 800, real_time=True, clock=lambda: now[0], sleep=sleep):
        arrived.append(now[0] - 100.0)
        now[0] += 0.25 if block.start == 0 else 0.0  # the first is dealt with slowly
    assert arrived == pytest.approx([0.2, 0.45, 0.5])
    assert slept == pytest.approx([0.2, 0.05])


def test_w_is_the_excitation_repeated_from_the_first_tick_on() -> None:
    assert np.array_equal(WHOLE["w"], np.tile(MULTISINE, 5))


def test_u_and_velocity_stand_as_a_loop_records_them() -> None:
    # u of a tick comes from the velocity of that tick: undo the controller by hand.
    block, _ = SimulatedAxis(BeltAxis(motion=fast_stroke(), excitation_n_m=MULTISINE, seconds=0.2)).run()
    held = np.repeat((block["position_reference"] - block["position"] + block["velocity_reference"])[::2], 2)
    error = held - block["velocity"]
    u = 0.2308 * (error + np.cumsum(error) / (RATE_HZ * 0.2)) + block["w"]
    assert np.allclose(u, block["u"], rtol=0, atol=1e-9)


def free_run(masses: int, **options: object) -> tuple[Block, np.ndarray, Mechanics]:
    mechanics = Mechanics(masses=masses, damping_n_s_per_m=0.0, **options)
    axis = BeltAxis(mechanics=mechanics, motion=fast_stroke(dwell_s=0.05), excitation_n_m=MULTISINE, seconds=0.6)
    block, truth = SimulatedAxis(axis).run()
    return block, truth.states, mechanics


@pytest.mark.parametrize("masses", [2, 3])
def test_momentum_is_what_the_torque_gave(masses: int) -> None:
    block, states, m = free_run(masses)
    momentum = m.motor_inertia_kg_m2 * states[1] + m.radius_m * m.load_kg * states[-1]
    if masses == 3:
        momentum = momentum + m.pulley_inertia_kg_m2 * states[3]
    given_n_m_s = np.concatenate([[0.0], np.cumsum(block["u"][:-1])]) / RATE_HZ
    assert np.max(np.abs(momentum - given_n_m_s)) < 1e-11 * np.max(np.abs(momentum))


@pytest.mark.parametrize("masses", [2, 3])
def test_energy_is_conserved_at_constant_stiffness(masses: int) -> None:
    block, s, m = free_run(masses, frozen_position_m=0.8)
    c, r = m.specific_stiffness_n, m.radius_m
    energy = (m.motor_inertia_kg_m2 * s[1] ** 2 + m.load_kg * s[-1] ** 2) / 2
    if masses == 2:
        energy += m.stiffness_n_per_m * (r * s[0] - s[2]) ** 2 / 2
    else:
        pulls = [(r * s[0] - s[4], 0.8), (s[4] - r * s[2], 2.14 - 0.8), (r * (s[2] - s[0]), 2.14)]
        energy += m.pulley_inertia_kg_m2 * s[3] ** 2 / 2 + sum(c / length * e**2 / 2 for e, length in pulls)
    work = np.concatenate([[0.0], np.cumsum(block["u"][:-1] * np.diff(s[0]))])
    assert np.max(np.abs(energy - work)) < 1e-9 * np.max(energy)


strokes = st.builds(
    Strokes,
    start_m=st.floats(0.25, 0.9),
    end_m=st.floats(1.0, 1.7),
    speed_m_per_s=st.floats(0.05, 5.0),
    acceleration_m_per_s2=st.floats(0.5, 40.0),
    jerk_m_per_s3=st.one_of(st.just(inf), st.floats(5.0, 5000.0)),
    dwell_s=st.floats(0.0, 0.3),
)


@settings(max_examples=60, deadline=None)
@given(motion=strokes, backwards=st.booleans())
def test_strokes_keep_to_their_limits_and_come_back(motion: Strokes, backwards: bool) -> None:
    if backwards:
        motion = Strokes(**{**vars_of(motion), "start_m": motion.end_m, "end_m": motion.start_m})
    position, speed = motion.cycle(RATE_HZ)
    low, high = sorted((motion.start_m, motion.end_m))
    assert position.min() >= low - 1e-9
    assert position.max() <= high + 1e-9
    assert position[0] == motion.start_m
    assert np.abs(speed).max() <= motion.speed_m_per_s * (1 + 1e-9)
    around = np.append(speed, speed[0])
    slope = np.diff(around) * RATE_HZ
    assert np.abs(slope).max() <= motion.acceleration_m_per_s2 * (1 + 1e-6)
    assert np.abs(np.diff(slope)).max() * RATE_HZ <= motion.jerk_m_per_s3 * (1 + 1e-6) + 1e-4
    # The way is the integral of the speed: exact to the trapezoidal rule's error at corners.
    way = np.cumsum((around[1:] + around[:-1]) / 2) / RATE_HZ + motion.start_m
    assert np.abs(way - np.append(position[1:], position[0])).max() < motion.acceleration_m_per_s2 / RATE_HZ**2


def test_a_sequence_of_strokes_continues_each_stroke_where_the_one_before_it_ended() -> None:
    points, speeds = (0.7, 1.6, 0.25, 0.9), (0.38, 0.1, 1.2)
    motion = StrokeSequence(turning_points_m=points, speeds_m_per_s=speeds)
    position, speed = motion.cycle(RATE_HZ)
    edges = np.rint(motion.edges_s(RATE_HZ) * RATE_HZ).astype(int)
    assert position[edges[:-1]].tolist() == list(points[:-1])
    assert position[-1] == pytest.approx(points[-1], abs=1e-4)
    fastest = [np.abs(speed[a:b]).max() for a, b in itertools.pairwise(edges)]
    assert fastest == pytest.approx(list(speeds))
    assert np.abs(np.diff(position) * RATE_HZ - (speed[1:] + speed[:-1]) / 2).max() < 4.0 / RATE_HZ


def vars_of(motion: Strokes) -> dict[str, float]:
    return {name: getattr(motion, name) for name in Strokes.__dataclass_fields__}


def test_a_stroke_reaches_speed_and_acceleration_where_there_is_room() -> None:
    position, speed = Strokes(speed_m_per_s=1.0, acceleration_m_per_s2=5.0, jerk_m_per_s3=100.0).cycle(RATE_HZ)
    assert speed.max() == pytest.approx(1.0)
    assert np.abs(np.diff(speed)).max() * RATE_HZ == pytest.approx(5.0, rel=1e-6)
    assert position.max() == pytest.approx(1.6, abs=1e-12)


@pytest.mark.parametrize(("masses", "x"), [(2, 0.25), (3, 1.6)])
def test_at_rest_without_excitation_nothing_moves(masses: int, x: float) -> None:
    axis = BeltAxis(mechanics=Mechanics(masses=masses), motion=Standstill(position_m=x), seconds=1.0)
    block, truth = SimulatedAxis(axis).run()
    assert np.max(np.abs(block["u"])) < 1e-9
    assert np.allclose(truth.position_m, x, rtol=0, atol=1e-12)


def test_the_truth_of_a_sample_is_that_of_its_place_and_time() -> None:
    truth = busy(faults=(LoadChange(start_s=0.25, load_kg=2.0),)).run()[1]
    assert truth.load_kg[[999, 1000]].tolist() == [6.7, 8.7]
    f = np.array([40.0])
    for sample in (0, 1500):
        axis = BeltAxis(mechanics=Mechanics(load_kg=float(truth.load_kg[sample])))
        expected = axis.linear(float(truth.position_m[sample])).response(f)
        assert truth.linear(sample).response(f) == pytest.approx(expected, rel=1e-12)
    with pytest.raises(IndexError, match="2000"):
        truth.sampled(2000)
