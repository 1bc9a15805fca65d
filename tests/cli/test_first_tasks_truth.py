"""What a new user meets on the way from a drive's own file to a report, in the words of the tasks of the README."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.support.command import livebode, signals, write_csv
from tests.support.recordings import write_sinumerik

ROLES = ("--excitation", "M_stoer", "--input", "M_soll", "--output", "n_ist")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of a drive: two lines of text, semicolons, decimal commas, a line of units, names in German."""
    given = signals(8000)
    columns = (1e3 * given["t"], given["w"], given["u"], given["y"], 1e-3 * np.cumsum(given["y"]))
    rows = ["Antriebsrekorder V4.2", "", "Zeit;M_stoer;M_soll;n_ist;phi_ist", "ms;Nm;Nm;rad/s;rad"]
    rows += [";".join(f"{value:.9g}".replace(".", ",") for value in row) for row in zip(*columns)]
    path = tmp_path_factory.mktemp("tasks") / "Achse Z.csv"
    path.write_bytes("\r\n".join([*rows, ""]).encode("cp1252"))
    return path


def test_the_reference_of_the_torque_is_the_input_and_a_velocity_goes_before_a_position(log: Path) -> None:
    out = log.with_name("Achse Z.toml")
    written = livebode("inspect", log, "--yes", "--out", out)
    assert written.code == 0, written.err
    assert [line.split(" (")[0] for line in written.out.splitlines()[:3]] == [
        "excitation: M_stoer", "input: M_soll", "output: n_ist",
    ]  # fmt: skip
    line = written.out.splitlines()[-1].removeprefix("Next: ")
    assert shlex.split(line) == ["livebode", "run", str(out)]  # the shell finds one file


def test_an_input_that_no_channel_can_be_is_asked_for_among_the_channels(tmp_path: Path) -> None:
    given = signals()
    write_csv(tmp_path / "log.csv", {"t": given["t"], "w": given["w"], "y": given["y"]})
    refused = livebode("inspect", tmp_path / "log.csv", "--yes", "--out", tmp_path / "axis.toml")
    assert refused.code == 2
    assert "the input channel is not recognised among w, y; give --input CHANNEL" in refused.err


def test_a_comparison_of_three_lines_says_why_it_has_no_parameters(log: Path) -> None:
    run = log.with_name("before")
    assert livebode("run", log, *ROLES, "--average", "--out", run).code == 0
    compared = livebode("compare", run, run)
    assert compared.code == 0
    assert "No parameters: the fit to before was rejected" in compared.out
    refused = livebode("learn", run, "--out", log.with_name("healthy.json"))
    assert "learn from a run with tracking.average = false, or compare two averaged runs" in refused.err


@pytest.mark.parametrize("name", ["", "inspect", "doctor"])
def test_the_help_has_a_short_option(name: str) -> None:
    short, long = (livebode(*filter(None, [name]), option) for option in ("-h", "--help"))
    assert (short.code, short.out) == (0, long.out)


def test_the_help_of_the_first_page_names_the_section_in_brackets() -> None:
    for name in ("report", "compare"):
        text = " ".join(livebode(name, "--help").out.replace("│", " ").replace("|", " ").split())
        assert "TOML file with a [report]" in text
        assert "that of the [report], or en" in text


@pytest.mark.parametrize("word", ["version", "help"])
def test_the_name_of_an_option_as_a_command_proposes_the_option(word: str) -> None:
    refused = livebode(word)
    assert refused.code == 2
    assert f"Did you mean 'livebode --{word}'?" in " ".join(refused.err.replace("│", " ").split())


def test_a_window_of_noise_does_not_cross_the_border_of_two_records(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).standard_normal(1601)
    write_sinumerik(tmp_path / "log.xml", {"input": noise, "output": 2 * noise})
    given = ("--input", "input", "--output", "output", "--estimator", "lpm", "--json", "--out", tmp_path / "run")
    run = livebode("run", tmp_path / "log.xml", *given)
    assert run.code == 0, run.err
    assert json.loads(run.out)["found"]["window"] == 801  # the longer record


INTERRUPTED = """
import sys
class Interrupting:
    def find_spec(self, name, *_):
        if name == "livebode.cli.app":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Interrupting())
sys.argv = ["livebode", "run", "log.csv"]
from livebode.cli import main
main()
"""


def test_ctrl_c_while_the_program_is_loaded_is_one_sentence() -> None:
    ended = subprocess.run([sys.executable, "-c", INTERRUPTED], capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (130, "livebode: stopped; nothing was written\n")
