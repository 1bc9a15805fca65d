"""Recordings whose rates and names differ only by a clock and by the name of the file: one recipe for every command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import given
from hypothesis import strategies as st

from livebode.core import Lines
from livebode.core.lines import CLOCK_ERROR
from livebode.records import RunRecord
from tests.support.command import LINES, Result, livebode, signals, write_csv

ROLES = ("--input", "u", "--output", "y", "--estimator", "direct", "--lines", "auto", "--window", 100)


def recorded(folder: Path, name: str, seed: int, rate_hz: float) -> Path:
    """The plant of `signals` at this rate, with stamps that jitter by a tenth of a microsecond."""
    given_ = signals(samples=6000, seed=seed)
    jitter_s = 1e-7 * np.random.default_rng(seed).standard_normal(6000)
    return write_csv(folder / name, given_ | {"t": np.arange(6000) / rate_hz + jitter_s})


def passes(*arguments: object) -> Result:
    result = livebode(*arguments)
    assert result.code == 0, result.err
    return result


@pytest.mark.parametrize("apart", [1e-8, CLOCK_ERROR / 1.01])
def test_rates_that_differ_by_a_clock_are_one_rate_for_every_command(apart: float, tmp_path: Path) -> None:
    logs = [recorded(tmp_path, f"log{k}.csv", k, 1000.1 * (1 + k * apart)) for k in (0, 1)]
    runs = [tmp_path / f"run{k}" for k in (0, 1)]
    for log, run in zip(logs, runs):
        passes("run", log, *ROLES, "--out", run)
    together = passes("run", *logs, *ROLES, "--average", "--out", tmp_path / "both")
    assert "mean of 2 recordings" in together.out
    truth = 2 * np.exp(-2j * np.pi * LINES.frequency_hz / 1000)
    found = RunRecord.open(tmp_path / "both").responses().value[-1]
    assert np.abs(found / truth - 1).max() < 0.01
    compared = json.loads(passes("compare", *runs, "--json").out)
    assert len(compared["lines"]) == 3
    passes("learn", *runs, "--out", tmp_path / "base.json")
    passes("run", logs[1], *ROLES, "--baseline", tmp_path / "base.json", "--out", tmp_path / "judged")
    livebode("fit", runs[0], "--model", "rational", "--order", "1")
    for on in (logs[1], runs[1]):
        validated = livebode("validate", runs[0], "--on", on, "--model", "rational")
        assert "rate" not in validated.err, validated.err
    assert "rates differ" not in passes("compare", *runs).out


def test_rates_that_differ_by_more_than_clocks_are_refused(tmp_path: Path) -> None:
    logs = [recorded(tmp_path, f"log{k}.csv", k, 1000.1 * (1 + k * 1e-2)) for k in (0, 1)]
    refused = livebode("run", *logs, *ROLES, "--out", tmp_path / "run")
    assert (refused.code, "differs from" in refused.err, "in its rate" in refused.err) == (2, True, True)


@given(st.integers(1, 5000), st.floats(-1e-5, 1e-5), st.floats(1e-3, 1e6))
def test_lines_are_alike_exactly_up_to_the_stated_limits(highest: int, apart: float, rate_hz: float) -> None:
    window = 2 * highest + 2
    one, other = (Lines((highest,), window, rate_hz * (1 + each)) for each in (0.0, apart))
    assert one.alike(other) == other.alike(one) == (abs(apart) * highest <= 0.25 or abs(apart) * highest < 1e-3)
    assert not one.alike(Lines((highest,), window + 1, rate_hz))


def dspace(folder: Path, name: str, seed: int) -> Path:
    """A file of ControlDesk: its variable has the name of the file, and its signals have none."""
    given_ = signals(samples=6000, seed=seed)
    y = np.zeros((1, 2), dtype=[("Data", object)])
    y[0, 0], y[0, 1] = (given_["u"][np.newaxis],), (given_["y"][np.newaxis],)
    x = np.zeros((1, 1), dtype=[("Data", object)])
    x[0, 0] = (given_["t"][np.newaxis],)
    record = np.zeros((1, 1), dtype=[("X", object), ("Y", object)])
    record[0, 0] = (x, y)
    scipy.io.savemat(folder / f"{name}.mat", {name: record})
    return folder / f"{name}.mat"


def text(folder: Path, name: str, seed: int) -> Path:
    given_ = signals(samples=6000, seed=seed)
    columns = {"t": given_["t"], f"{name}.Y(1).Data": given_["u"], f"{name}.Y(2).Data": given_["y"]}
    return write_csv(folder / f"{name}.csv", columns)


@pytest.mark.parametrize("write", [dspace, text])
def test_names_with_the_name_of_the_file_in_them_are_matched_without_it(write: object, tmp_path: Path) -> None:
    logs = [write(tmp_path, f"meas{k}", k) for k in (1, 2)]  # type: ignore[operator]
    for k, name in ((1, "meas1.Y({}).Data"), (2, "meas2.Y({}).Data"), (0, "meas1.Y({}).Data")):
        roles = ("--input", name.format(1), "--output", f"-`{name.format(2)}`", *ROLES[4:])
        passes("run", *(logs[k - 1 : k] or logs), *roles, "--out", tmp_path / f"run{k}")
    assert RunRecord.open(tmp_path / "run0").summary["configuration"]["signals"]["output"] == "-`Y(2).Data`"
    runs = [tmp_path / "run1", tmp_path / "run2"]
    passes("compare", *runs)
    passes("learn", *runs, "--out", tmp_path / "base.json")
    roles = ("--input", "meas2.Y(1).Data", "--output", "-`meas2.Y(2).Data`", *ROLES[4:])
    passes("run", logs[1], *roles, "--baseline", tmp_path / "base.json", "--out", tmp_path / "judged")
    validated = livebode("validate", runs[0], "--on", logs[1], "--model", "rational")
    assert "no channel" not in validated.err


def test_a_name_that_means_another_channel_without_that_of_the_file_is_kept(tmp_path: Path) -> None:
    given_ = signals()
    columns = {"t": given_["t"], "u": given_["u"], "log.u": given_["w"], "y": given_["y"]}
    write_csv(tmp_path / "log.csv", columns)
    passes("run", tmp_path / "log.csv", "--input", "log.u", *ROLES[2:], "--out", tmp_path / "run")
    assert RunRecord.open(tmp_path / "run").summary["configuration"]["signals"]["input"] == "log.u"
