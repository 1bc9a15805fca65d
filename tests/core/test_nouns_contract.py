"""Block, Response, Model and Loop keep what they say."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib import pyplot

from livebode.core import (
    PID,
    Block,
    Cascade,
    Channel,
    Gain,
    GridError,
    Lines,
    Loop,
    PositionPD,
    Quantity,
    Response,
    Responses,
    UsageError,
    as_model,
    widened,
)
from tests.support.errors import refused

F_HZ = np.array([5.0, 20.0, 61.0, 140.0])
RATE_HZ = 4000.0


def test_a_block_is_immutable_and_cuts_without_a_copy() -> None:
    source = np.arange(20.0).reshape(2, 10)
    block = Block(source, (Channel("u", "N m"), Channel("y", "rad/s")), 1000, start=30, origin_s=2.0, gap=True)
    with pytest.raises(ValueError, match="read-only"):
        block["u"][0] = 1
    part = block.cut(4, 7)
    assert (part.start, part.stop, part.gap, block.cut(0, 2).gap) == (34, 37, False, True)
    assert np.shares_memory(part.data, source)
    assert part.time_s == pytest.approx([2.034, 2.035, 2.036])
    source[0, 0] = 5  # the block did not take the right to write from its source


@pytest.mark.parametrize(
    ("arguments", "code", "facts"),
    [
        ((np.zeros(3), ("u",), 1000), "wrong-shape", {"argument": "data", "shape": [3]}),
        ((np.zeros((2, 3)), ("u",), 1000), "wrong-shape", {"argument": "channels", "shape": [2, 3]}),
        ((np.zeros((2, 3)), ("u", "u"), 1000), "duplicate", {"argument": "channels", "value": "u"}),
        ((np.zeros((1, 3)), ("u",), 0), "out-of-range", {"argument": "rate_hz", "value": 0}),
    ],
)
def test_inconsistent_blocks_are_refused(arguments: tuple, code: str, facts: dict) -> None:
    with refused(UsageError, code, **facts):
        Block(*arguments)


@given(sigma=st.floats(0.1, 10), dof=st.floats(0.5, 200), c=st.floats(0.2, 3))
def test_widened_bounds_keep_their_probability(sigma: float, dof: float, c: float) -> None:
    # |e|²/sigma² follows F(2, 2d), whose distribution is 1 − (1 + x/d)^−d.
    x = (widened(sigma, dof, c) / sigma) ** 2
    assert 1 - (1 + x / dof) ** -dof == pytest.approx(1 - np.exp(-(c**2)), rel=1e-9)


def response(lines: Lines) -> Response:
    k = len(lines)
    return Response(
        lines=lines, value=np.arange(1, k + 1) * (1 + 1j), sigma=np.full(k, 0.1), dof=3.0, coherence=np.ones(k),
        valid=np.arange(k) > 0, first=0, sample=399, time_s=0.05,
    )  # fmt: skip


def test_a_response_is_a_model_at_its_lines_and_nowhere_else() -> None:
    measured = response(Lines.parse("20:80:20", 4000, 400))
    assert np.array_equal(measured.response([60.0, 20.0]), [3 + 3j, 1 + 1j])
    assert as_model(measured) is measured
    with refused(GridError, "line-off", frequency_hz=30.0):
        measured.response([20.0, 30.0])
    with refused(GridError, "line-off", frequency_hz=500.0):
        measured.response(500.0)


def test_a_response_becomes_python_controls_frd_at_its_valid_lines() -> None:
    measured = response(Lines.parse("20:80:20", 4000, 400))
    frd = measured.to_frd()
    assert np.allclose(frd.omega, 2 * np.pi * np.array([40, 60, 80]))
    assert np.allclose(np.squeeze(frd.frdata), measured.value[1:])


def test_responses_of_different_lines_do_not_join() -> None:
    one, other = (_batch(Lines.parse(text, 4000, 400)) for text in ("20,40", "20,60"))
    with refused(GridError, "not-alike"):
        Responses.join([one, other])
    assert len(Responses.join([one, one])) == 4


def test_rows_are_taken_by_slice_number_and_truth() -> None:
    batch = _batch(Lines.parse("20,40", 4000, 400))
    for rows in (slice(1, 2), np.array([1]), np.array([False, True])):
        assert np.array_equal(batch[rows].sample, batch.sample[1:])
        assert np.array_equal(batch[rows].value, batch.value[1:], equal_nan=True)


def _batch(lines: Lines) -> Responses:
    shape = (2, len(lines))
    return Responses(
        lines, np.ones(shape, complex), np.ones(shape), np.ones(2), np.ones(shape), np.ones(shape, bool),
        np.zeros(2, int), np.arange(2), np.zeros(2), np.zeros(2),
    )  # fmt: skip


def test_models_come_from_python_control() -> None:
    s = 2j * np.pi * F_HZ
    continuous = control.tf([1.0, 2.0], [1.0, 3.0, 5.0])
    assert np.allclose(as_model(continuous).response(F_HZ), (s + 2) / (s**2 + 3 * s + 5))
    z = np.exp(s / RATE_HZ)
    discrete = control.tf([0.5, 0.1], [1.0, -0.7], 1 / RATE_HZ)
    assert np.allclose(as_model(discrete).response(F_HZ), (0.5 * z + 0.1) / (z - 0.7))
    assert np.allclose(as_model(control.ss(discrete)).response(F_HZ), as_model(discrete).response(F_HZ))
    assert np.shape(as_model(continuous).response(20.0)) == ()
    for unusable, code in (
        (control.tf([1], [1, 1], True), "missing"),
        (control.ss([[-1.0]], [[1.0, 1.0]], [[1.0]], [[0.0, 0.0]]), "wrong-shape"),
    ):
        with refused(UsageError, code):
            as_model(unusable)
    with pytest.raises(TypeError, match="'PI'"):
        as_model("PI")


def test_a_pid_is_its_transfer_function() -> None:
    ts = 1 / RATE_HZ
    z = control.tf("z")
    z.dt = ts
    pid = PID(
        gain=2.0, integral_time_s=0.1, derivative_time_s=0.01, derivative_filter_s=0.002, rate_hz=RATE_HZ, delay_ticks=1
    )
    slope = (1 - 1 / z) / ts
    truth = 2.0 * (1 + ts / 0.1 * z / (z - 1) + 0.01 * slope / (1 + 0.002 * slope)) / z
    assert np.allclose(pid.response(F_HZ), as_model(truth).response(F_HZ))


@pytest.mark.parametrize(
    ("rule", "numerator"),
    [("backward", [1, 0]), ("forward", [1]), ("trapezoidal", [0.5, 0.5])],
)
def test_each_integrator_rule_has_its_transfer_function(rule: str, numerator: list[float]) -> None:
    truth = 1 + control.tf(np.array(numerator) / RATE_HZ / 0.2, [1, -1], 1 / RATE_HZ)
    pi = PID(gain=1.0, integral_time_s=0.2, rate_hz=RATE_HZ, integrator=rule)
    assert np.allclose(pi.response(F_HZ), as_model(truth).response(F_HZ))


@pytest.mark.parametrize("ticks", [1, 2, 5])
def test_a_held_controller_is_what_upsampling_its_output_gives(ticks: int) -> None:
    # A sine sampled every `ticks` ticks, amplified and held: the share of it at its own frequency.
    n = np.arange(4000)
    sine = np.exp(2j * np.pi * 60 / RATE_HZ * n)
    held = np.repeat(3.0 * sine[::ticks], ticks)[: n.size]
    share = np.vdot(sine, held) / n.size
    controller = PID(gain=3.0, rate_hz=RATE_HZ / ticks, rate_divider=ticks)
    assert controller.response(60.0) == pytest.approx(share, rel=2e-3)


def test_position_pd_is_the_emps_controller() -> None:
    kp, kv, rate = 160.18, 243.45, 1000.0
    z = np.exp(2j * np.pi * F_HZ / rate)
    truth = kv * kp + kv * rate * (1 - 1 / z) * (1 + 1 / z) / 2
    assert np.allclose(
        PositionPD(position_gain=kp, velocity_gain=kv, smoothed=True, rate_hz=rate).response(F_HZ), truth
    )


def test_the_cascade_is_point_1_of_the_method() -> None:
    kvc, ti, kpc, t = 0.2308, 0.2, 1.0, 1 / RATE_HZ
    z = np.exp(2j * np.pi * F_HZ * t)
    truth = kvc * (1 + t / ti * z / (z - 1)) * (1 + kpc * (1 + 1 / z) / 2 * t * (z + 1) / (2 * (z - 1)))
    cascade = Cascade(
        PID(gain=kvc, integral_time_s=ti, rate_hz=RATE_HZ), PID(gain=kpc, rate_hz=RATE_HZ / 2, rate_divider=2)
    )
    assert np.allclose(cascade.response(F_HZ), truth, rtol=1e-12)


@given(g=st.complex_numbers(min_magnitude=0.01, max_magnitude=100), f=st.floats(0.01, 10), e=st.floats(0.5, 2))
def test_the_plant_comes_back_from_the_closed_loop(g: complex, f: float, e: float) -> None:
    if abs(1 + g * f) < 1e-3:
        return
    loop = Loop(Gain(f), entry=Gain(e))
    closed = np.array([g * e / (1 + g * f)])
    plant, slope = loop.plant(closed, np.array([20.0]))
    assert plant[0] == pytest.approx(g, rel=1e-6)
    step = 1e-6 * closed
    moved, _ = loop.plant(closed + step, np.array([20.0]))
    assert (moved - plant)[0] / step[0] == pytest.approx(slope[0], rel=1e-2)


@pytest.mark.parametrize(
    ("make", "code", "facts"),
    [
        (lambda: PID(gain=1.0, rate_hz=0), "out-of-range", {"argument": "rate_hz", "value": 0}),
        (lambda: PID(gain=1.0, rate_hz=1, integral_time_s=0), "out-of-range", {"argument": "integral_time_s"}),
        (lambda: PID(gain=1.0, rate_hz=1, integrator="euler"), "not-one-of", {"argument": "integrator"}),
        (lambda: PID(gain=1.0, rate_hz=1, hold="foh"), "not-one-of", {"argument": "hold", "value": "foh"}),
        (lambda: PID(gain=1.0, rate_hz=1, rate_divider=0), "out-of-range", {"argument": "rate_divider", "value": 0}),
        (lambda: PID(gain=1.0, rate_hz=1, delay_ticks=-1), "out-of-range", {"argument": "delay_ticks", "value": -1}),
        (lambda: Loop(input_logged="later"), "not-one-of", {"argument": "input_logged", "value": "later"}),
        (lambda: Loop().feedback_at(F_HZ), "missing", {"argument": "feedback"}),
    ],
)
def test_inconsistent_loops_are_refused(make: object, code: str, facts: dict) -> None:
    with refused(UsageError, code, **facts):
        make()


def test_a_feedback_without_a_frequency_response_is_a_type_error() -> None:
    with pytest.raises(TypeError, match="'PI'"):
        Loop(feedback="PI")


@pytest.mark.parametrize("quantity", ["plant", "open loop"])
def test_an_exported_response_is_drawn_by_python_control(quantity: Quantity) -> None:
    frd = replace(response(Lines.parse("20:80:20", 4000, 400)), quantity=quantity).to_frd()
    drawn = control.bode_plot(frd)
    assert quantity in drawn.axes[0, 0].get_figure()._suptitle.get_text()
    pyplot.close("all")
