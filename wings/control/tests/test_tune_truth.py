"""`livebode tune` on a run of the simulated loop: table, picture, filters, refusals."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from livebode.core import Lines, PrintedTable, Section
from livebode.excitation import multisine
from livebode.simulation import BeltAxis, Drive, Mechanics, Sensor, SimulatedAxis, Standstill, Strokes, TwoMassLoop
from livebode.simulation.two_mass_loop import RATE_HZ
from livebode_control.proposal.section import proposed_controller
from tests.support.command import livebode, write_parquet
from tests.support.loop_runs import AXIS

FREQUENCIES = "4:100:2, 104:400:8"


def recorded(folder: Path, frequencies: str, window: int) -> Path:
    """A run of the axis on these lines."""
    folder.mkdir()
    w = 0.1 * multisine(Lines.parse(frequencies, RATE_HZ, window))
    u, y = TwoMassLoop().run(w, 10, sigma=0.02, seed=1)
    write_parquet(folder / "log.parquet", {"w": np.resize(w, u.size), "u": u[0], "y": y[0]})
    words = AXIS.format(gain=0.2308, delay=0).replace('"20:140:10"', f'"{frequencies}"')
    words = words.replace("window = 400", f"window = {window}").replace("hop = 200", f"hop = {window}")
    (folder / "axis.toml").write_text(words, encoding="utf-8")
    done = livebode("run", folder / "axis.toml", "--out", folder / "run")
    assert done.code == 0, done.err
    return folder / "run"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("tune") / "axis", FREQUENCIES, 2000)


def test_a_run_is_tuned_once_its_loop_was_checked(run: Path) -> None:
    refused = livebode("tune", run)
    assert refused.code == 2
    assert "livebode validate --loop" in refused.err
    assert livebode("validate", run, "--loop").out.startswith("loop checked: as described")
    done = livebode("tune", run)
    assert done.code == 0, done.err
    assert "velocity.gain" in done.out
    assert "is promised" in done.out
    inertia, bound = map(float, re.search(r"inertia +(\S+) ± (\S+)", done.out).groups())  # type: ignore[union-attr]
    assert abs(inertia - (0.0028 + 6.7 * 0.019**2)) < bound < 0.1 * inertia
    assert "--strokes" in done.out  # the axis was at standstill
    assert (run / "tune.svg").stat().st_size > 3_000
    assert "LIVEBODE_FILTERS" in (run / "filters.h").read_text(encoding="utf-8")
    velocity = tomllib.loads((run / "gains.toml").read_text(encoding="utf-8"))["loop"]["velocity"]
    assert f"{velocity['gain']:.5g}" in done.out


def test_a_link_in_the_run_is_replaced_and_not_followed(run: Path, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    names = {
        "--loop-checked": ("tune.json", "filters.h", "filters.st", "gains.toml"),
        "--shaper": ("shaper.h", "shaper.cfg"),
    }
    for option, files in names.items():
        for name in files:
            (run / name).unlink(missing_ok=True)
            (run / name).symlink_to(tmp_path / "thesis.tex")
        assert livebode("tune", run, option).code == 0
        assert not any((run / name).is_symlink() for name in files)
    assert (tmp_path / "thesis.tex").read_text() == "years of work"


def test_gains_for_odrive_count_turns_and_have_no_filters(run: Path) -> None:
    done = livebode("tune", run, "--loop-checked", "--odrive", "--notches", 0, "--no-low-pass", "--json")
    assert done.code == 0, done.err
    velocity = json.loads(done.out)["controller"]["velocity"]
    written = (run / "odrive.txt").read_text(encoding="utf-8")
    values = [float(line.split(" = ")[1]) for line in written.splitlines()]
    gain = 2 * np.pi * velocity["gain"]
    np.testing.assert_allclose(values[1:], [gain, gain / velocity["integral_time_s"]], rtol=1e-5)


def test_the_report_has_the_newest_proposal_or_says_why_not(run: Path) -> None:
    done = livebode("tune", run, "--loop-checked", "--max-sensitivity", 1.6, "--json")
    promised = json.loads(done.out)["promised"]
    section = proposed_controller(run)
    assert isinstance(section, Section)
    table = section.parts[0]
    assert isinstance(table, PrintedTable)
    assert [row[3] for row in table.rows[:1]] == [f"{promised['bandwidth_hz']:.4g}"]
    assert float(table.rows[3][3]) == pytest.approx(promised["max_sensitivity"], rel=1e-3)
    kept = json.loads((run / "tune.json").read_text(encoding="utf-8"))
    kept["controller"]["velocity"]["gain"] *= 1.01
    for text, words in ((json.dumps(kept), "another proposal than the run gives now"), ("{", "is damaged")):
        (run / "tune.json").write_text(text, encoding="utf-8")
        why = proposed_controller(run)
        assert isinstance(why, str)
        assert words in why
    (run / "tune.json").unlink()
    assert "No controller was proposed" in str(proposed_controller(run))


@pytest.mark.parametrize("bandwidth_hz", [300, 1e6])
def test_a_bandwidth_out_of_reach_ends_with_the_best_and_exit_code_two(run: Path, bandwidth_hz: float) -> None:
    done = livebode("tune", run, "--loop-checked", "--bandwidth-hz", bandwidth_hz, "--json")
    assert done.code == 2
    found = json.loads(done.out.splitlines()[0])
    assert not found["met"]
    assert found["limited_by"]
    assert "the best promises" in done.out + done.err


@pytest.mark.parametrize(
    ("option", "value", "example"),
    [
        ("gain-margin-db", 99, "6"),
        ("max-sensitivity", 0, "1.4 … 2"),
        ("disk-margin", 9, "0.5 … 0.8"),
        ("coherence", 2, "0.5"),
    ],
)
def test_a_limit_out_of_range_is_answered_by_an_example(run: Path, option: str, value: float, example: str) -> None:
    done = livebode("tune", run, f"--{option}", value)
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert f"is out of range; choose for example {example} (option --{option})" in done.err


def test_a_bandwidth_below_the_grid_is_answered_by_the_lines_that_it_needs(run: Path) -> None:
    done = livebode("tune", run, "--loop-checked", "--bandwidth-hz", 1e-6)
    assert done.code == 2
    assert "and the lowest line is 4 Hz; add the lines" in done.err


def proposed(run: Path, *options: object) -> Any:
    done = livebode("tune", run, "--loop-checked", *options, "--json")
    assert done.code == 0, done.err
    return json.loads(done.out)


def test_what_is_promised_has_the_margins_that_were_required(run: Path) -> None:
    usual, careful = proposed(run), proposed(
        run, "--gain-margin-db", 8, "--phase-margin-deg", 45, "--disk-margin", 0.8, "--max-sensitivity", 1.8
    )  # fmt: skip
    assert usual["promised"]["disk_margin"] < 0.8 < careful["promised"]["disk_margin"]
    assert careful["promised"]["gain_margin_db"] >= 8
    assert careful["promised"]["phase_margin_deg"] >= 45
    assert careful["promised"]["max_sensitivity"] <= 1.8
    assert careful["promised"]["bandwidth_hz"] < usual["promised"]["bandwidth_hz"]


def test_the_noise_of_the_input_is_at_most_what_was_permitted(run: Path) -> None:
    usual = proposed(run)["noise"]["after"]
    limit = 0.7 * (1 + 1e-5)  # the optimiser's tolerance
    assert proposed(run, "--noise-gain", 0.7 * usual)["noise"]["after"] <= limit * usual
    step = 2 * np.pi / 2**17
    rounded = proposed(run, "--encoder-step", step)["noise"]["after"]
    assert proposed(run, "--encoder-step", step, "--input-noise", 0.7 * rounded)["noise"]["after"] <= limit * rounded


def test_lines_below_the_required_coherence_are_not_used(run: Path) -> None:
    refused = livebode("tune", run, "--loop-checked", "--coherence", 1.0)
    assert (refused.code, "coherence" in refused.err) == (2, True), refused


def test_a_description_that_the_check_contradicts_is_never_tuned(run: Path) -> None:
    other = run.parent / "gain.toml"
    words = (run.parent / "axis.toml").read_text(encoding="utf-8")
    other.write_text(words.replace("0.2308", "0.3"), encoding="utf-8")
    assert "livebode validate --loop" in livebode("tune", run, "--axis", other).err
    assert livebode("tune", run, "--axis", other, "--loop-checked").code == 0
    assert "loop.velocity.gain" in livebode("validate", run, "--loop", "--axis", other).out
    for more in ((), ("--loop-checked",)):
        done = livebode("tune", run, "--axis", other, *more)
        assert done.code == 2
        assert "loop.velocity.gain" in done.err
    (run / "loop-check.json").write_text("[]", encoding="utf-8")
    assert livebode("tune", run).code == 2
    (run / "loop-check.json").unlink()


def test_design_takes_the_missing_lines_and_with_them_the_axis_is_tuned(tmp_path: Path) -> None:
    coarse = recorded(tmp_path / "coarse", "4:40:4, 120:400:8", 2000)
    refused = livebode("tune", coarse, "--loop-checked", "--json")
    assert refused.code == 2
    wanted = re.search(r"--lines '([^']+)'", refused.err)
    assert wanted is not None, refused.err
    experiment = tmp_path / "experiment.toml"
    experiment.write_text(
        "[excitation]\nband_hz = [4, 400]\nresolution_hz = 4\namplitude_n_m = 0.1\n"
        'phases = "schroeder"\n[measured]\nrun = "coarse/run"\nnoise = 0.02\nradius_m = 0.019\n',
        encoding="utf-8",
    )
    done = livebode("design", experiment, "--lines", wanted[1], "--out", tmp_path / "design", "--json")
    assert done.code == 0, done.err
    lines = tomllib.loads((tmp_path / "design" / "axis.toml").read_text(encoding="utf-8"))["lines"]
    fine = recorded(tmp_path / "fine", lines["frequencies"], lines["window"])
    tuned = livebode("tune", fine, "--loop-checked")
    assert tuned.code == 0, tuned.err


def test_the_model_over_the_position_is_exported_from_a_slow_stroke(tmp_path: Path) -> None:
    """From 0.4 to 1.4 m at 0.1 m/s; the true stiffness follows the cart."""
    axis = BeltAxis(
        drive=Drive(position_rate_hz=RATE_HZ, position_gain_per_s=10.0),
        motion=Strokes(start_m=0.4, end_m=1.4, speed_m_per_s=0.1, dwell_s=0.0),
        excitation_n_m=0.05 * multisine(Lines.parse("4:400:8", RATE_HZ, 1000)),
        seconds=10.0,
    )
    block, _ = SimulatedAxis(axis).run()
    write_parquet(tmp_path / "log.parquet", {n: block[n] for n in ("w", "u", "velocity", "x")})
    words = (
        AXIS.format(gain=0.2308, delay=0).replace('"20:140:10"', '"4:400:8"').replace("window = 400", "window = 1000")
    )
    words = words.replace('output = "y"', 'output = "velocity"\nschedule = "x"')
    (tmp_path / "axis.toml").write_text(words, encoding="utf-8")
    assert livebode("run", tmp_path / "axis.toml", "--out", tmp_path / "run").code == 0
    done = livebode("export", tmp_path / "run", "--lpv", "--to", "json")
    assert done.code == 0, done.err
    found = json.loads((tmp_path / "run-lpv.json").read_text(encoding="utf-8"))
    at = found["names"].index("Keff")
    stiffness, place = np.array(found["value"])[:, at], np.array(found["position"])
    assert place.size >= 10
    # The axis starts to move in the first place.
    np.testing.assert_allclose(stiffness[1:], axis.mechanics.stiffness_at(place)[1:], rtol=0.01)
    for to, ending in (("c", "h"), ("mat", "mat"), ("netcdf", "nc")):
        assert livebode("export", tmp_path / "run", "--lpv", "--to", to).code == 0
        assert (tmp_path / f"run-lpv.{ending}").is_file()
    assert livebode("export", tmp_path / "run", "--lpv", "--mean", "--to", "c").code == 2


def test_gains_over_the_schedule_are_proposed_from_stops_at_places(tmp_path: Path) -> None:
    """Three stops, with a missing sample between them."""
    parts, lines = [], "4:400:4, 408:864:24"  # as the refusal of lines to 400 Hz proposes
    for place in (0.4, 0.95, 1.4):
        axis = BeltAxis(
            mechanics=Mechanics(damping_n_s_per_m=400.0),
            motion=Standstill(position_m=place),
            excitation_n_m=0.05 * multisine(Lines.parse(lines, RATE_HZ, 1000)),
            sensor=Sensor(noise_rad_per_s=0.002),
            run_in_s=2.0,
            seconds=3.0,
        )
        block, _ = SimulatedAxis(axis).run()
        parts.append(np.array([block[n] for n in ("w", "u", "velocity", "x")]))
        parts[-1][2, 0] = np.nan
    write_parquet(tmp_path / "log.parquet", dict(zip(("w", "u", "velocity", "x"), np.concatenate(parts, axis=1))))
    words = AXIS.format(gain=0.2308, delay=0).replace('"20:140:10"', f'"{lines}"')
    words = words.replace("window = 400", "window = 1000").replace("hop = 200", "hop = 1000")
    words = words.replace('output = "y"', 'output = "velocity"\nschedule = "x"')
    (tmp_path / "axis.toml").write_text(words, encoding="utf-8")
    assert livebode("run", tmp_path / "axis.toml", "--out", tmp_path / "run").code == 0
    done = livebode("tune", tmp_path / "run", "--loop-checked", "--schedule")
    assert done.code == 0, done.err
    assert "gains over the schedule" in done.out
    rows = (tmp_path / "run" / "gains.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == "position,gain,integral_time,position_gain"
    np.testing.assert_allclose([float(row.split(",")[0]) for row in rows[1:]], [0.4, 0.95, 1.4], atol=0.01)


def test_input_shapers_are_proposed_for_the_load_of_a_stiff_drive(run: Path) -> None:
    """The load of the true belt swings at 43.48 Hz with a damping of 0.0355 while the motor is held."""
    done = livebode("tune", run, "--shaper", "--klipper-axis", "y", "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["mode"]["low_hz"] < 43.48 < found["mode"]["high_hz"]
    assert found["mode"]["low_damping"] < 0.0355 < found["mode"]["high_damping"]
    best = next(one for one in found["shapers"] if one["kind"] == found["chosen"])
    assert best["worst"] <= 0.05
    assert "shaper_freq_y: 43" in (run / "shaper.cfg").read_text(encoding="utf-8")
    assert "LIVEBODE_SHAPER" in (run / "shaper.h").read_text(encoding="utf-8")
    assert "proposed" in livebode("tune", run, "--shaper").out
    assert "no parameter 'wobble'" in livebode("tune", run, "--shaper", "--mode", "wobble").err
