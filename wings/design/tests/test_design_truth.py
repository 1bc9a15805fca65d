"""`livebode design` leaves files that other programs read, and an axis.toml that `livebode run` tracks with."""

import json
import re
import subprocess
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from livebode import Lines, open_log
from livebode.core import DesignError, LivebodeError
from livebode.excitation import Waveform, multisine
from livebode.pictures import svg_file
from livebode.records import RunRecord
from livebode.simulation import SimulatedAxis
from livebode_design import Experiment, choose, write
from livebode_design.excitation_picture import excitation_figure
from tests.support.command import livebode, write_parquet
from tests.support.drawn_svg import checked
from tests.support.schemas import validator
from tools.structured_text import Machine

ROOT = Path(__file__).parents[3]
BELT = """
[belt.sensor]
noise_rad_per_s = 0.05
[limits]
torque_n_m_max = 14.5
"""
KINDS = {
    "multisine": "band_hz = [20, 140]\nresolution_hz = 20\namplitude_n_m = 1.0\n",
    "shaped": 'lines = "20:140:20"\nshape = "equal snr"\nphases = "schroeder"\nresolution_n_m = 0.01\n',
    "odd": 'kind = "odd"\nband_hz = [20, 140]\nresolution_hz = 20\namplitude_n_m = 0.7\nseed = 5\n',
    "prbs": 'kind = "prbs"\nband_hz = [20, 140]\nresolution_hz = 10\namplitude_n_m = 3.0\n',
    "chirp": 'kind = "chirp"\nband_hz = [20, 140]\nresolution_hz = 10\namplitude_n_m = 3.0\n',
    "stepped": 'kind = "stepped"\nband_hz = [20, 140]\nresolution_hz = 40\nperiods = 2\namplitude_n_m = 1.0\n',
    "many windows": "band_hz = [20, 140]\nresolution_hz = 20\namplitude_n_m = 0.15\naccuracy = 0.03\n",
}


def described(folder: Path, excitation: str, machine: str = BELT, log: str = "log.parquet") -> Path:
    path = folder / "experiment.toml"
    path.write_text(f'log = "{log}"\n[excitation]\n{excitation}{machine}', encoding="utf-8")
    return path


def played(path: Path, samples: np.ndarray, seconds: float, to: Path) -> None:
    """What the simulated axis of this description records under the excitation."""
    axis = replace(Experiment.read(path).axis(), excitation_n_m=samples, seconds=seconds, run_in_s=10.0)
    block, _ = SimulatedAxis(axis).run()
    write_parquet(to, {"t": np.arange(len(block)) / block.rate_hz} | {name: block[name] for name in block.names})


@pytest.mark.parametrize("kind", KINDS)
def test_the_axis_file_tracks_what_was_designed(kind, tmp_path):
    path = described(tmp_path, KINDS[kind])
    out = tmp_path / "design"
    made = livebode("design", path, "--out", out, "--json")
    assert made.code == 0, made.err
    printed = json.loads(made.out)
    axis = (out / "axis.toml").read_text("utf-8")
    schema = out / axis.splitlines()[0].removeprefix("#:schema ")
    validator(json.loads(schema.read_text("utf-8"))).validate(tomllib.loads(axis))
    samples = np.load(out / "excitation.npz")["samples"]
    played(path, samples, printed["recording_s"], out / "log.parquet")
    ran = livebode("run", out / "axis.toml", "--out", tmp_path / "run")
    assert ran.code == 0, ran.err
    run = RunRecord.open(tmp_path / "run")
    found = run.responses()
    np.testing.assert_allclose(found.lines.frequency_hz, printed["frequency_hz"], rtol=1e-9)
    assert run.found["window"] == printed["window"]
    newest = found[int(np.flatnonzero(found.valid.all(axis=1))[-1])]
    truth = Experiment.read(path).axis().linear(0.8).sampled(4000).response(newest.lines.frequency_hz)
    error = np.abs(newest.value - truth)
    # Five sigma, with the factor that noise takes near the resonance; of a quantised one the images of its rounding.
    averaged = printed["windows"] if kind == "many windows" else 1
    assert np.all(error <= 5 * 1.5 * np.array(printed["sigma"]) / np.sqrt(averaged)), error / np.array(printed["sigma"])
    if kind == "many windows":
        assert printed["windows"] > 10
        assert np.mean(error / np.abs(truth) <= 0.03) > 0.7


