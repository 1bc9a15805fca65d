"""The tracker on real recordings with known answers; what each must give is in the recordings' own description."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from livebode.configuration import LoopSection
from livebode.core import Block, Gain, Lines, Loop, PositionPD, Response
from livebode.estimation import Settings, Tracker
from livebode.sources import open_log
from livebode_control.loop_check.loop_check import check_loop
from livebode_control.loop_check.loop_equation import LoopSignals
from livebode_drives.recordings.sinumerik import sinumerik_spectra
from tests.support.motor_bench import BENCH, bench_responses, motorbench, whole
from tests.support.real_recordings import recording


@pytest.mark.parametrize("estimator", ["joint", "direct"])
def test_motorbench_is_the_plain_average_of_its_periods(estimator: str) -> None:
    block = motorbench()
    found = bench_responses(block.cut(3 * 2500, 20 * 2500), estimator=estimator, average=True, forgetting=1.0)[-1]
    periods = block.data.reshape(3, 20, 2500)[:, 3:]
    mean = np.fft.fft(periods, axis=2).mean(axis=1)[:, list(BENCH.bins)]
    assert np.median(np.abs(found.value / (mean[2] / mean[1]) - 1)) <= 0.005
    above = BENCH.frequency_hz > 40
    f, level_db = BENCH.frequency_hz[above], found.magnitude_db[above]
    assert f[np.argmax(level_db)] == 77
    assert level_db.max() == pytest.approx(-37.5, abs=0.3)
    assert f[np.argmin(level_db)] == 53


def test_motorbench_scatter_with_differencing_and_without_the_spikes() -> None:
    careful = {"differenced": ("theta_mx",), "spikes": ("iq_adx",), "average": True, "forgetting": 1.0}
    found = bench_responses(motorbench(), **careful)[-1]
    plain = bench_responses(motorbench(), average=True, forgetting=1.0)[-1]
    scatter = [float(np.median(r.sigma / np.abs(r.value))) for r in (found, plain)]
    print(f"scatter between periods: {100 * scatter[0]:.3f} % with care, {100 * scatter[1]:.3f} % without")
    assert scatter[0] <= 0.0015 < scatter[1]


def test_motorbench_bounds_hold_the_period_left_out() -> None:
    options = {"differenced": ("theta_mx",), "spikes": ("iq_adx",)}
    steady = np.flatnonzero(bench_responses(motorbench(), **options).valid.all(axis=1))
    steady = steady[steady >= 3]
    hits = np.array([_within(left_out, steady) for left_out in steady])
    within = hits.mean(axis=(0, 2))
    print(f"of {hits.shape[0]} periods left out: {within[0]:.4f} within 1 sigma, {within[1]:.4f} within 2")
    assert within[0] == pytest.approx(0.63, abs=0.03)
    assert 0.96 <= within[1] <= 0.995


def _within(left_out: int, steady: np.ndarray) -> list[np.ndarray]:
    """Whether one period lies within the bounds that the others promise for it, at each line, for 1 and 2 sigma."""
    tracker = Tracker(
        Settings(
            lines=BENCH,
            excitation="iq_refx",
            input="iq_adx",
            output="theta_mx",
            hop=2500,
            average=True,
            forgetting=1.0,
            differenced=("theta_mx",),
        )
    )
    block = motorbench()
    for period in steady[steady != left_out]:
        others = tracker.process(_period(block, period))[-1]
    alone = bench_responses(_period(block, left_out), differenced=("theta_mx",))[-1]
    # A period scatters about the mean over m others by its noise times √(m + 1), and by the rest of sigma once.
    wider = np.sqrt(1 + (len(steady) - 1) * (others.noise / others.sigma) ** 2)
    return [np.abs(alone.value - others.value) <= wider * others.bound(c) for c in (1, 2)]


def _period(block: Block, number: int) -> Block:
    """One period with the sample before it, so that its first difference is known, numbered apart from the others."""
    piece = block.cut(2500 * number - 1, 2500 * (number + 1))
    return Block(piece.data, piece.channels, piece.rate_hz, start=5000 * number - 1)


EMPS_GAIN_N_V = 35.15065188248547
EMPS = Lines.parse("5:61:2", rate_hz=1000, window=1000)


def emps_signals() -> Block:
    """The difference of two runs on one trajectory, which isolates the injection; it starts in the first period."""
    names = ("qm", "vir")
    quiet, injected = (whole(f"emps/{run}.mat", names) for run in ("DATA_EMPS", "DATA_EMPS_PULSES"))
    w = whole("emps/DATA_EMPS_PULSES.mat", ("pulses_N",))
    return Block(np.vstack([injected.data - quiet.data, w.data]), (*names, "pulses_N"), 1000.0).cut(1000, len(w))


@cache
def emps(estimator: str) -> Response:
    controller = PositionPD(position_gain=160.18, velocity_gain=243.45, smoothed=True, rate_hz=1000)
    settings = Settings(
        lines=EMPS,
        output="qm",
        input="vir",
        excitation="pulses_N",
        estimator=estimator,
        hop=1000,
        average=True,
        forgetting=1.0,
        loop=Loop(controller, entry=Gain(1.014)),
    )
    return Tracker(settings).process(emps_signals())[-1]


@pytest.mark.parametrize(
    ("wrong", "key"),
    [
        ({}, ""),
        ({"velocity_gain": 246.0}, "loop.position_pd.velocity_gain"),
        ({"position_gain": 162.0}, "loop.position_pd.position_gain"),
        ({"delay_ticks": 1}, "loop.position_pd.delay_ticks"),
        ({"smoothed": False}, "loop.position_pd.smoothed"),
    ],
)
def test_emps_is_as_described_and_a_wrong_word_is_named(wrong: dict[str, object], key: str) -> None:
    described = {"position_gain": 160.18, "velocity_gain": 243.45, "smoothed": True, "rate_hz": 1000}
    section = LoopSection.model_validate({"entry_gain": 1.014, "position_pd": described | wrong})
    signals = LoopSignals.of(emps_signals(), EMPS, input="vir", excitation="pulses_N", output="qm")
    found = check_loop(signals, section)
    print(found.sentence)
    assert [one.change.key for one in found.explanations[:1]] == ([key] if key else [])
    assert (found.verdict == "as described") == (not wrong)


def test_emps_joint_and_indirect_agree() -> None:
    assert np.max(np.abs(emps("indirect").value / emps("joint").value - 1)) <= 0.005


@pytest.mark.parametrize("estimator", ["joint", "indirect"])
def test_emps_is_the_mass_and_friction_of_the_benchmark(estimator: str) -> None:
    s = 2j * np.pi * EMPS.frequency_hz
    against = np.abs(emps(estimator).value / EMPS_GAIN_N_V * (95.11 * s**2 + 203.5 * s))
    print(f"EMPS {estimator}: |G·(M s² + Fv s)| from {against.min():.3f} to {against.max():.3f}")
    assert against.min() >= 0.97
    assert against.max() <= 1.05


def test_sinumerik_equals_the_spectra_that_the_control_computed() -> None:
    path = recording("sinumerik/freq_trace.XML")
    settings = Settings(
        lines=Lines.parse("k=1:300", rate_hz=8000, window=2047),
        output="output",
        input="input",
        estimator="direct",
        hop=2047,
        average=True,
        forgetting=1.0,
    )
    tracker = Tracker(settings)
    for block in open_log(path).blocks(["input", "output"]):
        found = tracker.process(block)[-1]
    control = sinumerik_spectra(path)
    theirs = np.conj(control.cross / control.input_auto)[1:301]
    assert np.max(np.abs(found.value / theirs - 1)) <= 1e-10
    level_db = dict(zip(np.round(found.lines.frequency_hz, 1), found.magnitude_db))
    assert [level_db[f] for f in (19.5, 50.8, 101.6)] == pytest.approx([-0.21, -2.23, -6.06], abs=0.01)
