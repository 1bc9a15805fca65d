"""A design keeps its promises when a machine plays its files; one from a measured run goes on as the run was."""

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from livebode.core import ConfigError
from livebode.records import RunRecord
from livebode.simulation import BeltAxis, SimulatedAxis, extremes
from livebode_design import Experiment, ExperimentSpec, MachineLimits, belt_machine, choose, worst, write
from tests.support.command import livebode, write_parquet
from tests.support.errors import refused
from tools.structured_text import Machine

RATE_HZ = 4000
LOOP = """
[loop.velocity]
gain = {gain}
integral_time_s = 0.02
rate_hz = 4000
[loop.position]
gain = 1.0
rate_hz = 4000
"""


def test_the_function_block_brings_the_excitation_in_within_the_peaks_that_were_predicted(tmp_path):
    """From rest: switched on at once the following error is several times that of the periodic state."""
    axis = BeltAxis()
    spec = ExperimentSpec(band_hz=(20, 140), resolution_hz=60, amplitude_n_m=1.0)
    design = choose(spec, belt_machine(axis), MachineLimits(torque_n_m_max=14.5))
    write(tmp_path / "w.st", design.waveform, "w")
    block = Machine((tmp_path / "w.st").read_text()).instance("FB_w")
    window = len(design.waveform.samples)
    played = []
    for _ in range(round(design.ramp_s * RATE_HZ) + 4 * window):
        block(enable=True)
        played.append(block["w"])
    assert block["steady"]
    # The simulation repeats what it is given, so it gets all of it, and ends before it would begin again.
    seconds = (len(played) - 1) / RATE_HZ
    found = extremes(axis, np.array(played), seconds=seconds, run_in_s=0.0)["following error"]
    predicted = worst(design.peaks)["following error"].size
    assert max(found[1], -found[0]) <= 1.1 * predicted
    at_once = extremes(axis, np.array(design.waveform.samples), seconds=seconds, run_in_s=0.0)["following error"]
    assert max(at_once[1], -at_once[0]) > 1.02 * max(found[1], -found[0])


@pytest.mark.parametrize(
    "spec",
    [
        {"band_hz": (20, 140), "resolution_hz": 40},
        {"kind": "chirp", "band_hz": (20, 140), "resolution_hz": 10},
        {"kind": "prbs", "band_hz": (20, 140), "resolution_hz": 20},
        {"kind": "prbs", "band_hz": (20, 400), "order": 3},
        {"phases": "schroeder", "band_hz": (20, 140), "resolution_hz": 20, "resolution_n_m": 0.2},
        {"phases": "schroeder", "band_hz": (60, 300), "resolution_hz": 20, "resolution_n_m": 0.3},
    ],
)
def test_no_mean_carries_the_axis_beyond_its_peaks_when_the_excitation_is_brought_in(spec):
    axis = BeltAxis()
    design = choose(ExperimentSpec(**spec, amplitude_n_m=1.0), belt_machine(axis), MachineLimits(torque_n_m_max=14.5))
    samples = design.waveform.samples
    assert abs(samples.sum()) <= 0.5 * spec.get("resolution_n_m", 1e-9)
    ramp = round(design.ramp_s * RATE_HZ)
    played = np.resize(samples, ramp + 4 * len(samples)) * np.minimum(np.arange(ramp + 4 * len(samples)) / ramp, 1.0)
    found = extremes(axis, played, seconds=(len(played) - 1) / RATE_HZ, run_in_s=0.0)["following error"]
    assert max(found[1], -found[0]) <= 1.1 * worst(design.peaks)["following error"].size


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """One recording of the axis at standstill, tracked as a velocity with its loop and as a position without."""
    folder = tmp_path_factory.mktemp("measured")
    axis = BeltAxis()
    design = choose(
        ExperimentSpec(lines="20:140:20", window=400, phases="schroeder", amplitude_n_m=1.0), belt_machine(axis)
    )
    block, truth = SimulatedAxis(
        replace(axis, excitation_n_m=design.waveform.samples, seconds=3.0, run_in_s=10.0)
    ).run()
    write_parquet(
        folder / "log.parquet",
        {"t": np.arange(len(block)) / RATE_HZ, "iq_ref [N m]": block["w"], "iq [N m]": block["u"],
         "speed [rad/s]": block["velocity"], "theta [rad]": truth.states[0]},
    )  # fmt: skip
    drive = axis.drive
    loop = (
        f"[loop.velocity]\ngain = {drive.velocity_gain_n_m_s}\nintegral_time_s = {drive.integral_time_s}\n"
        f"rate_hz = {drive.velocity_rate_hz}\nrate_divider = {drive.velocity_ticks}\n"
        f"[loop.position]\ngain = {drive.position_gain_per_s}\nrate_hz = {drive.position_rate_hz}\n"
        f"rate_divider = {drive.position_ticks}\n"
    )
    for name, output in (("speed", "speed"), ("theta", "theta")):
        (folder / f"{name}.toml").write_text(
            f'[source]\nlog = "log.parquet"\n[signals]\nexcitation = "iq_ref"\ninput = "iq"\noutput = "{output}"\n'
            f'[lines]\nfrequencies = "20:140:20"\nwindow = 400\n[tracking]\ndifferenced = ["{output}"]\n{loop}'
        )
        done = livebode("run", folder / f"{name}.toml", "--out", folder / f"run-{name}")
        assert done.code == 0, done.err
    assert RunRecord.open(folder / "run-theta").found["unit"] == "rad/(N m)"
    return folder


