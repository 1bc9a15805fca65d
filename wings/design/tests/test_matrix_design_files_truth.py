"""`livebode design` for several motors, from its file to a run of what a simulated machine recorded."""

from __future__ import annotations

import json
import subprocess
import tomllib
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from livebode import Run, interface
from livebode.core import Block
from livebode.simulation import GantryLoop
from livebode.sources import open_log
from livebode_design import MatrixExperiment
from livebode_design.experiment_schema import matrix_experiment_schema
from livebode_design.matrix.measured_matrix import MeasuredMatrixSection, measured_machine
from tests.support.command import livebode, write_csv
from tests.support.schemas import validator

EXAMPLE = Path(interface.__file__).parent / "example_files" / "several-motors.toml"
MODES = """
[modes]
names = ["v1", "v2"]
units = ["rad/s", "rad/s"]
frequency_hz = [0.0, 0.0, 35.0]
damping = [0.5, 0.5, 0.02]
input_shapes = [[10.0, 0.0], [0.0, 8.0], [6.0, -4.0]]
output_shapes = [[10.0, 0.0], [0.0, 8.0], [6.0, -4.0]]
[drives]
gain_n_m_s = [0.3, 0.2]
noise = 0.05
[limits]
torque_n_m_max = 3.0
[excitation]
lines = "10:60:10"
window = 400
time_s = 10
"""


@pytest.fixture(scope="module")
def designed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("design") / "gantry"
    result = livebode("design", EXAMPLE, "--out", out)
    assert result.code == 0, result.err
    for word in ("orthogonal", "interleaved", "successive", "from u2", "limit 2"):
        assert word in " ".join(result.out.split())
    return out


def samples(directory: Path) -> NDArray[np.float64]:
    with np.load(directory / "excitation.npz") as file:
        return np.asarray(file["samples"])


def recorded(designed: Path, there: Path, seed: int) -> Block:
    """Play the design on the simulated gantry, and run what it recorded: to `there`/run."""
    repetitions = json.loads((designed / "design.json").read_text("utf-8"))["repetitions"]
    w = np.tile(samples(designed), repetitions)
    noise = np.array([[0.05], [0.05], [0.001]]) * np.random.default_rng(seed).standard_normal((3, w.shape[1]))
    block = GantryLoop().simulate(w, noise=noise)
    for name in ("axis.toml", "axis.schema.json"):
        (there / name).write_bytes((designed / name).read_bytes())
    columns = {"t": np.arange(len(block)) / block.rate_hz} | {one.name: block[one.name] for one in block.channels}
    write_csv(there / "log.csv", columns)
    run = livebode("run", there / "axis.toml", "--out", there / "run")
    assert run.code == 0, run.err
    return block


@pytest.mark.parametrize("seed", range(3))
def test_a_run_of_the_recording_has_the_predicted_sigma(designed: Path, seed: int, tmp_path: Path) -> None:
    """The mean square of 66 independent errors over the predicted sigma has a standard deviation of 12 %."""
    block = recorded(designed, tmp_path, seed)
    found = Run(tmp_path / "run").matrix[-1:]
    truth = GantryLoop().gantry.response(found.frequency_hz, block.rate_hz)
    predicted = np.array(json.loads((designed / "design.json").read_text("utf-8"))["sigma"])
    assert 0.6 < np.mean(np.abs((found.value[0] - truth) / predicted) ** 2) < 1.4
    assert 0.7 < np.sqrt(np.mean((found.sigma[0] / predicted) ** 2)) < 1.3
    assert np.abs(block["u1"]).max() < 2.5
    assert np.abs(block["u2"]).max() < 2.0


MEASURED = """
[measured_matrix]
run = "run"
torque_constant_n_m_per_a = 0.5
[limits]
torque_n_m_max = [3.0, 2.0]
current_a_max = 5.0
speed_max = [20.0, 20.0, 0.3]
travel_max = [0.2, 0.2, 0.004]
[excitation]
lines = "10:60:5"
window = 800
accuracy = 0.01
"""