def test_the_axis_file_frees_the_responses_of_a_moving_axis_from_its_motion(tmp_path):
    machine = "[belt.strokes]\nstart_m = 0.6\nend_m = 1.2\n[belt.sensor]\nnoise_rad_per_s = 0.1\n"
    path = described(tmp_path, 'lines = "20:140:20"\nwindow = 400\n', machine)
    out = tmp_path / "design"
    printed = json.loads(livebode("design", path, "--out", out, "--json").out)
    played(path, np.load(out / "excitation.npz")["samples"], printed["recording_s"], out / "log.parquet")
    ran = livebode("run", out / "axis.toml", "--out", tmp_path / "run")
    assert ran.code == 0, ran.err
    found = RunRecord.open(tmp_path / "run").responses()
    found = found[np.flatnonzero(found.valid.all(axis=1))]
    assert len(found) > 700
    assert found.schedule.min() < 0.65
    assert found.schedule.max() > 1.15
    axis = Experiment.read(path).axis()
    truth = [axis.linear(float(x)).sampled(4000).response(found.lines.frequency_hz) for x in found.schedule]
    # [motion] stands in the file: the promised 5 % hold for about 95 % of one-window errors all along the stroke.
    within = np.mean(np.abs(found.value / np.array(truth) - 1) <= 0.05, axis=0)
    assert np.all(within > 0.9), within


def test_a_design_from_a_run_predicts_as_the_run_s_machine_does(tmp_path):
    path = described(tmp_path, 'lines = "20:140:10"\nphases = "schroeder"\naccuracy = 0.01\n')
    first = json.loads(livebode("design", path, "--out", tmp_path / "first", "--json").out)
    samples = np.load(tmp_path / "first" / "excitation.npz")["samples"]
    played(path, samples, first["recording_s"], tmp_path / "first" / "log.parquet")
    assert livebode("run", tmp_path / "first" / "axis.toml", "--out", tmp_path / "run").code == 0
    measured = '[measured]\nrun = "run"\nnoise = 0.05\nradius_m = 0.019\n'
    again = described(
        tmp_path, 'lines = "20:140:20"\nwindow = 400\nphases = "schroeder"\namplitude_n_m = 1.0\n', measured
    )
    printed = json.loads(livebode("design", again, "--out", tmp_path / "again", "--json").out)
    whole = described(
        tmp_path, 'lines = "20:140:20"\nwindow = 400\nphases = "schroeder"\namplitude_n_m = 1.0\n', "[belt.mechanics]\n"
    )
    truth = json.loads(livebode("design", whole, "--out", tmp_path / "truth", "--json").out)
    for name in ("torque", "speed", "following error"):
        sizes = [max(d["predicted"][name]["high"], -d["predicted"][name]["low"]) for d in (printed, truth)]
        assert sizes[0] == pytest.approx(sizes[1], rel=0.05), name
    moving = described(
        tmp_path, 'lines = "20:140:20"\nwindow = 400\nphases = "schroeder"\namplitude_n_m = 1.0\n',
        measured + "following_error_m = [-0.01, 0.02]\nstroke_s = 10.0\n",
    )  # fmt: skip
    errors = json.loads(livebode("design", moving, "--out", tmp_path / "moving", "--json").out)["predicted"]
    still, both = printed["predicted"]["following error"], errors["following error"]
    assert both["low"] == pytest.approx(still["low"] - 0.01)
    assert both["high"] == pytest.approx(still["high"] + 0.02)
    outside = described(tmp_path, 'lines = "20:160:20"\nwindow = 400\namplitude_n_m = 1.0\n', measured)
    refused = livebode("design", outside, "--out", tmp_path / "outside")
    assert refused.code == 2
    assert "is outside 20 … 140 Hz" in refused.err


@pytest.fixture
def waveform():
    lines = Lines.parse("20:140:20", 4000, 400)
    about = {"kind": "multisine", "seed": 7, "phases": "random", "note": "ends a comment */ or not"}
    return Waveform(lines, multisine(lines, 0.3, "random", seed=7), about)


def test_csv_is_read_back_as_a_recording_with_every_bit(waveform, tmp_path):
    write(tmp_path / "w.csv", waveform, "w")
    log = open_log(tmp_path / "w.csv")
    assert log.rate_hz == pytest.approx(4000)
    (block,) = log.blocks(["w"])
    assert np.array_equal(block["w"], waveform.samples)
    assert [c.unit for c in log.channels if c.name == "w"] == ["N m"]
    assert "# seed: 7" in (tmp_path / "w.csv").read_text()


def test_npz_and_matlab_hold_every_bit_and_the_phases_of_equation_6(waveform, tmp_path):
    for suffix in (".npz", ".mat"):
        write(tmp_path / f"w{suffix}", waveform, "w")
    arrays = np.load(tmp_path / "w.npz")
    struct = loadmat(tmp_path / "w.mat", squeeze_me=True, simplify_cells=True)["w"]
    for found in (arrays, struct):
        assert np.array_equal(found["samples"], waveform.samples)
        again = multisine(waveform.lines, found["amplitude"], found["phase"])
        np.testing.assert_allclose(again, waveform.samples, atol=1e-12)
        facts = json.loads(str(found["facts"]))
        assert facts["seed"] == 7
        assert Lines(tuple(facts["bins"]), facts["window"], facts["rate_hz"]).bins == waveform.lines.bins
    assert struct["Ts"] == 1 / 4000


def test_wav_is_read_back_as_a_recording_with_the_nearest_floats(waveform, tmp_path):
    write(tmp_path / "w.wav", waveform, "w")
    log = open_log(tmp_path / "w.wav")
    assert log.rate_hz == 4000
    (block,) = log.blocks(["c1"])
    assert np.array_equal(block["c1"], waveform.samples.astype(np.float32))


