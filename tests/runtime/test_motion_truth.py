"""`livebode run` with a [motion] section leaves what a MotionCorrection gives, to the last sample."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from livebode import Block, MotionCorrection, Responses
from livebode.simulation import BeltAxis, Friction, Sensor, SimulatedAxis, Strokes
from tests.support.axes import MULTISINE
from tests.support.command import livebode, write_parquet
from tests.support.moving import SETTINGS
from tests.support.responses import as_recorded

NAMES = ("w", "u", "velocity", "x")
AXIS = """
[source]
log = "log.parquet"
rate_hz = 4000
[signals]
output = "velocity"
input = "u"
excitation = "w"
schedule = "x"
[lines]
frequencies = "20:140:20"
window = 400
[motion]
radius_m = 0.019
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("motion")
    options = {"friction": Friction(load_coulomb_n=15.0), "sensor": Sensor(noise_rad_per_s=0.1)}
    axis = BeltAxis(motion=Strokes(), excitation_n_m=MULTISINE, seconds=5.0, **options)
    block = SimulatedAxis(axis).run()[0]
    write_parquet(path / "log.parquet", {name: block[name] for name in NAMES})
    np.save(path / "data.npy", [block[name] for name in NAMES])
    return path


def test_the_run_is_that_of_the_correction(folder: Path) -> None:
    (folder / "axis.toml").write_text(AXIS + "chunk_s = 3.9\n")
    result = livebode("run", folder / "axis.toml", "--out", folder / "run", "--json")
    assert (result.code, result.err) == (0, "")
    correction = MotionCorrection(SETTINGS, radius_m=0.019, chunk_samples=15600)
    block = Block(np.load(folder / "data.npy"), NAMES, 4000.0)
    expected = as_recorded(Responses.join([correction.process(block), correction.finish()]))
    table = pq.read_table(folder / "run" / "responses.parquet").to_pydict()
    for name, values in {"re": expected.value.real, "sigma": expected.sigma, "valid": expected.valid}.items():
        assert np.array_equal(np.reshape(table[name], values.shape), values, equal_nan=name != "valid"), name
    summary = json.loads((folder / "run" / "run.json").read_text())
    assert summary["counts"]["responses"] == 1000 == len(expected)
    assert summary["configuration"]["motion"] == {"radius_m": 0.019, "chunk_s": 3.9, "driven_by": "torque"}
    found = summary["found"]["motion"]
    assert (found["driven_by"], found["chunks"]) == ("torque", 2)
    model = found["model"]
    assert model["inertia_kg_m2"] == pytest.approx(0.0028, rel=0.01)
    assert model["load_kg"] == pytest.approx(6.7, rel=0.01)
    assert np.allclose(model["stiffness_n_per_m"], correction.model.stiffness_at(model["position_m"]))
    assert len(model["damping_n_s_per_m"]) == len(model["position_m"])
    events = [json.loads(line) for line in (folder / "run" / "events.jsonl").read_text().splitlines()]
    assert [event["kind"] for event in events] == ["held"] * 2


@pytest.mark.parametrize(
    ("section", "sentence"),
    [
        ("chunk_s = 0.1", "motion.chunk_s = 0.1 is 400 samples"),
        ("chunk_s = -1", "motion.chunk_s = -1 is not usable"),
        ("chunks = 3", "there is no setting 'motion.chunks'; did you mean 'chunk_s'?"),
        ('driven_by = "excitation"', "describe the feedback"),
        ('driven_by = "love"', "motion.driven_by = 'love' is not usable"),
    ],
)
def test_an_impossible_motion_section_is_refused_before_the_start(folder: Path, section: str, sentence: str) -> None:
    (folder / "wrong.toml").write_text(AXIS + section + "\n")
    result = livebode("run", folder / "wrong.toml", "--out", folder / "wrong")
    assert result.code == 2
    assert sentence in result.err
    assert not (folder / "wrong").exists()
