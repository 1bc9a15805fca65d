"""`livebode run` and `livebode inspect` end to end: what they leave and print is what was measured."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from livebode.core import Block
from livebode.estimation import Settings, Tracker
from tests.support.command import LINES, RATE_HZ, livebode, signals, write_csv, write_parquet
from tests.support.responses import as_recorded

JOINT = ("--excitation", "w", "--input", "u", "--output", "y")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return write_parquet(tmp_path / "log.parquet", signals())


def test_the_run_directory_holds_what_the_tracker_gives(log: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    lines = ("--lines", "50,100,200", "--window", 100)
    result = livebode("run", log, *JOINT, "--schedule", "t", *lines, "--hop", 7, "--out", out)
    assert (result.code, result.err) == (0, "")
    assert sorted(p.name for p in out.iterdir()) == [
        "bode.svg", "events.jsonl", "manifest.jsonl", "responses.parquet", "run-copy.json", "run.json", "tracking.svg",
    ]  # fmt: skip
    columns = signals()
    block = Block(np.array([columns[n] for n in "wuyt"]), tuple("wuyt"), RATE_HZ)
    settings = Settings(lines=LINES, output="y", input="u", excitation="w", schedule="t", hop=7)
    expected = as_recorded(Tracker(settings).process(block))
    table = pq.read_table(out / "responses.parquet").to_pydict()
    shape = expected.value.shape
    for name, values in {
        "re": expected.value.real, "im": expected.value.imag, "sigma": expected.sigma, "coherence": expected.coherence,
        "valid": expected.valid,
    }.items():  # fmt: skip
        assert np.array_equal(np.reshape(table[name], shape), values, equal_nan=name != "valid"), name
    for name in ("sample", "time_s", "schedule", "dof"):
        column = np.reshape(table[name], shape)
        assert np.array_equal(column, np.tile(getattr(expected, name), (3, 1)).T, equal_nan=True), name
    assert np.array_equal(np.reshape(table["frequency_hz"], shape), np.tile(LINES.frequency_hz, (shape[0], 1)))
    assert np.isnan(table["re"][0])
    assert np.isnan(table["im"][0])
    assert np.median(np.abs(expected.value[-1])) == pytest.approx(2, abs=0.01)


def test_the_summary_counts_and_names_what_was_done(log: Path, tmp_path: Path) -> None:
    result = livebode("run", log, *JOINT, "--lines", "50,100,200", "--window", 100, "--out", tmp_path / "run", "--json")
    summary = json.loads(result.out)
    stored = json.loads((tmp_path / "run" / "run.json").read_text())
    assert {k: v for k, v in summary.items() if k != "directory"} == {
        k: v for k, v in stored.items() if k not in ("format", "version", "size_bytes", "crc32")
    }
    assert stored["counts"]["samples"] == 2000
    assert stored["counts"]["responses"] == 2000 // stored["found"]["hop"]
    assert stored["counts"]["invalid_responses"] == 100 // stored["found"]["hop"] - 1
    assert stored["configuration"]["lines"] == {"frequencies": "50,100,200", "window": 100}
    assert set(stored["versions"]) == {"livebode", "numpy", "python", "instruction_set", "states"}
    assert stored["found"]["frequency_hz"] == [50, 100, 200]


def test_lines_and_window_are_found(log: Path, tmp_path: Path) -> None:
    found = json.loads(livebode("run", log, *JOINT, "--out", tmp_path / "run", "--json").out)["found"]
    # 50, 100 and 200 Hz repeat every 20 samples.
    assert (found["window"], found["frequency_hz"]) == (20, [50, 100, 200])
    longer = livebode("run", log, *JOINT, "--window", 60, "--out", tmp_path / "longer", "--json").out
    assert json.loads(longer)["found"]["frequency_hz"] == [50, 100, 200]


@pytest.mark.usefixtures("log")
def test_options_override_the_configuration_file(tmp_path: Path) -> None:
    axis = tmp_path / "axis.toml"
    axis.write_text(
        """
        [source]
        log = "log.parquet"
        [signals]
        output = "y"
        excitation = "w"
        [lines]
        frequencies = "50,100,200"
        window = 100
        [tracking]
        estimator = "indirect"
        hop = 50
        [loop]
        velocity = { gain = 1e-9, integral_time_s = 1.0, rate_hz = 1000 }
        """
    )
    first = json.loads(livebode("run", axis, "--out", tmp_path / "a", "--json").out)
    assert first["counts"]["responses"] == 40
    second = json.loads(livebode("run", axis, "--hop", 25, "--out", tmp_path / "b", "--json").out)
    assert second["counts"]["responses"] == 80
    assert second["configuration"]["tracking"]["estimator"] == "indirect"
    values = pq.read_table(tmp_path / "a" / "responses.parquet").to_pydict()
    assert np.hypot(values["re"][-1], values["im"][-1]) == pytest.approx(2, rel=0.02)


def test_the_same_signals_from_csv_and_parquet_give_the_same_run(log: Path, tmp_path: Path) -> None:
    other = write_csv(tmp_path / "log.csv", signals())
    for path, out in ((log, "a"), (other, "b")):
        assert livebode("run", path, *JOINT, "--lines", "50,100", "--window", 100, "--out", tmp_path / out).code == 0
    a, b = (pq.read_table(tmp_path / out / "responses.parquet").to_pydict() for out in ("a", "b"))
    for name, values in a.items():
        assert np.array_equal(np.array(values, dtype=float), np.array(b[name], dtype=float), equal_nan=True), name


def test_gaps_and_samples_that_are_not_finite_are_counted_and_invalid(tmp_path: Path) -> None:
    columns = signals()
    columns["y"][700] = np.nan
    kept = {name: np.delete(values, slice(1200, 1230)) for name, values in columns.items()}
    log = write_parquet(tmp_path / "log.parquet", kept)
    out = tmp_path / "run"
    result = livebode("run", log, *JOINT, "--lines", "50,100,200", "--window", 100, "--hop", 1, "--out", out, "--json")
    counts = json.loads(result.out)["counts"]
    assert (counts["gaps"], counts["missing"], counts["non-finite"]) == (1, 30, 1)
    table = pq.read_table(tmp_path / "run" / "responses.parquet").to_pydict()
    valid = np.reshape(table["valid"], (-1, 3)).all(axis=1)
    sample = np.reshape(table["sample"], (-1, 3))[:, 0]
    whole = (sample >= 99) & ((sample < 700) | (sample >= 800)) & ((sample < 1200) | (sample >= 1230 + 99))
    assert np.array_equal(valid, whole)
    events = [json.loads(line) for line in (tmp_path / "run" / "events.jsonl").read_text().splitlines()]
    assert [(e["kind"], e["sample"]) for e in events] == [("non-finite", 700), ("gap", 1230)]
    inspected = json.loads(livebode("inspect", log, "--json").out)
    assert (inspected["gaps"], inspected["missing_samples"]) == (1, 30)
    assert {c["name"]: c["not_finite"] for c in inspected["channels"]} == {"t": 0, "w": 0, "u": 0, "y": 1}


def test_inspect_describes_the_excitation(log: Path) -> None:
    found = json.loads(livebode("inspect", log, "--excitation", "w", "--output", "y", "--json").out)
    assert (found["samples"], found["rate_hz"], found["duration_s"]) == (2000, 1000, 2)
    excitation = found["excitation"]
    assert (excitation["period"], excitation["frequency_hz"]) == (20, [50, 100, 200])
    period = signals()["w"][:20]
    assert excitation["crest_factor"] == pytest.approx(np.max(np.abs(period)) / np.sqrt(np.mean(period**2)), rel=1e-6)
    # Amplitude 2 at the output against noise 0.01·√(1 + 2²) rms: 10·log10(2²/2 / (2σ²/20)).
    assert excitation["snr_db"] == pytest.approx([10 * np.log10(2 / (2 * 5e-4 / 20))] * 3, abs=2)
    text = livebode("inspect", log, "--excitation", "w", "--output", "y").out
    of_recordings = "a run has by default 200 (hop 5) responses per second, of a machine that moves 1000 (hop 1)"
    assert f"{of_recordings}, a live run 50 (hop 20)" in text
    assert "repeats every 20 samples" in text


def test_the_installed_command_prints_a_plot_and_ends_with_0(log: Path, tmp_path: Path) -> None:
    command = [str(Path(sys.executable).with_name("livebode")), "run", str(log), *JOINT, "--out", str(tmp_path / "run")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "magnitude in dB" in done.stdout
    assert "3 lines" in done.stdout


def test_a_run_without_channels_states_the_roles_in_a_line_and_is_the_run_that_names_them(
    log: Path, tmp_path: Path
) -> None:
    proposed = livebode("run", log, "--out", tmp_path / "proposed")
    assert (proposed.code, proposed.err.count("\n")) == (0, 1), proposed.err
    assert "roles: excitation w (repeats every 20 samples (0.02 s)), input u (by its name), output y" in proposed.err
    assert livebode("run", log, *JOINT, "--out", tmp_path / "named").code == 0
    one, other = (pq.read_table(tmp_path / name / "responses.parquet") for name in ("proposed", "named"))
    assert all(np.array_equal(one[column], other[column], equal_nan=True) for column in ("re", "im", "sigma"))
    assert livebode("run", log, "--estimator", "lpm", "--out", tmp_path / "lpm").code == 0
    stored = json.loads((tmp_path / "lpm" / "run.json").read_text())
    assert stored["configuration"]["tracking"]["estimator"] == "lpm"


def test_a_run_of_noise_without_names_takes_the_estimator_for_it(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    u = rng.standard_normal(40000)
    y = np.convolve(u, 0.9 ** np.arange(80))[: u.size] + 0.01 * rng.standard_normal(u.size)
    write_parquet(tmp_path / "noise.parquet", {"t": np.arange(u.size) / RATE_HZ, "p": y, "q": u})
    result = livebode("run", tmp_path / "noise.parquet", "--out", tmp_path / "run")
    assert "input q (the other channels respond to it), output p (responds to q)" in result.err
    stored = json.loads((tmp_path / "run" / "run.json").read_text())
    assert stored["configuration"]["tracking"]["estimator"] == "lpm"
    table = pq.read_table(tmp_path / "run" / "responses.parquet").to_pydict()
    z = np.exp(-2j * np.pi * np.array(table["frequency_hz"]) / RATE_HZ)
    value = np.array(table["re"]) + 1j * np.array(table["im"])
    known = np.array(table["valid"])
    assert np.median(np.abs(value * (1 - 0.9 * z) - 1)[known]) < 0.01
