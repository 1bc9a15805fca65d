"""[fit] in a run and `livebode fit` after it: files, numbers, pictures and words are of the machine."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from livebode.records import RunRecord
from livebode.simulation import BeltAxis, Mechanics, Sensor, SimulatedAxis, Standstill
from tests.support.axes import MULTISINE
from tests.support.command import livebode
from tests.support.real_recordings import recording

KEYS = """
[source]
log = "log.parquet"
[signals]
output = "velocity"
input = "u"
excitation = "w"
schedule = "x"
[lines]
frequencies = "20:140:20"
window = 400
"""


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A belt axis at 0.8 m, recorded in its periodic state."""
    folder = tmp_path_factory.mktemp("machine")
    axis = BeltAxis(mechanics=Mechanics(frozen_position_m=0.8), motion=Standstill(position_m=0.8),
                    excitation_n_m=MULTISINE, sensor=Sensor(noise_rad_per_s=0.05), seconds=10.0, seed=1)  # fmt: skip
    block = SimulatedAxis(axis).run()[0].cut(28000, 40000)
    columns = {name: pa.array(block[name]) for name in ("w", "u", "velocity", "x")}
    pq.write_table(pa.table({"t": pa.array(np.arange(len(block)) / 4000), **columns}), folder / "log.parquet")
    return folder


def run(machine: Path, name: str, fit: str, *options: str) -> tuple[Path, str]:
    (machine / f"{name}.toml").write_text(KEYS + fit, encoding="utf-8")
    result = livebode("run", machine / f"{name}.toml", "--out", machine / name, *options)
    assert (result.code, result.err) == (0, "")
    return machine / name, result.out


def test_a_run_with_fits_leaves_parameters_numbers_and_a_curve(machine: Path) -> None:
    plain, _ = run(machine, "plain", "")
    out, printed = run(machine, "fitted", '[fit]\nmodel = "two-mass"\nradius_m = 0.019\n')
    table = pq.read_table(out / "parameters.parquet")
    columns = table.to_pydict()
    rows = np.array([n == "Keff" and s == "ok" for n, s in zip(columns["name"], columns["status"])])
    keff, sigma = (np.array(columns[c])[rows] for c in ("value", "sigma"))
    assert rows.sum() > 500
    assert np.mean(np.abs(keff / 5e5 - 1) < 0.02) > 0.99
    assert np.mean(np.abs(keff - 5e5) < 3 * sigma) > 0.97
    assert {u for n, u in zip(columns["name"], columns["unit"]) if n == "resonance"} == {"Hz"}
    assert set(columns["model"]) == {"two-mass"}
    responses = len(set(pq.read_table(out / "responses.parquet")["sample"].to_pylist()))
    assert len(columns["name"]) == responses * len(set(columns["name"]))
    summary = json.loads((out / "run.json").read_text())["fit"]
    newest = summary["newest"]["quantities"]
    assert newest["mL"]["unit"] == "kg"
    assert abs(newest["mL"]["value"] - 6.7) < 2 * newest["mL"]["bound_95"]
    assert sum(summary["statuses"].values()) == responses
    assert "two-mass model, newest fit" in printed
    assert "Keff" in printed
    kinds = {json.loads(line)["kind"] for line in (out / "events.jsonl").read_text().splitlines()}
    assert "fit-resumed" in kinds
    assert (out / "bode.svg").read_bytes() != (plain / "bode.svg").read_bytes()
    assert not (plain / "parameters.parquet").exists()


