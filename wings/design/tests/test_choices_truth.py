"""What a design chooses: windows that a hop divides, no more lines than tell something, listed amplitudes as listed."""

import re

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from livebode.core import DesignError, GridError
from livebode.estimation import default_hop
from livebode.simulation import BeltAxis, Sensor, Strokes
from livebode_design import ExperimentSpec, MachineLimits, belt_machine, choose
from livebode_design.grid import grid
from tests.support.errors import refused

MACHINE = belt_machine(BeltAxis(sensor=Sensor(noise_rad_per_s=0.05)))
MOVING = belt_machine(BeltAxis(motion=Strokes()))
RATE_HZ = 4000.0


@settings(max_examples=150, deadline=None)
@given(resolution_hz=st.floats(0.5, 400), kind=st.sampled_from(["multisine", "chirp"]))
def test_a_chosen_window_resolves_what_was_asked_is_hardly_longer_and_a_hop_divides_it(resolution_hz, kind):
    lines = grid(ExperimentSpec(band_hz=(1, 1999), resolution_hz=resolution_hz, kind=kind), RATE_HZ).lines
    apart_hz = lines.resolution_hz * (2 if kind == "multisine" else 1)
    assert resolution_hz / 1.06 - RATE_HZ / lines.window**2 * 2 <= apart_hz <= resolution_hz * (1 + 1e-9)
    if lines.window >= 100:  # of shorter ones none within 5 % need have a divisor near a twentieth
        assert lines.window % default_hop(lines.window) == 0
        assert 0.8 <= 20 * default_hop(lines.window) / lines.window <= 1.25


@settings(max_examples=40, deadline=None)
@given(
    resolution_hz=st.floats(0.1, 0.39),
    low=st.floats(1, 100),
    width=st.floats(10, 1800),
    kind=st.sampled_from(["multisine", "odd", "chirp", "prbs"]),
)
@example(0.001, 1.0, 1800.0, "multisine")  # a longer window than there is
@example(0.01, 1.0, 1800.0, "odd")  # hundreds of thousands of lines
@example(0.01, 1.0, 1800.0, "prbs")
@example(0.1, 10.1818, 1454.7, "chirp")  # at 0.291 Hz the window that a hop divides is longer: 5001 lines
def test_more_lines_than_useful_are_refused_and_the_named_resolution_passes(resolution_hz, low, width, kind):
    def lines(apart_hz):
        spec = ExperimentSpec(band_hz=(low, low + width), resolution_hz=apart_hz, kind=kind)
        return len(grid(spec, RATE_HZ).lines)

    try:
        assert lines(resolution_hz) <= 5000
    except GridError as error:
        finest_hz = error.resolution_hz_min
        assert finest_hz > resolution_hz
        if error.code == "grid.window-too-long":  # no register is that long; with the longest there are too many lines
            return
        assert lines(finest_hz) <= 5000


@pytest.mark.parametrize("order", [14, 17, 20])
def test_a_prbs_with_too_many_useful_lines_is_refused_with_an_order_that_passes(order):
    with pytest.raises(GridError) as caught:
        grid(ExperimentSpec(band_hz=(1, 1999), order=order, kind="prbs", rate_divider=1), RATE_HZ)
    assert (caught.value.code, caught.value.lines_max) == ("grid.too-many-lines", 5000)
    named = caught.value.order_max
    assert len(grid(ExperimentSpec(band_hz=(1, 1999), order=named, kind="prbs", rate_divider=1), RATE_HZ).lines) <= 5000


