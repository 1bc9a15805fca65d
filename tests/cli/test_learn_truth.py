"""`livebode learn` and `livebode run --baseline` on recordings whose truth is known, as a person uses them."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from livebode.core import BaselineError, Block, Channel, Lines
from livebode.excitation import multisine
from livebode.monitoring import Baseline
from livebode.simulation import BeltAxis, Sensor, SimulatedAxis, TensionLoss
from livebode.sources.live import Batch, encode_line
from tests.support.baselines import with_checksum
from tests.support.command import Result, livebode, write_parquet
from tests.support.errors import refused
from tests.support.forked import Command
from tests.support.monitored import recorded, small_baseline
from tests.support.peers.peer import PATIENCE_S

SIGNALS = ["--excitation", "w", "--input", "u", "--output", "velocity"]
OPTIONS = [*SIGNALS, "--lines", "20:140:20", "--window", "400", "--noise", "quiet"]
MOVING = [*OPTIONS, "--schedule", "x"]


@cache
def healthy() -> Block:
    return recorded((0.3, 0.25, 0.3, 0.2, 0.3, 0.15), seed=60)


def write(path: Path, block: Block) -> Path:
    columns = {"t": np.arange(len(block)) / block.rate_hz} | {name: block[name] for name in block.names}
    return write_parquet(path, columns)


def run(log: Path, out: Path, *options: object) -> Result:
    return livebode("run", log, *options, "--out", out)


def events(directory: Path) -> list[dict[str, object]]:
    return [json.loads(line) for line in (directory / "events.jsonl").read_text("utf-8").splitlines()]


def test_a_learned_baseline_reports_a_fault_in_a_later_run(tmp_path: Path) -> None:
    log, faulty = write(tmp_path / "healthy.parquet", healthy()), tmp_path / "faulty.parquet"
    write(faulty, recorded((0.3, 0.25), TensionLoss(start_s=6.0, loss=0.02), seed=61))
    without = run(log, tmp_path / "one", *MOVING)
    assert "Without a baseline no change can be detected" in without.out
    assert json.loads((tmp_path / "one" / "run.json").read_text("utf-8"))["monitoring"]["baseline"] is None

    learned = livebode("learn", tmp_path / "one", "--out", tmp_path / "healthy.json")
    assert learned.code == 0, learned.err
    assert "Smallest changes that it detects: stiffness 0.5 %" in learned.out

    found = run(faulty, tmp_path / "two", *MOVING, "--baseline", tmp_path / "healthy.json")
    assert found.code == 0, found.err
    assert "the belt's stiffness is 2" in found.out or "the belt's stiffness is 1.9" in found.out
    monitoring = json.loads((tmp_path / "two" / "run.json").read_text("utf-8"))["monitoring"]
    assert [s["what"] for s in monitoring["standing"]] == ["stiffness"]
    assert [e["kind"] for e in events(tmp_path / "two")] == ["change", "noise-from-detection-lines"]

    again = run(
        log, tmp_path / "three", *MOVING, "--baseline", tmp_path / "healthy.json", "--false-alarm-interval", "1"
    )
    assert "No change against the baseline" in again.out
    _refusals(tmp_path, log)


def standing(path: Path, seed: int, *faults: TensionLoss) -> Path:
    """A configuration beside the recording of an axis that stands, with a fit and no schedule."""
    lines = Lines.parse("20:140:20", rate_hz=4000, window=400)
    axis = BeltAxis(
        excitation_n_m=multisine(lines), sensor=Sensor(noise_rad_per_s=0.1), faults=faults, seconds=24, run_in_s=5,
        seed=seed,
    )  # fmt: skip
    block, _ = SimulatedAxis(axis).run()
    write(path, block.cut(0, len(block)))
    signals = 'excitation = "w"\ninput = "u"\noutput = "velocity"'
    text = f'[source]\nlog = "{path.name}"\n[signals]\n{signals}\n[lines]\nfrequencies = "20:140:20"\nwindow = 400\n'
    toml = path.with_suffix(".toml")
    toml.write_text(text + '[tracking]\nhop = 100\nnoise = "quiet"\n[fit]\nmodel = "two-mass"\nradius_m = 0.019\n')
    return toml


def test_changes_of_fitted_parameters_are_learned_and_reported(tmp_path: Path) -> None:
    healthy_run, changed_run, base = tmp_path / "one", tmp_path / "two", tmp_path / "healthy.json"
    assert livebode("run", standing(tmp_path / "a.parquet", 1), "--out", healthy_run).code == 0
    learned = livebode("learn", healthy_run, "--out", base)
    assert learned.code == 0, learned.err
    assert [table.what for table in Baseline.load(base).tables] == ["lines", "parameters"]
    loss = TensionLoss(start_s=12.0, loss=0.05)
    toml = standing(tmp_path / "b.parquet", 2, loss)
    assert livebode("run", toml, "--baseline", base, "--out", changed_run).code == 0
    reported = {e["details"]["what"]: e for e in events(changed_run) if e["kind"] == "change"}
    assert set(reported) == {"lines", "parameters"}
    changes = {c["name"]: c["amount"] for c in reported["parameters"]["details"]["changes"]}
    assert changes == {"Keff": pytest.approx(-5, abs=0.5)}
    assert reported["parameters"]["details"]["since_s"] == pytest.approx(12, abs=1)
    assert "Learned from" in learned.out
    assert "in 1 cell of the schedule. No model" in learned.out
    live = changes_live(toml, base, tmp_path / "live")
    reported_changes = [event for event in events(changed_run) if str(event["kind"]).startswith("change")]
    # The sentences differ: those of a live run may name the time of day.
    assert [(e["kind"], e["sample"], e["details"]) for e in live] == [
        (e["kind"], e["sample"], e["details"]) for e in reported_changes
    ]
    assert "Lines and fitted parameters are monitored" in learned.out
    _not_fitted(toml, base, tmp_path)


def changes_live(toml: Path, base: Path, out: Path) -> list[dict[str, object]]:
    """The changes that a machine on standard input is told to have, which sends what is in the recording."""
    columns = pq.read_table(toml.with_suffix(".parquet"))
    data = np.array([columns[name].to_numpy() for name in ("w", "u", "velocity")])
    channels = (Channel("w"), Channel("u"), Channel("velocity"))
    lines = [
        encode_line(Batch(start, data[:, start : start + 1000].copy(), channels, 4000.0))
        for start in range(0, data.shape[1], 1000)
    ]
    axis = toml.with_name("live.toml")
    text = toml.read_text().replace(f'log = "{toml.stem}.parquet"', 'url = "stdin:"')
    axis.write_text(text)
    with Command("run", axis, "--baseline", base, "--out", out) as process:
        _, err = process.communicate(b"".join(lines), PATIENCE_S)
        assert process.returncode == 0, err
    return [event for event in events(out) if str(event["kind"]).startswith("change")]


def _not_fitted(toml: Path, base: Path, tmp_path: Path) -> None:
    """Without [fit] the parameters' table is not judged, which is said once."""
    toml.write_text(toml.read_text("utf-8").split("[fit]")[0], encoding="utf-8")
    blind = livebode("run", toml, "--baseline", base, "--out", tmp_path / "three")
    assert blind.code == 0, blind.err
    assert blind.out.count("parameters are not judged: the run has no [fit]") == 1
    alone = livebode("run", toml, "--false-alarm-interval", "365", "--average", "--out", tmp_path / "four")
    assert "false_alarm_interval_days = 365 has no effect without one" in alone.out
    averaged = livebode("learn", tmp_path / "four", "--out", tmp_path / "x.json")
    assert (averaged.code, "was created with tracking.average" in averaged.err) == (2, True)


