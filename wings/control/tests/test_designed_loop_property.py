"""The [loop] that a design writes describes the drive that it was made for: its own check does not contradict it."""

from __future__ import annotations

from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from livebode import Lines, multisine
from livebode.configuration import LoopSection
from livebode.simulation import BeltAxis, Mechanics, SimulatedAxis
from livebode_control.loop_check.loop_check import check_loop
from livebode_control.loop_check.loop_equation import LoopSignals
from livebode_design import Experiment

LINES = Lines.parse("20:140:20", rate_hz=4000, window=400)


@st.composite
def drives(draw: st.DrawFn) -> tuple[dict[str, object], bool]:
    """[belt.drive] with every key that changes the controller, and whether the velocity is differenced."""
    drive = {
        "position_rate_hz": 4000.0 / draw(st.sampled_from((1, 2, 4, 5, 8, 10, 16))),
        "velocity_gain_n_m_s": draw(st.floats(0.05, 0.4)),
        "integral_time_s": draw(st.floats(0.05, 0.5)),
        "position_gain_per_s": draw(st.floats(0.5, 12.0)),
        "velocity_feedforward": draw(st.sampled_from((0.0, 1.0))),
        "delay_ticks": draw(st.integers(0, 2)),
    }
    return drive, draw(st.booleans())


@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@example(({"position_rate_hz": 1000.0, "position_gain_per_s": 8.0}, True))
@given(drives())
def test_the_loop_of_a_design_is_as_its_own_check_finds_it(given: tuple[dict[str, object], bool]) -> None:
    drive, differenced = given
    sensor = {"velocity_differenced": differenced, "encoder_counts_per_turn": 1048576}
    experiment = Experiment.model_validate(
        {"excitation": {}, "belt": {"drive": drive, "sensor": sensor, "standstill": {"position_m": 0.8}}}
    )
    axis = experiment.axis()
    assert axis is not None
    described = LoopSection.model_validate(experiment.loop_tables())
    moved = BeltAxis(
        drive=axis.drive, sensor=axis.sensor, mechanics=Mechanics(frozen_position_m=0.8), seconds=1.2,
        run_in_s=1.0, excitation_n_m=0.5 * multisine(LINES),
    )  # fmt: skip
    block, _ = SimulatedAxis(moved).run()
    signals = LoopSignals.of(block, LINES, input="u", excitation="w", output="velocity")
    found = check_loop(signals, described)
    # Of a right description one check in a hundred finds a change by chance; a wrong one has no p that is this large.
    assert found.verdict == "as described" or found.p > 1e-6, (drive, differenced, found.sentence)