def test_listed_amplitudes_are_reported_as_listed_and_refused_with_the_share_that_passes():
    listed = [1.0, 2.0, 3.0, 2.0, 1.0, 0.5, 0.5]
    spec = {"lines": "20:140:20", "window": 400, "phases": "schroeder"}
    design = choose(ExperimentSpec(**spec, amplitude_n_m=listed), MACHINE)
    assert design.plain()["excitation"]["amplitude_n_m"] == listed
    np.testing.assert_allclose(design.waveform.amplitude, listed, rtol=1e-12)
    (row,) = [choice for choice in design.choices if choice.what == "amplitude"]
    assert row.value == "0.5 … 3 N m"
    limits = MachineLimits(torque_n_m_max=4.0)
    with pytest.raises(DesignError, match="the amplitudes as listed give a torque") as caught:
        choose(ExperimentSpec(**spec, amplitude_n_m=listed), MOVING, limits)
    share = caught.value.passing
    choose(ExperimentSpec(**spec, amplitude_n_m=[share * a for a in listed]), MOVING, limits)
    with refused(DesignError, "limit-exceeded", quantity="torque"):
        choose(ExperimentSpec(**spec, amplitude_n_m=[1.01 * share * a for a in listed]), MOVING, limits)


@settings(max_examples=30, deadline=None)
@given(
    step=st.floats(0.01, 0.5), limit=st.floats(2.5, 5.0), kind=st.sampled_from(["multisine", "chirp", "prbs", "odd"]),
)  # fmt: skip
def test_the_amplitude_that_a_refusal_names_passes_in_the_drive_s_steps_too(step, limit, kind):
    spec = {"band_hz": (20, 140), "resolution_hz": 10, "kind": kind, "resolution_n_m": step}
    spec |= {"phases": "schroeder"} if kind in ("multisine", "odd") else {}
    with pytest.raises(DesignError) as caught:
        choose(ExperimentSpec(**spec, amplitude_n_m=20.0), MACHINE, MachineLimits(torque_n_m_max=limit))
    assert caught.value.code == "design.limit-exceeded"
    if caught.value.passing <= 0:
        assert "finer steps of the drive" in caught.value.remedy
        return
    choose(ExperimentSpec(**spec, amplitude_n_m=caught.value.passing), MACHINE, MachineLimits(torque_n_m_max=limit))


def test_the_worst_line_has_the_specified_accuracy():
    spec = ExperimentSpec(lines="20:140:20", window=400, phases="schroeder", amplitude_n_m=0.3, accuracy=0.02)
    predicted = choose(spec, MACHINE).plain()
    bounds = np.sqrt(np.log(20) / predicted["windows"]) * np.array(predicted["sigma_relative"])
    np.testing.assert_allclose(predicted["bound_95_relative"], bounds, rtol=1e-12)
    assert 0.02 * np.sqrt(1 - 1 / predicted["windows"]) < bounds.max() <= 0.02


def test_a_recording_longer_than_an_hour_reports_the_accuracy_of_one_hour():
    spec = ExperimentSpec(lines="20:140:20", window=400, phases="schroeder", amplitude_n_m=0.05, accuracy=1e-4)
    design = choose(spec, MACHINE)
    (row,) = [choice for choice in design.choices if choice.what == "recording"]
    reached = float(re.search(r"an hour is enough for (\S+) %", row.why).group(1)) / 100
    assert choose(ExperimentSpec(lines="20:140:20", window=400, phases="schroeder", amplitude_n_m=0.05,
                       accuracy=1.05 * reached), MACHINE).recording_s <= 3600  # fmt: skip


def test_the_frequency_above_which_the_loop_is_20_db_below_one_is_named_for_tuning():
    def row(lines):
        spec = ExperimentSpec(lines=lines, window=4000, phases="schroeder", amplitude_n_m=0.1)
        design = choose(spec, MACHINE)
        return next(choice for choice in design.choices if choice.what == "for tuning")

    wide = row("20:1500:20")
    assert wide.value == "1500 Hz suffices"
    reach_hz = float(re.search(r"reach ([\d.]+) Hz", wide.why)[1])
    assert row("4:20:4").value == f"lines to {reach_hz:.4g} Hz"
    f = np.geomspace(1.001 * reach_hz, 1990, 500)
    size = [np.abs(place.plant.response(f) * MACHINE.loop.feedback_at(f)) for place in MACHINE.places]
    assert np.max(size) < 0.1
    at = np.array([0.995 * reach_hz])
    assert np.max([np.abs(p.plant.response(at) * MACHINE.loop.feedback_at(at)) for p in MACHINE.places]) >= 0.1