def test_a_run_is_fitted_afterwards(machine: Path) -> None:
    out, _ = run(machine, "averaged", "[tracking]\naverage = true\nforgetting = 1.0\n")
    result = livebode("fit", out, "--model", "two-mass", "--radius", 0.019, "--json")
    assert result.code == 0
    found = json.loads(result.out)
    end_s = (RunRecord.open(out).responses().sample[-1] + 1) / 4000
    assert found["fitted_to"].startswith(f"the average up to {end_s:.6g} s")
    assert found["band_hz"] == [20.0, 140.0]
    for name, truth in (("Js", 0.0028), ("mL", 6.7), ("Keff", 5e5), ("bs", 130.0)):
        quantity = found["quantities"][name]
        assert abs(quantity["value"] - truth) < 2 * quantity["bound_95"], name
    tied = livebode("fit", out, "--model", "two-mass", "--radius", 0.019, "--ratio", 6.7 * 0.019**2 / 0.0028, "--json")
    quantities = json.loads(tied.out)["quantities"]
    assert "mL" not in quantities  # it follows from Js
    assert (
        abs(quantities["Js"]["value"] - 0.0028)
        < 2 * quantities["Js"]["bound_95"]
        < 2 * found["quantities"]["Js"]["bound_95"]
    )
    delayed = ("--model", "two-mass", "--radius", 0.019, "--free", "delay", "--json")
    sampled, continuous = (livebode("fit", out, *delayed, "--hold", hold) for hold in ("zero-order", "none"))
    delays_s = [json.loads(one.out)["quantities"]["delay"]["value"] for one in (sampled, continuous)]
    assert delays_s == pytest.approx([0, 0.5 / 4000], abs=3e-6)  # a hold delays by half a tick
    held = livebode("fit", out, "--model", "two-mass", "--radius", 0.019, "--fix", "Js=0.0028", "--band", "40:140")
    assert "40 … 140 Hz" in held.out
    assert "Js " not in held.out
    mean = livebode("fit", run(machine, "each", "")[0], "--model", "two-mass", "--radius", 0.019)
    assert "the mean of" in mean.out


def test_a_fit_without_a_result_reports_its_reason(machine: Path) -> None:
    out, _ = run(machine, "nothing", "")
    result = livebode("fit", out, "--model", "rigid")
    assert result.code == 3
    assert "no parameters (" in result.out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--model", "two"), "there is no model 'two'"),
        (("--model", "two"), "choose auto, rigid, two-mass, three-mass, two-mass-gain, modal, rational"),
        (("--fix", "Js"), "is not NAME=VALUE"),
        (("--band", "20-40"), "is not LOW:HIGH"),
        (("--output", "torque"), "fit.output = 'torque'"),
        (("--model", "two-mass", "--fix", "js=1"), "did you mean 'Js'"),
        (("--model", "two-mass", "--band", "200:300"), "0 lines, too few"),
    ],
)
def test_impossible_options_of_fit_are_usage_errors(machine: Path, options: tuple, message: str) -> None:
    out = machine / "plain"
    if not out.exists():
        run(machine, "plain", "")
    result = livebode("fit", out, *options)
    assert result.code == 2
    assert message in result.err


def test_a_directory_that_is_no_run_is_refused(machine: Path, tmp_path: Path) -> None:
    assert "is not the directory of a run" in livebode("fit", tmp_path).err
    out, _ = run(machine, "broken", "")
    (out / "responses.parquet").write_bytes(b"PAR1")
    result = livebode("fit", out)
    assert result.code == 2
    assert "broken" in result.err
    for name in ("run.json", "run-copy.json"):
        (out / name).write_text("{}")
    assert livebode("fit", out).code == 2


def test_the_configuration_names_a_wrong_key(machine: Path) -> None:
    (machine / "wrong.toml").write_text(KEYS + "[fit]\nradius = 0.019\n", encoding="utf-8")
    result = livebode("run", machine / "wrong.toml", "--out", machine / "wrong")
    assert result.code == 2
    assert "did you mean 'radius_m'" in result.err


def test_the_motor_bench_from_the_command_line(tmp_path: Path) -> None:
    log = recording("motorbench/MultisineTypeA.mat")
    signals = ("--excitation", "iq_refx", "--input", "iq_adx", "--output", "theta_mx")
    careful = ("--average", "--forgetting", 1, "--difference", "theta_mx", "--spikes", "iq_adx")
    assert livebode("run", log, *signals, *careful, "--out", tmp_path / "run").code == 0
    found = json.loads(livebode("fit", tmp_path / "run", "--json").out)
    assert found["model"] == "two-mass-gain"
    assert found["quantities"]["antiresonance"]["value"] == pytest.approx(53.87, abs=0.1)
    assert found["quantities"]["resonance"]["value"] == pytest.approx(76.22, abs=0.1)
