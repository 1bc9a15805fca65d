"""What goes wrong with the simulated machine shows in its truth and in what an estimator sees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from livebode.core import Block, LivebodeError, SimulationError
from livebode.estimation import Settings, Tracker
from livebode.simulation import (
    Backlash,
    BeltAxis,
    DampingGrowth,
    Drive,
    Fault,
    Friction,
    FrictionChange,
    Limits,
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
from livebode.simulation.faults import Condition, OverTime
from tests.support.axes import LINES, MULTISINE, RATE_HZ, fast_stroke
from tests.support.errors import refused

F_HZ = LINES.frequency_hz


def seen(block: Block) -> np.ndarray:
    settings = Settings(lines=LINES, output="velocity", input="u", excitation="w")
    return Tracker(settings).process(block)[-1].value


@pytest.mark.parametrize("masses", [2, 3])
@pytest.mark.parametrize(
    "fault",
    [
        TensionLoss(start_s=1.0, loss=0.1), TensionLoss(start_s=1.0, ramp_s=2.0, loss=0.3),
        LoadChange(start_s=1.0, load_kg=2.0), DampingGrowth(start_s=1.0, ramp_s=1.0, factor=2.0),
        SoftSpot(position_m=0.82, width_m=0.05, loss=0.2),
    ],
    ids=lambda fault: type(fault).__name__,
)  # fmt: skip
def test_a_fault_moves_the_response_to_its_truth(fault: Fault, masses: int) -> None:
    machine = Mechanics(masses=masses, frozen_position_m=0.8)
    axis = BeltAxis(mechanics=machine, excitation_n_m=MULTISINE, faults=(fault,), seconds=40)
    *_, (block, truth) = SimulatedAxis(axis).pairs(1600)
    after = truth.sampled(truth.start).response(F_HZ)
    assert np.max(np.abs(seen(block) / after - 1)) < 1e-9
    healthy = BeltAxis(mechanics=machine).linear(0.8).sampled(RATE_HZ).response(F_HZ)
    assert np.max(np.abs(after / healthy - 1)) > 0.02


def test_faults_work_together_and_their_truth_is_beside() -> None:
    faults = (TensionLoss(start_s=0.2, ramp_s=0.2, loss=0.1), TensionLoss(start_s=0.3, loss=0.2),
              DampingGrowth(start_s=0.1, factor=3.0), LoadChange(start_s=0.4, load_kg=-1.0))  # fmt: skip
    truth = SimulatedAxis(BeltAxis(faults=faults, seconds=0.5)).run()[1]
    ends = [0, 1200, 1999]
    assert truth.stiffness_n_per_m[ends] == pytest.approx([5e5, 5e5 * 0.95 * 0.8, 5e5 * 0.9 * 0.8])
    assert truth.damping_n_s_per_m[ends] == pytest.approx([130, 390, 390])
    assert truth.load_kg[ends] == pytest.approx([6.7, 6.7, 5.7])
    assert truth.inertia_kg_m2[ends] == pytest.approx([0.0028] * 3)


def test_a_soft_spot_is_soft_where_it_is() -> None:
    axis = BeltAxis(
        motion=fast_stroke(dwell_s=0.0), faults=(SoftSpot(position_m=1.0, width_m=0.05, loss=0.3),), seconds=0.7
    )
    truth = SimulatedAxis(axis).run()[1]
    left = truth.stiffness_n_per_m / Mechanics().stiffness_at(truth.position_m)
    assert left.min() == pytest.approx(0.7, abs=1e-3)
    assert truth.position_m[np.argmin(left)] == pytest.approx(1.0, abs=2e-3)
    assert left[0] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("masses", [2, 3])
def test_within_the_play_the_cart_hangs_loose(masses: int) -> None:
    # 20 Hz at 0.5 N m move the free motor by some 0.4 mm: a play of 2 mm leaves the cart behind.
    w = 0.5 * np.cos(2 * np.pi * np.arange(200) / 200)
    axis = BeltAxis(
        mechanics=Mechanics(masses=masses), excitation_n_m=w, seconds=1.0, faults=(Backlash(gap_m=2e-3),),
    )  # fmt: skip
    tight = BeltAxis(mechanics=axis.mechanics, excitation_n_m=w, seconds=1.0)
    loose, held = (SimulatedAxis(a).run()[1] for a in (axis, tight))
    assert np.ptp(loose.position_m) == 0
    assert np.ptp(loose.states[0]) > np.ptp(held.states[0])


def test_growing_play_disturbs_the_response_more_and_more() -> None:
    errors = []
    for gap_m in (1e-6, 1e-5, 1e-4):
        axis = BeltAxis(
            mechanics=Mechanics(frozen_position_m=0.8), excitation_n_m=MULTISINE, seconds=20,
            faults=(Backlash(start_s=1.0, ramp_s=3.0, gap_m=gap_m),),
        )  # fmt: skip
        *_, (block, truth) = SimulatedAxis(axis).pairs(1600)
        errors.append(np.max(np.abs(seen(block) / truth.sampled(truth.start).response(F_HZ) - 1)))
    assert errors[0] < errors[1] < errors[2]
    assert errors[2] > 0.05


@dataclass(frozen=True, kw_only=True)
class Wobble(OverTime):
    """A fault of a user's own, as in docs/reference/axis.md."""

    depth: float

    def act(self, time_s: np.ndarray, condition: Condition) -> None:
        condition.stiffness *= 1 - self.depth * self.share(time_s) * np.sin(2 * np.pi * time_s) ** 2


