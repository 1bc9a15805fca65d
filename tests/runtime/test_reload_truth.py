"""An edit of the configuration is applied without losing a sample, or refused with the reason."""

from __future__ import annotations

import json
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa

from livebode.core import Event, Lines, Responses
from livebode.estimation import Settings, Tracker
from livebode.records import RunRecord
from tests.support.command import livebode
from tests.support.peers.machine import Machine
from tests.support.peers.peer import until
from tests.support.peers.plain import wait_read
from tests.support.recorded import same
from tests.support.session_process import SHARED, Running, block, check_samples, events, numbers, source, summary_of

LINES = Lines.parse("50,100,200", 1000.0, 100)
SETTINGS = Settings(lines=LINES, output="y", input="u", excitation="w", schedule="n", hop=20)
UNIT = "rad/s/(N m)"  # a rigid machine needs a torque: the configuration states that the machine's A are N m
FIT = '[axes.x.fit]\nmodel = "rigid"\n'


def one(machine: Machine, shared: str = SHARED) -> str:
    return f'{shared}[axes.x]\n{source(machine)}source.units = {{ u = "N m" }}\n'


def joined(runs: list[Path]) -> Responses:
    parts = [RunRecord.open(run).responses() for run in runs]
    return Responses.join(parts)


def is_new(run: Path) -> bool:
    """Whether this is a record that no other continues."""
    try:
        return "continued_in" not in summary_of(run)
    except FileNotFoundError:  # not yet written, or just removed
        return False


def test_every_sample_is_in_one_of_the_records_and_no_window_is_lost(tmp_path: Path) -> None:
    with Machine(tmp_path) as machine, Running(tmp_path, one(machine)) as running:
        runs = [running.out / name for name in ("x", "x-2", "x-3", "x-4")]
        texts = [one(machine) + FIT, one(machine), one(machine, SHARED.replace("samples = true", "samples = true\n"))]
        running.tracked("x", 700)
        running.edit(texts[0])  # by a signal
        running.tracked("x-2", 700)
        running.write(texts[1])  # by itself
        running.tracked("x-3", 700)
        running.edit(one(machine, SHARED.replace("hop = 20", "hop = 10")))
        running.tracked("x-4", 700)
        machine.silence()
        wait_read(machine.settings["url"])
        code, _, err = running.end()
        sent = machine.sent
    assert code == 0, err
    check_samples(runs, sent)
    assert [(summary_of(run).get("continues"), summary_of(run).get("continued_in")) for run in runs] == [
        (None, "x-2"), ("x", "x-3"), ("x-2", "x-4"), ("x-3", None),
    ]  # fmt: skip
    assert [summary_of(run)["record"]["finished"] for run in runs] == [True, True, True, False]
    assert sum(summary_of(run)["counts"]["samples"] for run in runs[:3]) == numbers(runs[3])[0]
    # The first three share their settings of tracking: the state went on, and it is as if nothing had been changed.
    first, same_settings = numbers(runs[3])[0], joined(runs[:3])
    truth = Tracker(SETTINGS).process(block(int(first)))
    assert same(same_settings, replace(truth, unit=UNIT))
    # The last one tracks otherwise: as a tracker that begins at its first sample.
    tracker = Tracker(Settings(**{**SETTINGS.__dict__, "hop": 10}))
    last = tracker.process(block(sent).cut(int(first), sent))
    assert same(RunRecord.open(runs[3]).responses(), replace(last, unit=UNIT))
    assert summary_of(runs[1])["fit"]["model"] == "rigid"
    assert pa.concat_tables(map(pa.table, RunRecord.open(runs[1]).tables("parameters"))).num_rows > 0
    applied = [[e for e in events(run) if e.kind == "configuration-applied"] for run in runs]
    assert [[e.details["sections"] for e in found] for found in applied] == [[["fit"]], [["fit"]], [["tracking"]], []]
    assert [found[0].sample for found in applied[:3]] == [numbers(run)[-1] + 1 for run in runs[:3]]
    for run in runs:
        assert (run / "bode.svg").stat().st_size > 3_000


def test_how_the_record_is_cut_changes_in_place(tmp_path: Path) -> None:
    with Machine(tmp_path) as machine, Running(tmp_path, one(machine)) as running:
        running.tracked("x", 500)
        running.edit(one(machine, SHARED.replace("segment_s = 2", "segment_s = 0.2\nbudget_bytes = 20000000")))
        running.reported_event("x", "configuration-applied")
        at = numbers(running.out / "x").size
        running.tracked("x", at + 2500)
        code, _, err = running.end()
    assert code == 0, err
    assert not (running.out / "x-2").exists()
    long = [s.last_sample - s.first_sample for s in RunRecord.open(running.out / "x").segments if s.table == "samples"]
    assert len(long) >= 5
    assert min(long) < 1000
    number = numbers(running.out / "x")
    assert np.array_equal(number, np.arange(number.size))


REFUSED = (
    ("hop = 20", "hop = 101", "axis x: hop=101 is not between 1 and the window"),
    ("[lines]", "[lines", "is not TOML"),
    ('output = "y"', 'output = "yy"', "did you mean 'y'"),
    ("source.url = ", "source.timeout_s = 3\nsource.url = ", "[source] cannot be changed without losing samples"),
)