EXCITATION = '[excitation]\nlines = "20:140:20"\nwindow = 400\nphases = "schroeder"\namplitude_n_m = 1.0\n'


def test_a_design_from_a_run_adopts_the_description_of_the_run(runs):
    path = runs / "again.toml"
    path.write_text(f'{EXCITATION}resolution_n_m = 0.001\n[measured]\nrun = "run-speed"\nradius_m = 0.019\n')
    done = livebode("design", path, "--out", runs / "again", "--json")
    assert done.code == 0, done.err
    axis = tomllib.loads((runs / "again" / "axis.toml").read_text())
    was = tomllib.loads((runs / "speed.toml").read_text())
    assert axis["signals"] == was["signals"]
    assert axis["tracking"]["differenced"] == ["speed"]
    for part in ("velocity", "position"):
        assert was["loop"][part].items() <= axis["loop"][part].items()
    predicted = json.loads(done.out)["predicted"]
    belt = worst(choose(ExperimentSpec(lines="20:140:20", window=400, phases="schroeder", amplitude_n_m=1.0),
                        belt_machine(BeltAxis())).peaks)  # fmt: skip
    for name in ("torque", "speed", "following error"):
        assert max(predicted[name]["high"], -predicted[name]["low"]) == pytest.approx(belt[name].size, rel=0.05), name
    (runs / "log2.parquet").write_bytes((runs / "log.parquet").read_bytes())
    (runs / "again" / "axis.toml").write_text(
        (runs / "again" / "axis.toml").read_text().replace("log.csv", str(runs / "log2.parquet"))
    )
    assert livebode("run", runs / "again" / "axis.toml", "--out", runs / "tracked").code == 0


@pytest.mark.parametrize(
    ("measured", "code", "facts"),
    [
        ('run = "run-theta"', "value-mismatch", {"key": "loop.position_pd", "value": "position"}),
        ('run = "run-theta"\noutput = "velocity"', "value-mismatch", {"key": "measured.output", "value": "velocity"}),
        ('run = "run-speed"\noutput = "position"', "value-mismatch", {"key": "measured.output", "value": "position"}),
        ('run = "run-speed"\n[loop]\nexcitation_at = "velocity reference"', "value-invalid",
         {"key": "loop.excitation_at", "value": "velocity reference"}),
    ],
)  # fmt: skip
def test_a_run_that_the_loop_does_not_fit_is_refused(runs, measured, code, facts):
    found = Experiment.of({**tomllib.loads(f"{EXCITATION}[measured]\n{measured}\n")}, "here")
    found = found.model_copy(update={"measured": found.measured.model_copy(update={"run": runs / found.measured.run})})
    with refused(ConfigError, code, **facts):
        found.machine()


def test_a_design_from_an_indirect_run_needs_no_input(runs):
    text = (runs / "speed.toml").read_text().replace('input = "iq"\n', "")
    (runs / "indirect.toml").write_text(text.replace("[tracking]\n", '[tracking]\nestimator = "indirect"\n'))
    assert livebode("run", runs / "indirect.toml", "--out", runs / "run-indirect").code == 0
    path = runs / "from-indirect.toml"
    path.write_text(f'log = "log.parquet"\n{EXCITATION}[measured]\nrun = "run-indirect"\nradius_m = 0.019\n')
    assert livebode("design", path, "--out", runs / "from-indirect").code == 0
    (runs / "from-indirect" / "log.parquet").write_bytes((runs / "log.parquet").read_bytes())
    done = livebode("run", runs / "from-indirect" / "axis.toml", "--out", runs / "tracked-indirect")
    assert done.code == 0, done.err


def test_a_loop_that_is_not_the_run_s_own_is_noted(runs):
    path = runs / "loop.toml"
    path.write_text(f'{EXCITATION}[measured]\nrun = "run-speed"\n{LOOP.format(gain=0.5)}')
    done = livebode("design", path, "--out", runs / "loop")
    assert done.code == 0, done.err
    assert "its stability is not checked" in done.out