def test_a_fault_defined_by_a_user_acts_on_the_machine() -> None:
    truth = SimulatedAxis(BeltAxis(faults=(Wobble(start_s=0.1, depth=0.2),), seconds=0.5)).run()[1]
    assert truth.stiffness_n_per_m[[0, 1000]] == pytest.approx([5e5, 4e5])


def cruise(**options: object) -> Block:
    """The middle of a long stroke at a constant 0.38 m/s without excitation."""
    block, _ = SimulatedAxis(BeltAxis(motion=Strokes(dwell_s=0.0), seconds=2.6, **options)).run()
    return block.cut(5200, 10400)


def test_friction_costs_the_torque_that_it_should() -> None:
    # At a constant speed u is r·F(v) + τ(ω); the slow integrator leaves the loop within a fraction of it.
    friction = Friction(load_coulomb_n=15, load_viscous_n_s_per_m=20, load_stribeck_n=30, motor_coulomb_n_m=0.1)
    v = 0.38
    smooth = v / np.hypot(v, 0.01)
    expected = 0.019 * (20 * v + (15 + 30 / (1 + (v / 0.05) ** 2)) * smooth) + 0.1 * smooth
    assert np.mean(cruise(friction=friction)["u"]) == pytest.approx(expected, rel=0.05)
    assert abs(np.mean(cruise()["u"])) < 0.05 * expected


def test_the_torque_limit_holds_and_the_integrator_waits() -> None:
    axis = BeltAxis(motion=fast_stroke(), drive=Drive(torque_n_m_max=1.5), seconds=3.0)
    block, _ = SimulatedAxis(axis).run()
    assert np.abs(block["u"]).max() == 1.5
    assert np.count_nonzero(np.abs(block["u"]) == 1.5) > 100


def test_torque_ripple_turns_with_the_motor() -> None:
    smooth, rippled = (
        cruise(drive=Drive(torque_ripple_n_m=a, torque_ripple_per_turn=24))["velocity"] for a in (0, 0.5)
    )
    difference = np.abs(np.fft.rfft((rippled - smooth) * np.hanning(rippled.size)))
    strongest_hz = np.argmax(difference) * RATE_HZ / rippled.size
    assert strongest_hz == pytest.approx(24 * 0.38 / 0.019 / (2 * np.pi), abs=2 * RATE_HZ / rippled.size)


