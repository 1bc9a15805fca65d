"""Several axes in one file: each as if it were alone, and none ended by another."""

from __future__ import annotations

import json
import signal
import socket
from pathlib import Path

import numpy as np
import pytest

from livebode.configuration import axes_of
from livebode.core import ConfigError, Lines
from livebode.estimation import Settings, Tracker
from livebode.records import RunRecord
from tests.support.command import livebode, signals, write_parquet
from tests.support.peers.machine import Machine
from tests.support.peers.peer import free_port
from tests.support.peers.plain import wait_read
from tests.support.recorded import same
from tests.support.session_process import SHARED, Running, block, check_samples, events, numbers, source, summary_of

LINES = Lines.parse("50,100,200", 1000.0, 100)
SETTINGS = Settings(lines=LINES, output="y", input="u", excitation="w", schedule="n", hop=20)


def two(a: Machine, b: Machine) -> str:
    return f"{SHARED}[axes.x]\n{source(a)}[axes.y]\n{source(b)}lines.window = 200\n"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_each_axis_leaves_what_it_would_have_left_alone(tmp_path: Path, number: int) -> None:
    with (
        Machine(tmp_path) as a,
        Machine(tmp_path, times=1.0) as b,
        Running(tmp_path, two(a, b)) as running,
    ):
        running.tracked("x", 2500)
        running.tracked("y", 500)
        for machine in (a, b):
            machine.silence()
            wait_read(machine.settings["url"])
        code, out, err = running.end(number)
        sent = {"x": a.sent, "y": b.sent}
    assert (code, err) == (0, "")
    summaries = json.loads(out)["axes"]
    for name, samples in sent.items():
        run = RunRecord.open(running.out / name)
        check_samples([run.path], samples)
        assert run.lines.window == {"x": 100, "y": 200}[name]
        assert summaries[name]["counts"]["samples"] == samples
        assert (run.path / "bode.svg").stat().st_size > 3_000
        assert not {e.kind for e in run.events()} - {"connected", "noise-from-detection-lines"}
    assert same(RunRecord.open(running.out / "x").responses(), Tracker(SETTINGS).process(block(sent["x"])))


def test_an_axis_that_fails_does_not_end_the_others(tmp_path: Path) -> None:
    with Machine(tmp_path) as a, Machine(tmp_path) as b:
        text = f"{SHARED}[axes.x]\n{source(a)}[axes.odd]\n{source(b)}signals.output = 'yy'\n"
        with Running(tmp_path, text) as running:
            running.tracked("x", 1500)
            code, out, err = running.end()
    assert code == 2
    found = json.loads(out)["axes"]
    assert "did you mean 'y'" in found["odd"]["error"]["remedy"]
    assert found["x"]["counts"]["samples"] >= 1500
    assert [line.split(":")[1] for line in err.splitlines()] == [" odd"]


def test_a_machine_that_is_switched_on_late_is_picked_up(tmp_path: Path) -> None:
    """Behind the time-out, beside an axis that was there from the beginning."""
    late = Machine(tmp_path)
    with Machine(tmp_path) as a:
        late.port = free_port(socket.SOCK_STREAM)
        url = f'source.url = "tcp://127.0.0.1:{late.port}"\nsource.timeout_s = 0.2\n'
        with Running(tmp_path, f"{SHARED}[axes.x]\n{source(a)}[axes.late]\n{url}") as running:
            running.tracked("x", 1500)
            with late:
                running.tracked("late", 500)
                code, out, err = running.end()
    assert code == 0
    assert json.loads(out)["axes"]["late"]["counts"]["samples"] >= 500
    assert err.count("no samples arrived within 0.2 s") == 1
    assert "livebode: late: tcp://127.0.0.1" in err
    assert "switch the machine on" in err


def test_an_axis_that_is_still_waited_for_is_ended_at_once(tmp_path: Path) -> None:
    with Machine(tmp_path) as a:
        url = 'source.url = "tcp://127.0.0.1:1"\nsource.timeout_s = 0.2\n'
        with Running(tmp_path, f"{SHARED}[axes.x]\n{source(a)}[axes.gone]\n{url}") as running:
            running.tracked("x", 1500)
            code, out, err = running.end()
    assert (code, "Traceback" in err) == (0, False)
    assert json.loads(out)["axes"]["x"]["counts"]["samples"] >= 1500
    assert not (tmp_path / "run" / "gone").exists()


def test_a_second_signal_retains_the_record_and_the_same_command_continues_it(tmp_path: Path) -> None:
    with Machine(tmp_path) as a, Machine(tmp_path) as b:
        text = two(a, b)
        with Running(tmp_path, text) as running:
            running.tracked("x", 1500)
            running.tracked("y", 500)
            running.process.send_signal(signal.SIGINT)
            code, _, err = running.end()
        assert code in (130, 0)  # 0 where it had ended before the second one came
        assert "Traceback" not in err
        held = {name: numbers(running.out / name).size for name in "xy"}
        with Running(tmp_path, text) as running:
            for name in "xy":
                running.tracked(name, held[name] + 200)
            assert running.end()[0] == 0
    for name in "xy":
        number = numbers(running.out / name)
        assert np.array_equal(number[: held[name]], np.arange(held[name]))
        assert np.count_nonzero(np.diff(number) != 1) == 1


