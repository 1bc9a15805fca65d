"""`livebode design` for several motors, from its file to a run of what a simulated machine recorded."""

from __future__ import annotations

import json
import subprocess
import tomllib
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from livebode import Run
from livebode.experiments.experiment_schema import matrix_experiment_schema
from livebode.experiments.matrix_experiment import MatrixExperiment
from livebode.simulation import GantryLoop
from livebode.sources import open_log
from tests.support.command import livebode, write_csv
from tests.support.schemas import validator

EXAMPLE = Path(__file__).parents[2] / "examples" / "gantry.toml"
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


@pytest.mark.parametrize("seed", range(3))
def test_a_run_of_the_recording_has_the_predicted_sigma(designed: Path, seed: int, tmp_path: Path) -> None:
    """The mean square of 198 errors over the predicted sigma: standard deviation 10 % for 66 independent ones."""
    facts = json.loads((designed / "design.json").read_text("utf-8"))
    w = np.tile(samples(designed), facts["repetitions"])
    noise = np.array([[0.05], [0.05], [0.001]]) * np.random.default_rng(seed).standard_normal((3, w.shape[1]))
    loop = GantryLoop()
    block = loop.simulate(w, noise=noise)
    for name in ("axis.toml", "axis.schema.json"):
        (tmp_path / name).write_bytes((designed / name).read_bytes())
    columns = {"t": np.arange(len(block)) / block.rate_hz} | {name.name: block[name.name] for name in block.channels}
    write_csv(tmp_path / "log.csv", columns)
    run = livebode("run", tmp_path / "axis.toml", "--out", tmp_path / "run")
    assert run.code == 0, run.err
    found = Run(tmp_path / "run").matrix[-1:]
    truth = loop.gantry.response(found.frequency_hz, loop.rate_hz)
    predicted = np.array(facts["sigma"])
    assert 0.6 < np.mean(np.abs((found.value[0] - truth) / predicted) ** 2) < 1.4
    assert 0.7 < np.sqrt(np.mean((found.sigma[0] / predicted) ** 2)) < 1.3
    assert (np.abs(block["u1"]).max(), np.abs(block["u2"]).max()) < (2.5, 2.0)


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
    for text in (EXAMPLE.read_text("utf-8"), MODES):
        data = tomllib.loads(text)
        valid.validate(data)
        experiment = MatrixExperiment.of(data, "experiment.toml")
        experiment.spec(), experiment.machine(), experiment.machine_limits()
        assert not valid.is_valid(data | {"corexy": {}, "gantry": {}})
        assert not valid.is_valid({**data, "excitation": {**data["excitation"], "unknown": 1}})
        assert not valid.is_valid({**data, "drives": {}})