def test_an_eccentric_pulley_moves_the_cart_off_by_its_share_of_the_radius() -> None:
    """x − r·φ goes through one turn of ±1 % of the radius; the belt gives by less than a tenth of that."""
    block = cruise(mechanics=Mechanics(eccentricity=0.01))
    off = block["x"] - 0.019 * block["position"]
    assert np.ptp(off) == pytest.approx(2 * 0.01 * 0.019, rel=0.1)
    assert off == pytest.approx(0.01 * 0.019 * (1 - np.cos(block["position"])), abs=4e-5)


@pytest.mark.parametrize("masses", [2, 3])
@pytest.mark.parametrize("start_m", [0.35, 0.8, 1.217])
def test_an_axis_with_an_eccentric_pulley_starts_at_rest(masses: int, start_m: float) -> None:
    """Without torque and friction nothing moves: every pulley is where the belt without elongation puts it."""
    free = Drive(velocity_gain_n_m_s=0.0, position_gain_per_s=0.0)
    still = Standstill(position_m=start_m)
    axis = BeltAxis(mechanics=Mechanics(masses=masses, eccentricity=0.01), drive=free, motion=still, seconds=0.1)
    _, truth = SimulatedAxis(axis).run()
    assert np.array_equal(truth.states, np.repeat(truth.states[:, :1], len(truth), axis=1))


def test_friction_and_torque_noise_act_behind_the_logged_torque() -> None:
    """Viscous friction that falls to half takes half of the torque; noise of 0.1 N m moves a free motor."""
    drag, half = (
        np.mean(cruise(friction=Friction(motor_viscous_n_m_s=0.05), faults=faults)["u"][-2000:])
        for faults in ((), (FrictionChange(factor=0.5),))
    )
    assert half / drag == pytest.approx(0.5, rel=0.02)
    open_loop = Drive(velocity_gain_n_m_s=0.0, position_gain_per_s=0.0, torque_noise_n_m=0.1)
    block, _ = SimulatedAxis(BeltAxis(drive=open_loop, seconds=1.0)).run()
    assert not np.any(block["u"])
    steps = np.diff(block["velocity"]) * 4000 * 0.0028
    assert np.std(steps) == pytest.approx(0.1, rel=0.1)


def test_the_encoder_counts_and_its_velocity_carries_the_steps() -> None:
    step = 2 * np.pi / (1 << 14)
    sensor = Sensor(encoder_counts_per_turn=1 << 14)
    block, truth = SimulatedAxis(BeltAxis(motion=fast_stroke(), sensor=sensor, seconds=0.5)).run()
    assert np.allclose(block["position"] / step, np.round(block["position"] / step), atol=1e-6)
    assert np.max(np.abs(block["position"] - truth.states[0])) <= step / 2 * (1 + 1e-9)
    assert np.max(np.abs(block["velocity"] - truth.states[1])) <= step * RATE_HZ * (1 + 1e-9)
    differenced = Sensor(encoder_counts_per_turn=1 << 14, velocity_differenced=True)
    block, _ = SimulatedAxis(BeltAxis(motion=fast_stroke(), sensor=differenced, seconds=0.5)).run()
    assert np.allclose(block["velocity"][1:], np.diff(block["position"]) * RATE_HZ, atol=1e-9)


def test_noise_is_white_and_has_the_specified_sigma() -> None:
    axis = BeltAxis(sensor=Sensor(noise_rad_per_s=0.1), seconds=10.0, seed=5)
    block, truth = SimulatedAxis(axis).run()
    noise = block["velocity"] - truth.states[1]
    # 40,000 samples: 4 standard deviations of the estimates are 1.4 % of sigma and 0.02 of the correlation.
    assert np.std(noise) == pytest.approx(0.1, rel=0.014)
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.02


@dataclass(frozen=True, kw_only=True)
class Secret(OverTime):
    """Makes the belt push where it should pull, at a time that the check before the start does not look at."""

    @property
    def moments_s(self) -> tuple[float, ...]:
        return ()

    def act(self, time_s: np.ndarray, condition: Condition) -> None:
        condition.stiffness[:] = np.where(time_s >= 0.1, -condition.stiffness, condition.stiffness)


