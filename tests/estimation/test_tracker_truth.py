"""Without noise and in the periodic state, every estimator is the sampled plant, and every wrong word costs."""

from __future__ import annotations

import numpy as np
import pytest

from livebode.core import PID, Block, Cascade, Lines, Loop, Response
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.simulation import TwoMassLoop, TwoMassPlant
from livebode.simulation.two_mass_loop import KPC, KVC, RATE_HZ, TI

LINES = Lines.parse("20:140:20", rate_hz=RATE_HZ, window=400)
TRUTH = TwoMassPlant().response(LINES.frequency_hz)
VELOCITY = PID(gain=KVC, integral_time_s=TI, rate_hz=RATE_HZ)
POSITION = PID(gain=KPC, rate_hz=RATE_HZ / 2, rate_divider=2)
LOOP = Loop(Cascade(VELOCITY, POSITION))


@pytest.fixture(scope="module")
def record() -> Block:
    w = multisine(LINES)
    u, y = TwoMassLoop().run(w, periods=4)
    return Block(np.array([np.tile(w, 4), u[0], y[0]]), ("w", "u", "y"), RATE_HZ)


def last(block: Block, **options: object) -> Response:
    settings = {"lines": LINES, "output": "y", "input": "u", "excitation": "w"} | options
    return Tracker(Settings(**settings)).process(block)[-1]


def error(response: Response, truth: np.ndarray = TRUTH) -> float:
    return float(np.max(np.abs(response.value / truth - 1)))


@pytest.mark.parametrize("options", [{}, {"estimator": "direct"}, {"average": True}, {"hann": True}, {"hop": 1}])
def test_joint_and_direct_are_the_sampled_plant(record: Block, options: dict) -> None:
    assert error(last(record, **options)) < 1e-12


@pytest.mark.parametrize("offset", [0.0, 100.0])
def test_float32_is_off_by_no_more_than_its_kernel_promises(record: Block, offset: float) -> None:
    block = Block(record.data + offset, record.channels, RATE_HZ)
    ours = last(block, dtype="float32")
    # 1e-6·√N·‖x‖₂ of the window for each spectrum, and half a unit of the last digit of each sample besides.
    share = 0.0
    for name in ("y", "u"):
        x = block[name][-LINES.window :]
        promised = (1e-6 + 2.0**-24) * np.sqrt(LINES.window) * np.linalg.norm(x)
        share = share + promised / np.abs(np.fft.fft(x)[list(LINES.bins)])
    relative = np.abs(ours.value / last(block).value - 1)
    assert np.all(relative < share)
    assert np.all(relative > 1e-12)


def test_indirect_is_the_sampled_plant(record: Block) -> None:
    # What remains is the image of the position loop, which runs at half the rate.
    assert error(last(record, estimator="indirect", loop=LOOP)) < 5e-6


@pytest.mark.parametrize("estimator", ["joint", "indirect"])
def test_logging_before_or_after_the_update_is_put_right(record: Block, estimator: str) -> None:
    late = Block(
        np.array([np.roll(record["w"], 1), np.roll(record["u"], 1), np.roll(record["y"], -1)]), record.channels, RATE_HZ
    )
    loop = Loop(LOOP.feedback, input_logged="before", excitation_logged="before", output_logged="after")
    assert error(last(late, estimator=estimator, loop=loop)) < 5e-6
    assert error(last(late, estimator=estimator, loop=LOOP)) > 5e-2


@pytest.mark.parametrize("loop", [LOOP, Loop()], ids=["known controller", "controller from the signals"])
def test_quantities_satisfy_their_definitions(record: Block, loop: Loop) -> None:
    z_loop = LOOP.feedback_at(LINES.frequency_hz) * TRUTH
    truth = {"open loop": z_loop, "closed loop": z_loop / (1 + z_loop), "sensitivity": 1 / (1 + z_loop)}
    for quantity, value in truth.items():
        assert error(last(record, quantity=quantity, loop=loop), value) < 1e-5, quantity
    measured = {q: last(record, quantity=q).value for q in truth}
    assert np.allclose(measured["closed loop"] + measured["sensitivity"], 1, atol=1e-12)


def test_an_excitation_at_the_velocity_reference_gives_the_plant() -> None:
    w = multisine(LINES)
    inner = VELOCITY.response(LINES.frequency_hz)
    # Seen from the plant, a multisine v at the velocity reference is the multisine Cvel·v at the plant input.
    spectrum = np.zeros(201, dtype=complex)
    spectrum[list(LINES.bins)] = np.fft.rfft(w)[list(LINES.bins)] * inner
    u, y = TwoMassLoop().run(np.fft.irfft(spectrum, 400), periods=2)
    block = Block(np.array([np.tile(w, 2), u[0], y[0]]), ("w", "u", "y"), RATE_HZ)
    loop = Loop(LOOP.feedback, entry=VELOCITY)
    assert error(last(block, estimator="indirect", loop=loop)) < 5e-6
    assert (
        error(
            last(block, quantity="sensitivity", loop=Loop(entry=VELOCITY)),
            1 / (1 + TRUTH * LOOP.feedback_at(LINES.frequency_hz)),
        )
        < 1e-5
    )


def test_differencing_is_exact_for_a_position_that_drifts_by_the_same_each_period(record: Block) -> None:
    drift = 1e-3 * np.arange(len(record))
    drifting = Block(np.array([record["w"], record["u"], record["y"] + drift]), record.channels, RATE_HZ)
    assert error(last(drifting)) > 1e-3
    # A ramp's difference is a constant, and a constant has no power at any line.
    assert error(last(drifting, differenced=("y",))) < 1e-11


def test_the_effective_time_of_a_response_is_the_centre_of_its_window(record: Block) -> None:
    position = np.arange(len(record), dtype=float)
    block = Block(np.vstack([record.data, position]), ("w", "u", "y", "x"), RATE_HZ, start=800, origin_s=7.0)
    for window in (400, 401):
        lines = Lines((4,), window, RATE_HZ)
        responses = Tracker(Settings(lines=lines, output="y", input="u", excitation="w", schedule="x")).process(block)
        r = responses[-1]
        assert r.sample - r.first == window - 1
        assert r.schedule == pytest.approx((r.sample - 800) - (window - 1) / 2)
        assert r.time_s == pytest.approx(7.0 + (r.first + r.sample) / 2 / RATE_HZ)


def test_the_effective_time_of_an_average_is_the_mean_of_its_windows(record: Block) -> None:
    block = Block(np.vstack([record.data, np.arange(1600.0)]), ("w", "u", "y", "x"), RATE_HZ)
    r = last(block, schedule="x", average=True, forgetting=1.0, hop=400)
    assert (r.first, r.sample) == (0, 1599)
    assert r.schedule == pytest.approx(1599 / 2)
    assert r.time_s == pytest.approx(1599 / 2 / RATE_HZ)