def test_each_of_two_recordings_has_the_run_that_it_has_alone(tmp_path: Path) -> None:
    write_parquet(tmp_path / "a.parquet", signals())
    write_parquet(tmp_path / "b.parquet", signals(seed=1))
    (tmp_path / "axes.toml").write_text(
        '[signals]\nexcitation = "w"\ninput = "u"\noutput = "y"\n[lines]\nfrequencies = "50,100,200"\nwindow = 100\n'
        '[axes.a]\nsource.log = "a.parquet"\n[axes.b]\nsource.log = "b.parquet"\ntracking.hop = 50\n'
        '[axes.c]\nsource.log = "c.parquet"\n'
    )
    result = livebode("run", tmp_path / "axes.toml", "--out", tmp_path / "runs")
    assert result.code == 2
    assert "livebode: c: there is no file" in result.err
    assert "a: 80 responses at 3 lines" in result.out
    assert "b: 40 responses at 3 lines" in result.out
    for name, hop in (("a", 25), ("b", 50)):
        alone = livebode(
            "run", tmp_path / f"{name}.parquet", "--excitation", "w", "--input", "u", "--output", "y", "--lines",
            "50,100,200", "--window", 100, "--hop", hop, "--out", tmp_path / f"{name}-alone",
        )  # fmt: skip
        assert alone.code == 0
        assert same(
            RunRecord.open(tmp_path / "runs" / name).responses(), RunRecord.open(tmp_path / f"{name}-alone").responses()
        )
    assert not (tmp_path / "runs" / "c").exists()


@pytest.mark.parametrize(
    ("axes", "code", "facts", "place"),
    [
        ("axes = 3", "axes-invalid", {"key": "axes"}, ""),
        ("[axes]", "axes-invalid", {"key": "axes"}, ""),
        ('[axes."../x"]\nsource.url = "udp://h:1"', "axis-name-invalid", {"value": "'../x'"}, ""),
        ('[axes.x-2]\nsource.url = "udp://h:1"', "axis-name-invalid", {"value": "x-2"}, ""),
        ('[axes.x]\nsource.url = "udp://h:1"\n[axes.X]\nsource.url = "udp://h:2"', "axis-name-invalid",
         {"names": ["x", "X"]}, ""),
        ('[axes.x]\nsource.url = "udp://h:1"\nlines.windw = 3', "key-unknown", {"key": "lines.windw"}, ", axis x"),
        ("[axes.x]\nlines.window = 3", "key-missing", {"key": "source"}, ", axis x"),
    ],
)  # fmt: skip
def test_impossible_axes_are_refused(tmp_path: Path, axes: str, code: str, facts: dict, place: str) -> None:
    path = tmp_path / "axes.toml"
    with pytest.raises(ConfigError) as caught:
        axes_of(f"{axes}\n{SHARED}".encode(), path, {})
    error = caught.value
    assert (error.code, error.place) == (f"config.{code}", f"{path}{place}")
    assert facts.items() <= error.facts.items()
    assert "\n" not in str(error)


@pytest.mark.parametrize(
    ("fit", "message"),
    [
        ('fit.model = "two-masses"', "axis x: [fit]: there is no model 'two-masses'"),
        ('fit = {model = "rigid", fixed = {Jx = 1.0}}', "no parameter 'Jx'"),
    ],
)
def test_an_impossible_fit_is_refused_before_the_start(tmp_path: Path, fit: str, message: str) -> None:
    (tmp_path / "axes.toml").write_text(f'[axes.x]\nsource.url = "udp://h:1"\n{fit}\n{SHARED}')
    result = livebode("run", tmp_path / "axes.toml", "--out", tmp_path / "runs")
    assert result.code == 2
    assert message in result.err
    assert result.err.count("\n") == 1
    assert not (tmp_path / "runs").exists()


def test_events_after_a_restart_have_the_sample_numbers_of_the_record(tmp_path: Path) -> None:
    with Machine(tmp_path) as a:
        for more in (1000, 500):
            with Running(tmp_path, f"{SHARED}[axes.x]\n{source(a)}") as running:
                held = numbers(running.out / "x").size
                running.tracked("x", held + more)
                running.end()
    number = numbers(running.out / "x")
    connected = [event for event in events(running.out / "x") if event.kind == "connected"]
    assert connected[0].sample == 0
    assert connected[1].sample == held
    assert connected[1].time_s == pytest.approx(held / 1000)
    # What was sent while nobody was connected is missing, by the sender's own numbers.
    (loss,) = [event for event in events(running.out / "x") if event.kind == "loss"]
    assert (loss.sample, loss.details["missing_samples"]) == (number[held], number[held] - held)
    assert np.array_equal(np.diff(number[held:]), np.ones(number.size - held - 1))
    assert summary_of(running.out / "x")["counts"]["gaps"] == 1