def reported(run: Path) -> list[Event]:
    """The events of a run, without the rule for its noise."""
    return [event for event in events(run) if event.kind != "noise-from-detection-lines"]


def test_an_edit_that_cannot_be_applied_is_refused_once_and_the_run_continues(tmp_path: Path) -> None:
    with Machine(tmp_path) as machine, Running(tmp_path, one(machine)) as running:
        running.tracked("x", 300)
        for count, (before, after, message) in enumerate(REFUSED, 2):
            running.write(one(machine).replace(before, after))
            until(lambda count=count: len(reported(running.out / "x")) >= count, message)
            assert message in reported(running.out / "x")[-1].message
        at = numbers(running.out / "x").size
        running.tracked("x", at + 2500)  # more than a look at the file
        code, _, err = running.end()
    assert code == 0
    assert [event.kind for event in reported(running.out / "x")] == ["connected", *["configuration-refused"] * 4]
    for _, _, message in REFUSED:
        assert err.count(message) == 1
    number = numbers(running.out / "x")
    assert np.array_equal(number, np.arange(number.size))


def test_a_silent_axis_holds_up_no_edit_of_the_others(tmp_path: Path) -> None:
    silent = '[axes.z.source]\nurl = "tcp://127.0.0.1:1"\ntimeout_s = 3600\n'
    with Machine(tmp_path) as machine, Running(tmp_path, one(machine) + silent) as running:
        running.tracked("x", 300)
        running.edit(one(machine) + silent.replace("3600", "1800"))
        assert (
            "axis z: the live source has sent no samples yet"
            in running.reported_event("x", "configuration-refused").message
        )
        running.edit(one(machine) + FIT + silent)
        running.tracked("x-2", 300)
        running.edit(one(machine) + FIT)
        running.says("z: the axis was removed and ends")
        running.tracked("x-2", 1500)
        code, out, err = running.end()
    assert code == 0, err
    assert json.loads(out)["axes"]["x"]["counts"]["samples"]


def test_a_live_run_with_a_loop_is_reported(tmp_path: Path) -> None:
    loop = "[loop.velocity]\ngain = 0.01\nrate_hz = 1000\n"
    text = SHARED.replace("hop = 20", "hop = 20\naverage = true") + loop
    with Machine(tmp_path) as machine, Running(tmp_path, text + f"[axes.x]\n{source(machine)}") as running:
        running.tracked("x", 800)
        assert running.end()[0] == 0
    result = livebode("report", running.out / "x", "--appendix")
    assert result.code == 0, result.err
    page = (running.out / "x" / "report.html").read_text()
    for words in ("excitation at the plant input", "forgetting 0.8", "joint"):
        assert words in page, words


def test_axes_are_added_and_removed_during_the_run(tmp_path: Path) -> None:
    with Machine(tmp_path) as a, Machine(tmp_path) as b:
        second = f"[axes.y]\n{source(b)}"
        with Running(tmp_path, one(a), "--force") as running:
            running.tracked("x", 300)
            running.edit(one(a) + second)
            running.tracked("y", 300)
            running.edit(SHARED + second)
            until(lambda: "counts" in summary_of(running.out / "x"), "the end of the axis that was taken out")
            left = numbers(running.out / "x")
            running.tracked("y", numbers(running.out / "y").size + 500)
            running.edit(one(a) + second)
            running.tracked("x", left.size + 300)
            code, out, err = running.end()
    assert code == 0, err
    found = json.loads(out)["axes"]
    assert found.keys() == {"x", "y"}
    for name, gaps in (("x", 1), ("y", 0)):
        number = numbers(running.out / name)
        assert np.array_equal(number[: left.size], np.arange(left.size))
        assert np.count_nonzero(np.diff(number) != 1) == gaps
        assert found[name]["counts"]["samples"] == number.size


def test_the_same_command_continues_the_newest_run(tmp_path: Path) -> None:
    with Machine(tmp_path) as machine:
        with Running(tmp_path, one(machine)) as running:
            running.tracked("x", 300)
            running.edit(one(machine) + FIT)
            running.tracked("x-2", 300)
            running.end(signal.SIGKILL)
        runs = [running.out / name for name in ("x", "x-2", "x-3")]
        held = [numbers(run) for run in runs[:2]]
        with Running(tmp_path, one(machine) + FIT) as running:
            running.tracked("x-2", held[1].size + 300)
            running.edit(one(machine))
            running.tracked("x-3", 300)
            assert running.end()[0] == 0
        number = np.concatenate([numbers(run) for run in runs])
        assert np.array_equal(number[: number.size], np.unique(number))
        assert np.count_nonzero(np.diff(number) != 1) == 1  # where it was killed
        assert [summary_of(run).get("continues") for run in runs] == [None, "x", "x-2"]
        with Running(tmp_path, one(machine), "--force") as running:
            # x is removed after the others, and a look at what is being removed finds damage.
            until(lambda: not runs[1].exists() and not runs[2].exists() and is_new(runs[0]), "the new record")
            running.tracked("x", 300)
            assert running.end()[0] == 0