def _refusals(tmp_path: Path, log: Path) -> None:
    base = tmp_path / "healthy.json"
    other = run(log, tmp_path / "four", *MOVING[:-2], "--baseline", base)
    assert (other.code, "schedule x" in other.err) == (2, True)
    assert not (tmp_path / "four").exists()
    never = run(log, tmp_path / "four", *MOVING, "--baseline", base, "--false-alarm-interval", "0")
    assert (never.code, "--false-alarm-interval" in never.err) == (2, True)
    twice = livebode("learn", tmp_path / "one", "--out", base)
    assert (twice.code, "--force" in twice.err) == (2, True)
    same = livebode("learn", tmp_path / "one", f"{tmp_path / 'one'}/.", "--out", tmp_path / "x.json")
    assert (same.code, "give each recording once" in same.err) == (2, True)
    also = livebode("learn", tmp_path / "one", tmp_path / "three", "--out", tmp_path / "x.json")
    assert (also.code, "give each recording once" in also.err) == (2, True)
    none = livebode("learn", tmp_path, "--out", tmp_path / "x.json")
    assert (none.code, "not the directory of a run" in none.err) == (2, True)


def test_without_a_schedule_the_lines_are_watched_alone(tmp_path: Path) -> None:
    still = recorded((0.3, 0.3), seed=62)
    assert run(write(tmp_path / "a.parquet", still), tmp_path / "one", *OPTIONS).code == 0
    learned = livebode("learn", tmp_path / "one", "--out", tmp_path / "base.json", "--json")
    assert json.loads(learned.out)["model"] is None
    assert "scheduling position" in json.loads(learned.out)["remark"]
    baseline = Baseline.load(tmp_path / "base.json")
    assert baseline.tables[0].count.tolist() == [[0, baseline.tables[0].count.sum(), 0]]


