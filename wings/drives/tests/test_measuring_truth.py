"""`livebode measure` on LinuxCNC's HAL: one command from a description to a response within its bounds."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from livebode.analysis import mean_of
from livebode.core import Channel
from livebode.records import RunRecord
from livebode.sources import open_log
from tests.support.command import livebode
from tests.support.hal_experiments import known_machine, write_experiment
from tests.support.peers.hal import RATE_HZ, Hal, only_hal, plant, sensitivity


@pytest.fixture
def hal() -> Iterator[Hal]:
    with only_hal(), Hal() as found:
        yield found


def test_one_command_measures_a_foreign_closed_loop_within_its_bounds(hal: Hal, tmp_path: Path) -> None:
    known_machine(tmp_path)
    hal.play(np.random.default_rng(1).normal(0, 0.005, 60 * RATE_HZ), 1)
    file, out = write_experiment(tmp_path, measure="lead_s = 3.0\nsilence_s = 20.0"), tmp_path / "out"
    dry = livebode("measure", file, "--out", out, "--dry-run")
    assert dry.code == 0
    assert not out.exists()
    assert hal.halcmd("getp", "streamer.0.empty").strip() == "TRUE"
    for words in ("peak torque", "95 % bound", "hal:sampler.0", "u -3 … 3", "is zero after a stop"):
        assert words in " ".join(dry.out.split())
    done = livebode("measure", file, "--out", out)
    assert done.code == 0, done.err
    assert "complete; ramping down" in done.out
    assert float(hal.halcmd("getp", "mux2.0.out")) == 0.0

    log = open_log(out / "log.csv")
    assert Channel("velocity", "rad/s", "velocity") in log.channels
    played = np.concatenate([block["w"] for block in log.blocks(["w"])])
    design = json.loads((out / "design.json").read_text())
    assert np.max(np.abs(played)) <= design["peak_n_m"] + 1e-6
    assert not played[: RATE_HZ // 5].any()
    assert not played[-RATE_HZ // 25 :].any()
    source = tomllib.loads((out / "axis.toml").read_text())["source"]
    first, last = (int(source[key].split()[0]) for key in ("from", "to"))
    assert (last - first) / RATE_HZ >= design["recording_s"]

    mean = mean_of(RunRecord.open(out / "run"))[0]
    truth = plant(mean.lines.frequency_hz)
    assert np.all(np.abs(mean.value - truth) < 4 * mean.sigma)
    predicted = np.array(design["sigma_relative"]) * np.abs(truth)
    assert np.all(mean.sigma < 2 * predicted)


def test_the_excitation_is_played_in_the_unit_of_the_controller_and_recorded_in_newton_metres(
    hal: Hal, tmp_path: Path
) -> None:
    """The controller's channel is in %, of which one is 2 N m: what it plays is half the numbers of the design."""
    known_machine(tmp_path)
    hal.play(np.random.default_rng(1).normal(0, 0.005, 60 * RATE_HZ), 1)
    file, out = write_experiment(tmp_path, measure="lead_s = 3.0\nsilence_s = 20.0"), tmp_path / "out"
    text = file.read_text()
    assert "w [N m]" in text
    file.write_text(text.replace('"w [N m]"', '"w [%]"').replace("[source]", '[source]\nunits = { w = "2 N m" }'))
    done = livebode("measure", file, "--out", out)
    assert done.code == 0, done.err
    log = open_log(out / "log.csv")
    assert log.channels[1] == Channel("w", "N m")
    blocks = [(block["w"], block["u"]) for block in log.blocks(["w", "u"])]
    w, u = (np.concatenate(parts) for parts in zip(*blocks))
    assert np.max(np.abs(w)) == pytest.approx(json.loads((out / "design.json").read_text())["peak_n_m"], rel=1e-3)
    # At the highest line the loop does not respond any more, so that the torque is what the controller played.
    mean = RunRecord.open(out / "run")
    source = tomllib.loads((out / "axis.toml").read_text())["source"]
    first, last = (int(source[key].split()[0]) for key in ("from", "to"))
    window = mean.lines.window
    periods = (last - first) // window
    spectra = [np.fft.rfft(x[first : first + periods * window])[periods * mean.lines.bins[-1]] for x in (w, u)]
    expected = sensitivity(mean.lines.frequency_hz[-1:])[0] / 2
    assert spectra[1] / spectra[0] == pytest.approx(expected, rel=0.1)