def test_a_design_from_a_run_is_that_of_the_described_machine(designed: Path, tmp_path: Path) -> None:
    """The noise of each line has 4 degrees of freedom: over all lines and outputs its rms is right to 4 %, 15 % is 4 σ.

    Limits are those of the periodic state, so that amplitudes are a little larger.
    """
    recorded(designed, tmp_path, 5)
    (tmp_path / "experiment.toml").write_text(MEASURED)
    result = livebode("design", tmp_path / "experiment.toml", "--out", tmp_path / "out", "--json")
    assert result.code == 0, result.err
    found = json.loads(result.out)
    machine = measured_machine(MeasuredMatrixSection(run=tmp_path / "run"))
    rms = np.sqrt(np.mean((machine.noise_deviation / [0.05, 0.05, 0.001]) ** 2))
    assert rms == pytest.approx(1.0, abs=0.15)
    described = {one["kind"]: one for one in json.loads((designed / "design.json").read_text("utf-8"))["alternatives"]}
    for one in found["alternatives"]:
        full = np.array(one["amplitude_n_m"]) / np.array(described[one["kind"]]["amplitude_n_m"])
        assert one["kind"] == found["kind"] or np.all((full > 0.97) & (full < 1.25)), one
    axis = tomllib.loads((tmp_path / "out" / "axis.toml").read_text("utf-8"))
    was = tomllib.loads((designed / "axis.toml").read_text("utf-8"))
    assert axis["signals"] == was["signals"]
    assert [one["velocity"]["gain"] for one in axis["loop"]["controllers"]] == [0.3, 0.3]
    (tmp_path / "experiment.toml").write_text(MEASURED.replace("10:60:5", "10:70:5"))
    refused = livebode("design", tmp_path / "experiment.toml", "--out", tmp_path / "other")
    assert (refused.code, "no response at 65 Hz" in refused.err) == (2, True)


def test_a_run_without_controllers_is_refused(designed: Path, tmp_path: Path) -> None:
    recorded(designed, tmp_path, 6)
    axis = tmp_path / "axis.toml"
    axis.write_text(axis.read_text("utf-8").partition("[[loop.controllers]]")[0])
    assert livebode("run", axis, "--out", tmp_path / "run", "--force").code == 0
    (tmp_path / "experiment.toml").write_text(MEASURED)
    refused = livebode("design", tmp_path / "experiment.toml", "--out", tmp_path / "out")
    assert (refused.code, "does not describe its controllers" in refused.err.replace("\n", " ")) == (2, True)
    (tmp_path / "experiment.toml").write_text(MEASURED + "[drives]\nnoise = 0.1\n")
    assert livebode("design", tmp_path / "experiment.toml", "--out", tmp_path / "out").code == 2


def test_all_files_contain_the_same_experiments(designed: Path) -> None:
    from scipy.io import loadmat

    w = samples(designed)
    log = open_log(designed / "excitation.csv")
    block = next(iter(log.blocks()))
    assert np.array_equal(np.stack([block["w1"], block["w2"]]), w)
    assert np.array_equal(loadmat(designed / "excitation.mat")["excitation"]["samples"][0, 0], w.T)


def test_the_c_header_plays_the_experiments_of_all_inputs(designed: Path, tmp_path: Path) -> None:
    (tmp_path / "play.c").write_text(
        '#include <stdio.h>\n#include "excitation.h"\n'
        "int main(void) {\n"
        "    for (int i = 0; i < EXCITATION_INPUTS; i++) {\n"
        '        for (int n = 0; n < EXCITATION_SAMPLES; n++) { printf("%.17g\\n", excitation[i][n]); }\n'
        "    }\n"
        "    return EXCITATION_LINES - 11 + (int)excitation_bins[0] - 2;\n"
        "}\n"
    )
    words = ["cc", "-std=c99", "-Wall", "-Werror", "-pedantic", f"-I{designed}", "play.c", "-o", "play"]
    subprocess.run(words, cwd=tmp_path, check=True)
    out = subprocess.run([tmp_path / "play"], check=True, capture_output=True, text=True).stdout
    assert np.array_equal(np.array(out.split(), dtype=np.float64).reshape(2, -1), samples(designed))


def test_a_machine_of_modes_is_designed_for_the_time(tmp_path: Path) -> None:
    (tmp_path / "experiment.toml").write_text(MODES)
    result = livebode("design", tmp_path / "experiment.toml", "--out", tmp_path / "out", "--to", "npz", "--json")
    found = json.loads(result.out)
    assert found["outputs"] == ["v1", "v2"]
    assert found["time_s"] <= 10 < found["time_s"] * (1 + 1 / found["repetitions"])
    assert livebode("design", tmp_path / "experiment.toml", "--out", tmp_path / "out").code == 2
    again = livebode("design", tmp_path / "experiment.toml", "--out", tmp_path / "out", "--force", "--to", "csv")
    assert again.code == 0
    assert (tmp_path / "out" / "excitation.csv").exists()
    assert not (tmp_path / "out" / "excitation.npz").exists()
    _check_that_nothing_else_is_replaced(tmp_path)


