"""An axis in motion against its simulated truth: the correction removes what the motion does, and finds the machine."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from livebode.core import PID, Block, LivebodeError, Loop, Responses, SignalError, SimulationError, UsageError
from livebode.estimation import Settings, Tracker
from livebode.motion import MotionCorrection
from livebode.simulation import BeltAxis, Friction, Sensor, SimulatedAxis, Strokes
from tests.support.axes import LINES, MULTISINE
from tests.support.errors import refused
from tests.support.moving import SETTINGS, corrected, errors


def stroke(sigma: float = 0.0, seed: int = 1, seconds: float = 4.15, **options: object) -> tuple[BeltAxis, Block]:
    options.setdefault("motion", Strokes())
    options.setdefault("sensor", Sensor(noise_rad_per_s=sigma))
    axis = BeltAxis(excitation_n_m=MULTISINE, seconds=seconds, seed=seed, **options)
    return axis, SimulatedAxis(axis).run()[0]


def test_without_noise_motion_is_removed() -> None:
    axis, block = stroke()
    raw, ours = errors(axis, Tracker(SETTINGS).process(block)), errors(axis, corrected(axis, block))
    assert raw.db > 0.5
    assert raw.keff > 1.0
    assert ours.db < 0.05
    assert ours.keff < 0.1
    assert ours.js < 0.1


@pytest.mark.parametrize(
    "options",
    [
        {},
        {
            "friction": Friction(load_coulomb_n=15.0),
            "sensor": Sensor(noise_rad_per_s=0.1, encoder_counts_per_turn=1 << 20),
        },
        {"motion": Strokes(start_m=1.6, end_m=0.25)},
    ],
    ids=["plain", "friction and encoder", "backward"],
)
def test_parameters_of_single_windows_are_within_the_targets_with_noise(options: dict[str, object]) -> None:
    axis, block = stroke(0.1, **options)
    found = errors(axis, corrected(axis, block))
    assert found.db < 0.18  # white noise alone makes 0.15
    assert found.keff < 0.65
    assert found.js < 0.4


def test_the_fitted_model_is_the_machine() -> None:
    axis, block = stroke(0.1)
    correction = MotionCorrection(SETTINGS, radius_m=0.019, chunk_samples=len(block))
    assert correction.model is None
    correction.process(block)
    correction.finish()
    model, x = correction.model, np.linspace(0.4, 1.5, 12)
    assert model is not None
    assert abs(model.inertia_kg_m2 / 0.0028 - 1) < 0.002
    assert abs(model.load_kg / 6.7 - 1) < 0.005
    assert np.max(np.abs(model.stiffness_at(x) / axis.mechanics.stiffness_at(x) - 1)) < 0.01
    assert np.max(np.abs(model.damping_at(x) / axis.mechanics.damping_at(x) - 1)) < 0.1


def test_driven_by_the_excitation_it_is_as_good_once_the_acceleration_has_rung_out() -> None:
    axis, block = stroke()
    settings = Settings(lines=LINES, output="velocity", input="u", excitation="w", schedule="x", loop=axis.drive.loop())
    found = errors(axis, corrected(axis, block, settings, driven_by="excitation"), after_s=1.0)
    assert found.db < 0.02
    assert found.keff < 0.05


def test_the_cutting_into_blocks_changes_nothing() -> None:
    _, block = stroke(0.1, seconds=3.0)
    results = []
    for sizes in ([len(block)], [1, 999, 4000, 37, 6963]):
        correction = MotionCorrection(SETTINGS, radius_m=0.019, chunk_samples=4000)
        edges = np.cumsum([0, *sizes])
        parts = [correction.process(block.cut(int(a), int(b))) for a, b in pairwise(edges)]
        results.append(Responses.join([*parts, correction.finish()]))
    whole, cut = results
    assert np.array_equal(whole.sample, cut.sample)
    assert np.array_equal(whole.value, cut.value, equal_nan=True)
    assert np.array_equal(whole.sample, Tracker(SETTINGS).process(block).sample)


def test_a_gap_and_a_bad_sample_cost_their_windows_alone() -> None:
    axis, block = stroke(seconds=4.15)
    data = block.data.copy()
    data[:, 9000] = np.nan
    holed = Block(data, block.channels, block.rate_hz)
    correction = MotionCorrection(SETTINGS, radius_m=0.019, chunk_samples=len(block))
    later = Block(holed.cut(9500, len(block)).data, block.channels, block.rate_hz, start=9500, gap=True)
    parts = [correction.process(holed.cut(0, 9300)), correction.process(later), correction.finish()]
    responses = Responses.join(parts)
    tracker = Tracker(SETTINGS)
    expected = Responses.join([tracker.process(holed.cut(0, 9300)), tracker.process(later)])
    assert np.array_equal(responses.valid, expected.valid)
    far = (responses.sample < 9000) | (responses.sample > 9500 + 2400)
    rows = np.flatnonzero(far)
    assert errors(axis, Responses.join([responses[int(i) : int(i) + 1] for i in rows])).db < 0.1


def test_at_standstill_the_response_is_the_plant_and_too_few_samples_give_none() -> None:
    axis = BeltAxis(excitation_n_m=MULTISINE, seconds=1.5)
    block, truth = SimulatedAxis(axis).run()
    correction = MotionCorrection(SETTINGS, radius_m=0.019)
    responses = Responses.join([correction.process(block), correction.finish()])
    assert np.max(np.abs(responses[-1].value / truth.sampled(len(block) - 200).response(LINES.frequency_hz) - 1)) < 5e-3
    correction = MotionCorrection(SETTINGS, radius_m=0.019)
    assert len(correction.process(block.cut(0, 500))) == 0
    assert not correction.finish().valid.any()


def test_impossible_corrections_are_refused() -> None:
    def settings(**options: object) -> Settings:
        return Settings(**{"lines": LINES, "output": "y", "input": "u", "excitation": "w", "schedule": "x"} | options)

    with refused(UsageError, "missing", argument="schedule"):
        MotionCorrection(settings(schedule=None), radius_m=0.019)
    for name, value in (("average", True), ("quantity", "sensitivity")):
        with refused(UsageError, "conflict", argument=name, value=value):
            MotionCorrection(settings(**{name: value}), radius_m=0.019)
    with refused(SimulationError, "loop-unsupported", key="loop.feedback"):
        MotionCorrection(settings(), radius_m=0.019, driven_by="excitation")
    with refused(UsageError, "out-of-range", argument="radius_m", value=0.0):
        MotionCorrection(settings(), radius_m=0.0)
    with refused(UsageError, "out-of-range", argument="chunk_samples", value=500):
        MotionCorrection(settings(), radius_m=0.019, chunk_samples=500)
    with refused(UsageError, "out-of-range", argument="passes", value=0):
        MotionCorrection(settings(), radius_m=0.019, passes=0)
    with refused(UsageError, "out-of-range", argument="damping_splines", value=2):
        MotionCorrection(settings(), radius_m=0.019, damping_splines=2)
    with refused(SignalError, "too-short"):
        MotionCorrection(settings(), radius_m=0.019).finish()
    filtered = PID(gain=0.2, derivative_time_s=0.1, rate_hz=4000)
    with refused(SimulationError, "loop-unsupported", key="loop.feedback"):
        MotionCorrection(settings(loop=Loop(filtered)), radius_m=0.019, driven_by="excitation")
    with pytest.raises(LivebodeError, match="no channel"):
        MotionCorrection(settings(), radius_m=0.019).process(Block(np.zeros((1, 10)), ("w",), 4000.0))