def test_axis_toml_names_the_baseline(tmp_path: Path) -> None:
    write(tmp_path / "a.parquet", recorded((0.3, 0.3), seed=63))
    assert run(tmp_path / "a.parquet", tmp_path / "one", *OPTIONS).code == 0
    assert livebode("learn", tmp_path / "one", "--out", tmp_path / "base.json").code == 0
    (tmp_path / "axis.toml").write_text(
        '[source]\nlog = "a.parquet"\n[signals]\noutput = "velocity"\ninput = "u"\nexcitation = "w"\n'
        '[lines]\nfrequencies = "20:140:20"\nwindow = 400\n[tracking]\nnoise = "quiet"\n'
        '[monitoring]\nbaseline = "base.json"\nfalse_alarm_interval_days = 7\n',
        encoding="utf-8",
    )
    assert livebode("run", tmp_path / "axis.toml", "--out", tmp_path / "two").code == 0
    monitoring = json.loads((tmp_path / "two" / "run.json").read_text("utf-8"))["monitoring"]
    assert (monitoring["false_alarm_interval_days"], monitoring["judged_by"]) == (7.0, "tables")


def test_a_file_that_is_no_baseline_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    for text, code, facts in (
        ("{", "not-a-baseline", {}),
        ("[]", "not-a-baseline", {}),
        ('{"format": "livebode baseline", "version": 99}', "newer-version", {"found": 99, "readable": 5}),
        ('{"format": "livebode baseline", "version": 4}', "version", {"version": 4}),
        ('{"format": "livebode baseline", "version": 5}', "damaged", {"key": "crc32"}),
    ):
        path.write_text(text, encoding="utf-8")
        with refused(BaselineError, code, path=str(path), **facts):
            Baseline.load(path)
    with refused(BaselineError, "absent", path=str(tmp_path / "missing.json")):
        Baseline.load(tmp_path / "missing.json")


@pytest.mark.parametrize(
    ("at", "value", "words"),
    [
        ("machine.inertia_kg_m2", -1, "machine.inertia_kg_m2 = -1 is not above 0"),
        ("machine.load_kg", None, "machine.load_kg is missing"),
        ("machine.held.smallest", "x", "machine.held.smallest = 'x' is not an array of numbers"),
        ("lines.rate_hz", "fast", "lines.rate_hz = 'fast' is not a number"),
        ("estimator", None, "estimator is missing"),
        ("tables", [], "tables = [] is empty"),
        ("hop", 0, "hop = 0 is below 1"),
        ("signals", 3, "signals = 3 is not a table"),
        ("machine.covariates.high", [15.0], "machine.covariates.high = [15.0] is not above low"),
        ("machine.covariates.slope", [[1.0]], "machine.covariates.slope = [[1.0]] is not an array of shape (4, 1)"),
        (
            "machine.between.direction",
            [0, 0],
            "machine.between.direction = [0, 0] is not 4 numbers of which one is not 0",
        ),
    ],
)
def test_a_damaged_part_is_named(tmp_path: Path, at: str, value: object, words: str) -> None:
    """One sentence with the file, the key, the value and the remedy."""
    path = tmp_path / "x.json"
    small_baseline().save(path)
    whole = Baseline.load(path).machine
    assert whole is not None
    assert whole.covariates.slope.tolist() == [[-0.002], [0.0], [0.0], [0.0]]
    assert whole.between is not None
    assert whole.between.spread == 1.5
    data = json.loads(path.read_text("utf-8"))
    *above, name = at.split(".")
    part = data
    for key in above:
        part = part[key]
    part.pop(name)
    if value is not None:
        part[name] = value
    del data["crc32"]  # which would name the change alone
    path.write_bytes(with_checksum(data))
    with pytest.raises(BaselineError) as found:
        Baseline.load(path)
    assert (found.value.code, found.value.key) == ("baseline.damaged", at)
    assert str(found.value) == f"the baseline {str(path)!r} is damaged: {words}; learn it again"