def _check_that_nothing_else_is_replaced(folder: Path) -> None:
    """With the list of a design in which somebody has a file, a directory or a link of his own."""
    mark, mine = folder / "out" / "design.json", folder / "out" / "thesis.csv"
    listed = json.loads(mark.read_text())["files"]
    arguments = ("design", folder / "experiment.toml", "--out", folder / "out", "--force", "--to", "csv")
    (folder / "outside").mkdir()
    for create in (mine.touch, mine.mkdir, lambda: mine.symlink_to(folder / "outside")):
        create()
        for files in ([*listed, mine.name], ["thesis.csv", "axis.toml"], [*listed, "../outside"], "thesis.csv", None):
            mark.write_text(json.dumps({"files": files}))
            done = livebode(*arguments)
            assert (done.code, done.err.count("\n")) == (2, 1)
            assert mine.exists()
        mine.rmdir() if mine.is_dir() and not mine.is_symlink() else mine.unlink()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("accuracy = 0.01", "accuracy = 1e-5"), "limited by the torque"),
        (("accuracy = 0.01", "accuracy = 0.0001\ntime_s = 30"), "the best in"),
        (("accuracy = 0.01", "time_s = 1.0"), "too short"),
        (("[gantry]", "[corexy]\n[gantry]"), "[gantry] and by [corexy]"),
        (("cart_m = 0.2", "cart_kilo = 0.2"), "gantry.cart_kilo"),
        (("cart_m = 0.2", "cart_m = 0.7"), "not on the beam"),
        (("noise =", "noize ="), "noi"),
        (("torque_n_m_max = [3.0, 2.0]", "torque_n_m_max = [3.0, 2.0, 1.0]"), "3 values for 2 motors"),
        (("[limits]", "[limitz]"), "limitz"),
        (("window = 800", ""), "excitation.window"),
        (("cart_m = 0.2", "cart_kg = inf"), "not finite"),
        (("cart_m = 0.2", "damping_n_s_per_m = nan"), "not finite"),
        (("cart_m = 0.2", "motor_inertia_kg_m2 = 1e300"), "too large or small"),
        (("noise = [0.05, 0.05, 0.001]", "noise = 1e300"), "too large or small"),
        (("current_a_max = 5.0", "current_a_max = 1e-300"), "too large or small"),
        (("rate_hz = 4000", "rate_hz = 1e-300"), "too large or small"),
        (('lines = "10:60:5"', 'lines = "10:60:3"'), "grid"),
    ],
)
def test_what_cannot_be_designed_is_one_sentence(change: tuple[str, str], message: str, tmp_path: Path) -> None:
    path = tmp_path / "experiment.toml"
    path.write_text(EXAMPLE.read_text("utf-8").replace(*change))
    result = livebode("design", path, "--out", tmp_path / "out")
    assert result.code == 2
    assert message in result.err.replace("\n", " "), result.err
    assert result.err.startswith("livebode: ")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("option", [("--band", "10:60"), ("--resolution", "5"), ("--amplitude", "1"), ("--to", "st")])
def test_what_belongs_to_one_input_is_refused(option: tuple[str, str], tmp_path: Path) -> None:
    result = livebode("design", EXAMPLE, "--out", tmp_path / "out", *option)
    assert result.code == 2
    assert not (tmp_path / "out").exists()


def test_the_schema_accepts_the_example_and_what_livebode_accepts() -> None:
    valid = validator(matrix_experiment_schema())
    valid.validate(tomllib.loads(MEASURED))
    assert not valid.is_valid(tomllib.loads(MEASURED) | {"drives": {"noise": 0.1}})
    for text in (EXAMPLE.read_text("utf-8"), MODES):
        data = tomllib.loads(text)
        valid.validate(data)
        experiment = MatrixExperiment.of(data, "experiment.toml")
        experiment.spec(), experiment.machine(), experiment.machine_limits()
        assert not valid.is_valid(data | {"corexy": {}, "gantry": {}})
        assert not valid.is_valid({**data, "excitation": {**data["excitation"], "unknown": 1}})
        assert not valid.is_valid({**data, "drives": {}})