def test_a_rate_that_wav_does_not_have_is_refused(waveform, tmp_path):
    lines = Lines(waveform.lines.bins, waveform.lines.window, 4000.5)
    with pytest.raises(DesignError, match=r"4000\.5 Hz; choose another format"):
        write(tmp_path / "w.wav", Waveform(lines, waveform.samples, {}), "w")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("as_type", ["double", "float"])
def test_c_compiles_without_a_warning_and_holds_every_bit(waveform, tmp_path, as_type):
    write(tmp_path / "belt_w.h", waveform, "belt_w")
    program = f"""
#define BELT_W_TYPE {as_type}
#include "belt_w.h"
#include "belt_w.h"
#include <stdio.h>
int main(void) {{
    for (unsigned n = 0; n < BELT_W_SAMPLES; n++) printf("%.17g\\n", (double)belt_w[n]);
    for (unsigned i = 0; i < BELT_W_LINES; i++) printf("%u\\n", belt_w_bins[i]);
    printf("%.17g\\n", (double)BELT_W_RATE_HZ);
    return 0;
}}
"""
    (tmp_path / "main.c").write_text(program)
    compiled = ["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "main.c", "-o", "main"]
    subprocess.run(compiled, cwd=tmp_path, check=True)
    printed = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout.split()
    dtype = {"double": np.float64, "float": np.float32}[as_type]
    assert np.array_equal(np.array(printed[:400], dtype=np.float64), waveform.samples.astype(dtype).astype(np.float64))
    assert tuple(map(int, printed[400:407])) == waveform.lines.bins
    assert float(printed[407]) == 4000


def test_structured_text_plays_the_period_to_the_bit_and_names_its_seed(tmp_path):
    lines = Lines((1, 3, 7), 40, 1000.0)
    waveform = Waveform(lines, multisine(lines, 0.3, "random", seed=7), {"seed": 7, "note": "ends a comment *) or not"})
    write(tmp_path / "belt_w.st", waveform, "belt_w")
    text = (tmp_path / "belt_w.st").read_text()
    block = Machine(text).instance("FB_belt_w")
    played = []
    for _ in range(6 * 40):
        block(enable=True)
        played.append(block["w"])
    assert np.array_equal(played[-80:], np.tile(waveform.samples, 2))
    assert "seed: 7" in text
    with pytest.raises(LivebodeError, match="belt__w"):
        write(tmp_path / "bad.st", waveform, "belt__w")
    assert not (tmp_path / "bad.st").exists()


def test_the_seed_in_a_file_makes_the_same_file_again(tmp_path):
    path = described(
        tmp_path, 'band_hz = [20, 140]\nresolution_hz = 20\nphases = "random"\namplitude_n_m = 0.5\nseed = 11\n'
    )
    outs = [tmp_path / f"d{i}" for i in range(3)]
    for out, seed in zip(outs, ("11", "11", "12")):
        assert livebode("design", path, "--out", out, "--seed", seed).code == 0
    one, other = ((out / "excitation.h").read_text() for out in (outs[0], outs[2]))
    for path in outs[0].iterdir():
        assert path.read_bytes() == (outs[1] / path.name).read_bytes(), path.name
    assert re.search(r"seed: 11\b", one)
    assert one != other
    assert b"2" not in (outs[0] / "excitation.mat").read_bytes()[:116], "a time of day"


def test_the_table_gives_each_choice_with_its_reason(tmp_path):
    shown = livebode("design", ROOT / "examples" / "experiment.toml", "--out", tmp_path / "d", "--to", "csv")
    assert shown.code == 0, shown.err
    for word in ("lines", "window", "amplitude", "peak torque", "following error", "95 % bound", "recording", "hop"):
        assert word in shown.out
    assert sorted(p.name for p in (tmp_path / "d").iterdir()) == [
        "axis.schema.json", "axis.toml", "design.json", "excitation.csv", "excitation.svg",
    ]  # fmt: skip
    printed = json.loads((tmp_path / "d" / "design.json").read_text())
    for f, sigma in zip(printed["frequency_hz"], printed["sigma_relative"]):
        assert re.search(rf"^ *{f:g} Hz .* {100 * sigma:.3g} % of \|G\|", shown.out, re.MULTILINE), f


def test_the_picture_has_the_samples_and_the_lines_of_every_kind(tmp_path):
    for kind in ("odd", "prbs", "stepped"):
        asked = Experiment.read(described(tmp_path, KINDS[kind]))
        design = choose(asked.spec(), asked.machine(), asked.machine_limits())
        figure = excitation_figure(design)
        checked(svg_file(figure))
        (period,) = figure.marks("excitation")
        np.testing.assert_array_equal(period.y[::2], design.waveform.samples)
        amplitudes = np.abs(design.waveform.spectrum[list(design.waveform.lines.bins)])
        np.testing.assert_array_equal(figure.marks("line")[-1].y, amplitudes)
