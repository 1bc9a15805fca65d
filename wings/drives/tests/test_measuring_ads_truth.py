"""`livebode measure` on a PLC: the generated program plays, and its ring is read over ADS."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from livebode.analysis import mean_of
from livebode.configuration import Axis
from livebode.core import MeasurementError
from livebode.records import RunRecord
from livebode.runtime import Destination, run
from livebode_design import Experiment, ReadyMeasurement, design_experiment, measure, prepare
from livebode_design.playback import StopRequest
from livebode_drives.excitation_file import read_designed
from tests.support.command import write_csv
from tests.support.errors import refused
from tests.support.peers.peer import Feeding, until
from tests.support.peers.plc_program import FEEDBACK, RATE_HZ, PlcProgram, plant

WINDOW = 40
RAMP = 500
"""Samples of the design's ramp: half a second."""
BINS = np.array([2, 5, 8])
AXIS = f"""
[source]
log = "known.csv"
[signals]
excitation = "w"
input = "u"
output = "y"
[lines]
frequencies = "k=2:8:3"
window = {WINDOW}
[loop.velocity]
gain = {FEEDBACK}
rate_hz = {RATE_HZ}
"""


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of the plant, computed in closed form, which the experiment starts from."""
    folder = tmp_path_factory.mktemp("known")
    n = np.arange(40 * WINDOW)
    turns = 2 * np.pi * np.outer(BINS, n) / WINDOW
    g = plant(BINS * RATE_HZ / WINDOW)[:, np.newaxis]
    noise = np.random.default_rng(3).normal(0, 1e-4, (2, n.size))
    w = np.cos(turns).sum(axis=0)
    through = np.exp(1j * turns) / (1 + FEEDBACK * g)
    u, y = (np.real(h * through).sum(axis=0) + noise[i] for i, h in enumerate((1.0, g)))
    write_csv(folder / "known.csv", {"t [s]": n / RATE_HZ, "w [N m]": w, "u [N m]": u, "y [rad/s]": y})
    (folder / "known.toml").write_text(AXIS)
    run(Axis.read(folder / "known.toml"), Destination(folder / "known", lambda *_: None))
    return folder


def described(known: Path, **more: object) -> Experiment:
    table = {
        "measured": {"run": str(known / "known"), "noise": 0.01},
        "excitation": {"lines": "k=2:8:3", "window": WINDOW, "accuracy": 0.05},
    }
    return Experiment.of(table | more, "experiment")


@pytest.fixture
def plc(known: Path, tmp_path: Path) -> Iterator[PlcProgram]:
    made = design_experiment(described(known), tmp_path / "design")
    waveform = read_designed(made.directory / "excitation.npz")
    with PlcProgram(tmp_path, waveform.samples, waveform.lines, waveform.ramp_periods) as found:
        yield found


def prepared(plc: PlcProgram, known: Path, **more: object) -> tuple[Experiment, ReadyMeasurement]:
    experiment = described(known, source=plc.settings, **more)
    return experiment, prepare(experiment)


def test_the_generated_program_is_measured_in_one_call(plc: PlcProgram, known: Path, tmp_path: Path) -> None:
    experiment, found = prepared(plc, known, measure={"silence_s": 20.0})
    said: list[str] = []
    made = measure(experiment, found, tmp_path / "out", StopRequest(), say=said.append)
    assert made.lost == 0
    assert said[-1] == "complete; ramping down"
    assert not any(plc.excitation[-20:])
    outcome = run(Axis.read(tmp_path / "out" / "axis.toml"), Destination(tmp_path / "run", lambda *_: None))
    mean = mean_of(RunRecord.open(outcome.directory))[0]
    truth = plant(mean.lines.frequency_hz)
    assert np.all(np.abs(mean.value - truth) < 4 * mean.sigma)
    assert np.all(mean.sigma < 0.05 * np.abs(truth))


def test_a_limit_ends_it_with_the_ramp_of_the_block(plc: PlcProgram, known: Path, tmp_path: Path) -> None:
    experiment, found = prepared(plc, known, measure={"silence_s": 20.0, "limits": {"y": 1000.0}})
    said: list[str] = []

    def say(sentence: str) -> None:
        said.append(sentence)
        if sentence.startswith("ramping up"):
            plc.fault = 2000.0

    with refused(MeasurementError, "limit-exceeded", channel="y", high=1000.0):
        measure(experiment, found, tmp_path / "out", StopRequest(), say=say)
    assert not any(plc.excitation[-20:])


def test_an_excitation_that_was_interrupted_is_not_tracked(plc: PlcProgram, known: Path, tmp_path: Path) -> None:
    experiment, found = prepared(plc, known, measure={"silence_s": 20.0})

    def play() -> None:
        until(lambda: np.count_nonzero(plc.excitation) > RAMP + 5 * WINDOW, "the steady excitation")
        plc.write("stop", b"\x01")

    with Feeding(play), refused(MeasurementError, "played-differs", channel="w"):
        measure(experiment, found, tmp_path / "out", StopRequest(), say=lambda _: None)
    assert not any(plc.excitation[-20:])


def test_a_second_request_is_zero_at_once(plc: PlcProgram, known: Path, tmp_path: Path) -> None:
    experiment, found = prepared(plc, known, measure={"silence_s": 20.0})
    request = StopRequest()

    def say(sentence: str) -> None:
        if sentence.startswith("ramping up"):
            request.ask()
            request.ask()

    made = measure(experiment, found, tmp_path / "out", request, say=say)
    assert made.samples
    assert not any(plc.excitation[-20:])
    until(lambda: plc.program["stop"] is False, "stop to be reset")


def test_without_a_sign_of_life_the_program_ramps_down(plc: PlcProgram, known: Path) -> None:
    _, found = prepared(plc, known)
    found.player.start(found.design.waveform)
    until(lambda: any(plc.excitation), "the excitation")
    # What a killed livebode leaves: nobody calls keep.
    until(lambda: plc.program["enable"] is False, "the end of the watch")
    until(lambda: len(plc.excitation) > 50 and not any(plc.excitation[-50:]), "the end of the ramp")
    peak = np.max(np.abs(plc.excitation))
    steps = np.abs(np.diff(plc.excitation))
    assert np.max(steps) <= 2 * peak
    found.player.close()


def test_a_program_that_plays_already_or_has_another_rate_is_refused(plc: PlcProgram, known: Path) -> None:
    plc.write("enable", b"\x01")
    with pytest.raises(MeasurementError, match=r"MAIN\.enable is TRUE"):
        prepared(plc, known)
    plc.write("enable", b"\x00")
    plc.write("livebode.rate_hz", struct.pack("<d", 2000.0))
    with pytest.raises(MeasurementError, match="runs at 2000 Hz, but the excitation is for 1000 Hz"):
        prepared(plc, known)