@pytest.mark.parametrize("masses", [2, 3])
def test_a_diverging_simulation_stops_with_time_and_state(masses: int) -> None:
    axis = BeltAxis(
        mechanics=Mechanics(masses=masses, frozen_position_m=0.8),
        excitation_n_m=MULTISINE,
        faults=(Secret(),),
        seconds=9,
    )
    blocks = SimulatedAxis(axis).blocks(block_samples=100)
    arrived = []
    with pytest.raises(SimulationError) as stopped:
        arrived.extend(blocks)
    assert stopped.value.code == "simulation.diverged"
    assert stopped.value.time_s > 0.1
    assert len(stopped.value.state) == 2 * masses
    assert all(np.all(np.isfinite(block.data)) for block in arrived)
    assert arrived[-1].stop <= round(stopped.value.time_s * RATE_HZ)


def test_a_cart_that_runs_away_is_stopped() -> None:
    with pytest.raises(SimulationError, match=r"outside 0\.15 … 1\.85 m") as stopped:
        SimulatedAxis(BeltAxis(excitation_n_m=np.full(1, 14.0), drive=Drive(integral_time_s=1e6), seconds=100)).run()
    assert stopped.value.state[-2] == pytest.approx(1.85, abs=0.01)


class Nan(Secret):
    def act(self, time_s: np.ndarray, condition: Condition) -> None:
        condition.load_kg[time_s >= 0.1] = np.nan


def test_a_nan_is_never_silent() -> None:
    with pytest.raises(SimulationError) as stopped:
        SimulatedAxis(BeltAxis(faults=(Nan(),), seconds=1)).run()
    assert stopped.value.time_s == pytest.approx(0.1 + 1 / RATE_HZ)


BAD = [
    (lambda: BeltAxis(motion=Strokes(start_m=0.1)), "usage.out-of-range", "start_m"),
    (lambda: BeltAxis(motion=Standstill(position_m=1.9)), "usage.out-of-range", "position_m"),
    (lambda: BeltAxis(motion=Strokes(speed_m_per_s=6.0)), "usage.out-of-range", "speed_m_per_s"),
    (lambda: BeltAxis(motion=Strokes(acceleration_m_per_s2=60.0)), "usage.out-of-range", "acceleration_m_per_s2"),
    (lambda: BeltAxis(motion=Strokes(acceleration_m_per_s2=2.0), limits=Limits(acceleration_m_per_s2_max=1.9)),
     "usage.out-of-range", "acceleration_m_per_s2"),
    (lambda: BeltAxis(limits=Limits(overrun_m=0.5)), "simulation.stroke-beyond-machine", None),
    (lambda: BeltAxis(drive=Drive(velocity_gain_n_m_s=50.0)), "simulation.unstable", None),
    (lambda: BeltAxis(drive=Drive(delay_ticks=64, velocity_gain_n_m_s=2.0)), "simulation.unstable", None),
    (lambda: BeltAxis(faults=(LoadChange(start_s=5.0, load_kg=-6.7),)), "simulation.parameters-impossible", None),
    (lambda: BeltAxis(limits=Limits(position_m_max=2.2)), "simulation.stroke-beyond-machine", None),
    (lambda: Limits(position_m_min=1.0, position_m_max=0.5), "usage.out-of-range", "position_m_min"),
    (lambda: Drive(position_rate_hz=1500), "usage.conflict", "position_rate_hz"),
    (lambda: Drive(velocity_rate_hz=8000), "usage.conflict", "velocity_rate_hz"),
    (lambda: Drive(delay_ticks=65), "usage.out-of-range", "delay_ticks"),
    (lambda: Drive(torque_n_m_max=0.0), "usage.out-of-range", "torque_n_m_max"),
    (lambda: Drive(integral_time_s=0.0), "usage.out-of-range", "integral_time_s"),
    (lambda: Mechanics(masses=4), "usage.not-one-of", "masses"),
    (lambda: Mechanics(load_kg=-1.0), "usage.out-of-range", "load_kg"),
    (lambda: Mechanics(frozen_position_m=3.0), "usage.out-of-range", "frozen_position_m"),
    (lambda: Mechanics(pulley_inertia_kg_m2=0.002), "simulation.parameters-impossible", None),
    (lambda: Friction(load_coulomb_n=float("nan")), "usage.out-of-range", "load_coulomb_n"),
    (lambda: Sensor(noise_rad_per_s=-0.1), "usage.out-of-range", "noise_rad_per_s"),
    (lambda: Strokes(start_m=1.0, end_m=1.0), "usage.conflict", "end_m"),
    (lambda: Strokes(jerk_m_per_s3=0.0), "usage.out-of-range", "jerk_m_per_s3"),
    (lambda: StrokeSequence(turning_points_m=(0.4, 1.0), speeds_m_per_s=()), "usage.wrong-shape", "turning_points_m"),
    (lambda: StrokeSequence(turning_points_m=(1.0, 1.0), speeds_m_per_s=(0.1,)), "usage.conflict", "end_m"),
    (lambda: BeltAxis(motion=StrokeSequence(turning_points_m=(0.4, 1.9), speeds_m_per_s=(0.1,))),
     "usage.out-of-range", "end_m"),
    (lambda: TensionLoss(loss=1.0), "usage.out-of-range", "loss"),
    (lambda: TensionLoss(loss=0.1, start_s=-1.0), "usage.out-of-range", "start_s"),
    (lambda: Backlash(gap_m=0.0), "usage.out-of-range", "gap_m"),
    (lambda: BeltAxis(excitation_n_m=np.ones((2, 2))), "usage.wrong-shape", "excitation_n_m"),
    (lambda: BeltAxis(excitation_n_m=[1.0, float("nan")]), "usage.wrong-shape", "excitation_n_m"),
    (lambda: BeltAxis(seconds=0.0), "usage.out-of-range", "seconds"),
    (lambda: BeltAxis(substeps=0), "usage.out-of-range", "substeps"),
    (lambda: BeltAxis(faults=(SoftSpot(position_m=1.0, width_m=0.1, loss=0.1),) * 17), "usage.out-of-range", "faults"),
]  # fmt: skip


