"""Proposed gains applied in the non-linear simulated axis: `python -m studies.tune_steps [axes]`.

Each axis has a belt whose stiffness follows the cart, Coulomb and Stribeck friction, torque ripple (cogging), torque
noise, an encoder of finite resolution and a delay, all drawn at random. Its plant is measured at three places while the
cart moves slowly; one proposal for all three is applied in the simulator; there the velocity reference steps from
0.1 to 0.15 m/s at each place. The true motor velocity is compared with the predicted step and its 95 % band, of its
place alone and of all places. Then the belt has a constant stiffness during the measurement, the step, or both.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from livebode import Block, Cascade, Lines, Responses, Settings, Tracker, TuneError, multisine
from livebode.fitting import mean_response
from livebode.simulation import BeltAxis, Drive, Friction, Limits, Mechanics, Sensor, SimulatedAxis
from livebode_control.tuning import ControllerProposal, LoopSpecification, tune
from livebode_control.tuning.predicted_steps import PredictedStep, predicted_steps
from studies.result import Table, Verdict
from studies.tune import show

Floats = NDArray[np.float64]

RATE_HZ = 4000.0
LINES = Lines.parse("2:520:2", rate_hz=RATE_HZ, window=2000)
PLACES_M = (0.7, 1.0, 1.3)
SLOW, FAST = 0.1, 0.15  # m/s
LIMITS = LoopSpecification(notches=0, low_pass=False)  # the simulated drive has no filters
_SETTLED_S, _PASS_S, _PASSES, _SHOWN_S = 1.0, 1.0, 4, 0.15
_INSIDE, _DEVIATION = 0.95, 0.05


@dataclass(frozen=True)
class Speeds:
    """Motion at one speed after the other, with a jump in between; it passes `through_m` at the last jump.

    The references jump, as a test of a loop does; so limits of acceleration are not checked.
    """

    through_m: float
    pieces: tuple[tuple[float, float], ...]  # speed in m/s, seconds

    def cycle(self, rate_hz: float) -> tuple[Floats, Floats]:
        speed = np.concatenate([np.full(round(seconds * rate_hz), v) for v, seconds in self.pieces])
        way = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2)]) / rate_hz
        return way - way[speed.size - round(self.pieces[-1][1] * rate_hz)] + self.through_m, speed

    def check(self, limits: Limits) -> None:
        pass


def axes(seed: int) -> Iterator[BeltAxis]:
    """Resonances of about 35 … 90 Hz with a damping of 4 … 10 %, delays of 0 … 4 ticks."""
    rng = np.random.default_rng(seed)
    while True:
        load, stiffness = rng.uniform(3, 10), 5e5 * rng.uniform(0.5, 2)
        reduced = load * 0.0028 / (0.0028 + load * 0.019**2)
        yield BeltAxis(
            mechanics=Mechanics(
                masses=int(rng.integers(2, 4)),  # type: ignore[arg-type]
                load_kg=load,
                stiffness_n_per_m=stiffness,
                damping_n_s_per_m=2 * rng.uniform(0.04, 0.1) * np.sqrt(stiffness * reduced),
            ),
            friction=Friction(
                motor_coulomb_n_m=rng.uniform(0.05, 0.2),
                motor_stribeck_n_m=rng.uniform(0, 0.05),
                motor_viscous_n_m_s=rng.uniform(0.002, 0.01),
                load_coulomb_n=rng.uniform(2, 10),
                load_viscous_n_s_per_m=rng.uniform(0, 20),
            ),
            drive=Drive(
                position_rate_hz=RATE_HZ,
                position_gain_per_s=10.0,  # settled before the samples that are used
                delay_ticks=int(rng.integers(0, 5)),
                torque_ripple_n_m=rng.uniform(0, 0.03),
                torque_noise_n_m=0.02,
            ),
            sensor=Sensor(encoder_counts_per_turn=2 ** int(rng.integers(16, 21))),
            seed=int(rng.integers(1 << 30)),
        )  # fmt: skip


def frozen(axis: BeltAxis, position_m: float) -> BeltAxis:
    """The same axis with the stiffness of one position everywhere."""
    return replace(axis, mechanics=replace(axis.mechanics, frozen_position_m=position_m))


def measured(axis: BeltAxis, *, constant: bool = False, line_n_m: float = 0.05) -> Responses:
    """The mean response at each place, from slow passes; with `constant`, the belt does not change during a pass."""
    rows = []
    for number, at in enumerate(PLACES_M):
        # Not the same noise at each place: a bound over the places would count it as independent.
        moved = replace(axis, seed=axis.seed + number * _PASSES)
        rows.append(_passed(frozen(moved, at) if constant else moved, at, line_n_m))
    return Responses.join(rows)


def _passed(axis: BeltAxis, place: float, line_n_m: float) -> Responses:
    tracker = Settings(lines=LINES, output="velocity", input="u", excitation="w", hop=LINES.window)
    passes = []
    for number in range(_PASSES):
        # Not at the same place again: the ripple would be in phase with the excitation in every pass.
        through = place + 0.013 * (number / _PASSES - 0.5)
        motion = Speeds(through, ((SLOW, _SETTLED_S + _PASS_S / 2), (SLOW, _PASS_S / 2)))
        moved = replace(
            axis, motion=motion, excitation_n_m=line_n_m * multisine(LINES), seconds=_SETTLED_S + _PASS_S,
            seed=axis.seed + number,
        )  # fmt: skip
        block, _ = SimulatedAxis(moved).run()
        part = block.data[:, round(_SETTLED_S * RATE_HZ) :]
        one = Block(part, block.names, RATE_HZ, start=number * part.shape[1])
        passes.append(Tracker(tracker).process(one))
    return mean_response(Responses.join(passes))


def proposed(axis: BeltAxis, *, constant: bool = False) -> ControllerProposal | None:
    """The proposal for all places; None where livebode refuses."""
    try:
        return tune(measured(axis, constant=constant), axis.drive.loop(), LIMITS, loop_checked=True)
    except TuneError:
        return None


def applied(axis: BeltAxis, found: ControllerProposal) -> BeltAxis:
    """The axis with the proposed gains in its drive."""
    cascade = found.feedback.controller
    assert isinstance(cascade, Cascade)
    gains = {
        "velocity_gain_n_m_s": cascade.velocity.gain,
        "integral_time_s": cascade.velocity.integral_time_s,
        "position_gain_per_s": cascade.position.gain,  # type: ignore[attr-defined]
    }
    return replace(axis, drive=replace(axis.drive, **gains))


@dataclass(frozen=True)
class Compared:
    """A step at one place: shares of its samples within bands, and its largest deviation from its place's prediction.

    `noise` is the share within the band of its place, `own` within that which also contains the variation of the speed
    before the step (1.96 times its rms deviation from the reference), no part of the step. `inside` and `width` are of
    the band of all places with that variation. Deviation and width are in sizes of the step.
    """

    noise: float
    own: float
    inside: float
    deviation: float
    width: float


def stepped(axis: BeltAxis, found: ControllerProposal, place: int) -> Compared:
    """The step simulated with friction, ripple, encoder and noise, compared with its prediction."""
    before_s = _SETTLED_S + 0.5
    motion = Speeds(PLACES_M[place], ((SLOW, before_s), (FAST, _SHOWN_S)))
    _, truth = SimulatedAxis(replace(applied(axis, found), motion=motion, seconds=before_s + _SHOWN_S)).run()
    speed, at = truth.states[1] * axis.mechanics.radius_m, round(before_s * RATE_HZ)
    step = (speed[at:] - SLOW) / (FAST - SLOW)
    variation = float(np.sqrt(np.mean((speed[at // 2 : at] - SLOW) ** 2))) / (FAST - SLOW)
    time_s = (np.arange(step.size) + 0.5) / RATE_HZ
    alone = [predicted_steps(found.plant.at([i]), found.feedback.model, time_s)[0] for i in range(len(PLACES_M))]
    widened = [_widened(one, variation) for one in alone]
    every = PredictedStep.over(widened)
    return Compared(
        noise=_share(step, alone[place]),
        own=_share(step, widened[place]),
        inside=_share(step, every),
        deviation=float(np.abs(step - alone[place].value[0]).max()),
        width=float(np.mean(every.high - every.low)),
    )


def _widened(step: PredictedStep, variation: float) -> PredictedStep:
    """With the variation of the speed in its band."""
    value = step.value[0]
    low = value - np.hypot(value - step.low, 1.96 * variation)
    high = value + np.hypot(step.high - value, 1.96 * variation)
    return replace(step, low=low, high=high)


def _share(step: Floats, band: PredictedStep) -> float:
    return float(np.mean((step >= band.low) & (step <= band.high)))


def compared(
    count: int, seed: int = 1, *, constant_measured: bool = False, constant_stepped: bool = False
) -> tuple[list[Compared], int]:
    """Every step of `count` axes, and the number of refused axes; a constant belt has the stiffness of the place."""
    found, refused = [], 0
    for axis, _ in zip(axes(seed), range(count)):
        proposal = proposed(axis, constant=constant_measured)
        if proposal is None:
            refused += 1
            continue
        for place, at in enumerate(PLACES_M):
            found.append(stepped(frozen(axis, at) if constant_stepped else axis, proposal, place))
    return found, refused


def summary(measurement: str, step: str, found: list[Compared], refused: int) -> tuple[str | int, ...]:
    """A row of the table."""
    columns = (np.array([getattr(one, name) for one in found]) for name in Compared.__dataclass_fields__)
    noise, own, inside, deviation, width = columns
    return (
        measurement, step, len(found), refused, f"{100 * noise.mean():.1f} %", f"{100 * own.mean():.1f} %",
        f"{100 * inside.mean():.1f} %", f"{100 * np.median(width):.1f} %", f"{100 * np.median(deviation):.1f} %",
        f"{100 * deviation.max():.1f} %",
    )  # fmt: skip


def main(count: int = 50) -> None:
    header = (
        "belt measured", "belt in the step", "steps", "refused axes", "place, noise", "place", "all places", "width",
        "deviation", "worst",
    )  # fmt: skip
    following, refused = compared(count)
    rows = [summary("follows the cart", "follows the cart", following, refused)]
    for measurement, step in ((False, True), (True, False), (True, True)):
        words = ("constant" if one else "follows the cart" for one in (measurement, step))
        rows.append(summary(*words, *compared(count, constant_measured=measurement, constant_stepped=step)))
    show(Table("Steps in the non-linear axis", header, rows))
    inside = float(np.mean([one.inside for one in following]))
    print(Verdict("share of samples within the band of all places", inside, _INSIDE, at_least=True, why="measured"))
    deviation = float(np.median([one.deviation for one in following]))
    print(Verdict("median of the largest deviation", deviation, _DEVIATION, why="measured"))


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