@pytest.mark.parametrize(("make", "code", "argument"), BAD)
def test_impossible_machines_are_refused_before_the_start(make: object, code: str, argument: str | None) -> None:
    with pytest.raises(LivebodeError) as caught:
        make()
    assert (caught.value.code, caught.value.facts.get("argument")) == (code, argument)
    assert "\n" not in str(caught.value)


def test_every_misspelt_setting_raises() -> None:
    for kind in (BeltAxis, Mechanics, Friction, Drive, Sensor, Limits, Strokes, Standstill, TensionLoss, SoftSpot):
        with pytest.raises(TypeError, match="spelt_wrong"):
            kind(spelt_wrong=1)


def test_a_stable_judgement_is_a_stable_run_and_an_unstable_one_is_not() -> None:
    # The edge by eigenvalues is the edge of the simulated loop: 3 % below it dies out, 3 % above it grows.
    def radius(gain: float) -> float:
        return BeltAxis().closed_loop(0.8).__class__(
            BeltAxis().linear(0.8), Drive(velocity_gain_n_m_s=gain)
        ).spectral_radius  # fmt: skip

    low, high = 0.2308, 50.0
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if radius(middle) < 1 else (low, middle)
    kick = np.zeros(100_000)
    kick[0] = 0.01
    calm = BeltAxis(
        mechanics=Mechanics(frozen_position_m=0.8), drive=Drive(velocity_gain_n_m_s=0.97 * low), excitation_n_m=kick,
        seconds=2,
    )  # fmt: skip
    velocity = SimulatedAxis(calm).run()[0]["velocity"]
    assert np.abs(velocity[-400:]).max() < 1e-3 * np.abs(velocity).max()
    with refused(SimulationError, "unstable"):
        BeltAxis(mechanics=Mechanics(frozen_position_m=0.8), drive=Drive(velocity_gain_n_m_s=1.03 * low))
