"""What cannot be designed is refused in one sentence with the value and the nearest choice that can."""

import json
import re
import subprocess

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from livebode.core import DesignError, GridError, Lines, LivebodeError, UsageError
from livebode.excitation import Waveform, chirp, low_crest_phases, multisine, odd_lines, prbs, quantised, stepped_sine
from livebode.simulation import BeltAxis, Sensor, Strokes
from livebode_design import (
    Experiment,
    ExperimentSpec,
    MachineLimits,
    belt_machine,
    choose,
    identifier,
    measured_machine,
    write,
)
from livebode_design.files import KEYWORDS
from tests.support.command import livebode
from tests.support.errors import refused

FILES = 40
MACHINE = belt_machine(BeltAxis(sensor=Sensor(noise_rad_per_s=0.05)))
MOVING = belt_machine(BeltAxis(motion=Strokes()))
LINES = Lines.parse("20:140:20", 4000, 400)
PLAIN = ExperimentSpec(lines="20:140:20", window=400, phases="schroeder", amplitude_n_m=1.0)


def refusal(make):
    """The error, or None where there is none."""
    try:
        make()
    except LivebodeError as error:
        return error
    return None


@settings(max_examples=60, deadline=None)
@given(
    amplitude=st.floats(1e-3, 1e3),
    torque=st.floats(1.7, 50),
    speed=st.floats(0.45, 5),
    error_m=st.floats(0.013, 0.1),
    moves=st.booleans(),
)
def test_the_largest_amplitude_that_a_refusal_names_passes_and_a_little_more_does_not(
    amplitude, torque, speed, error_m, moves
):
    limits = MachineLimits(torque_n_m_max=torque, speed_m_per_s_max=speed, following_error_m_max=error_m)
    machine = MOVING if moves else MACHINE

    def design(size):
        return choose(
            ExperimentSpec(lines="20:140:20", window=400, phases="schroeder", amplitude_n_m=size), machine, limits
        )

    error = refusal(lambda: design(amplitude))
    if error is not None:
        assert error.code == "design.limit-exceeded"
        assert error.passing < amplitude
        assert f"{amplitude:.4g} N m" in error.message
        assert f"{error.passing:.4g} N m" in error.remedy
        design(error.passing)
        with refused(DesignError, "limit-exceeded"):
            design(error.passing * 1.01)


def test_a_motion_that_leaves_no_room_is_named_and_not_the_excitation():
    with refused(DesignError, "no-room-in-motion", quantity="torque", limit=-0.5):
        choose(PLAIN, MOVING, MachineLimits(torque_n_m_max=0.5))


@settings(max_examples=60, deadline=None)
@given(
    low=st.floats(0.1, 5000),
    width=st.floats(0, 5000),
    kind=st.sampled_from(["multisine", "odd", "prbs", "chirp", "stepped"]),
)
def test_a_band_up_to_the_nyquist_frequency_is_refused(low, width, kind):
    assume(low + width >= 2000)
    spec = ExperimentSpec(band_hz=(low, low + width), resolution_hz=10, kind=kind, amplitude_n_m=1.0)
    with refused(GridError, "above-nyquist", high_hz=low + width, rate_hz=4000):
        choose(spec, MACHINE)


@pytest.mark.parametrize("band", [(0.0, 100.0), (-5.0, 100.0), (100.0, 20.0), (float("nan"), 100.0)])
def test_an_empty_band_is_refused(band):
    with refused(GridError, "band-invalid"):
        choose(ExperimentSpec(band_hz=band, resolution_hz=10), MACHINE)


def test_lines_off_or_closer_than_the_grid_are_refused_with_the_nearest_choice():
    assert "nearest lines are 20 and 30 Hz" in str(
        refusal(lambda: choose(ExperimentSpec(lines="20, 25", window=400), MACHINE))
    )
    finest_hz = pytest.approx(2 * 4000 / 2**24)
    with refused(GridError, "window-too-long", resolution_hz_min=finest_hz):
        choose(ExperimentSpec(band_hz=(20, 21), resolution_hz=1e-5), MACHINE)
    with refused(GridError, "above-nyquist", resolution_hz_max=1600):
        choose(ExperimentSpec(band_hz=(20, 1999), resolution_hz=3000), MACHINE)
    with refused(GridError, "band-without-line", nearest_hz=[30, 50]):
        choose(ExperimentSpec(band_hz=(31, 49), resolution_hz=20), MACHINE)
    assert isinstance(refusal(lambda: choose(ExperimentSpec(lines="20, 20", window=400), MACHINE)), GridError)


def test_typed_lines_that_no_window_fits_are_refused():
    wild = "20.0001234567, 31.41592653589"
    for lines in (wild, "0.0001"):
        assert isinstance(
            refusal(lambda lines=lines: choose(ExperimentSpec(lines=lines, amplitude_n_m=1.0), MACHINE)), GridError
        )


@settings(deadline=None, max_examples=20)
@given(order=st.one_of(st.integers(-5, 1), st.integers(21, 99), st.floats(0, 30), st.booleans()))
def test_a_prbs_order_out_of_range_is_refused_with_the_nearest(order):
    error = refusal(lambda: prbs(order))
    assert (error.code, error.argument, error.value) == ("usage.out-of-range", "order", order)
    nearest = error.nearest
    assert len(prbs(nearest)) == 2**nearest - 1
    assert nearest == min(range(2, 21), key=lambda n: (abs(n - int(order)), n))


def test_lines_too_close_for_any_prbs_are_refused():
    with refused(GridError, "window-too-long", order_max=20):
        choose(ExperimentSpec(kind="prbs", band_hz=(20, 140), resolution_hz=1e-4), MACHINE)


def test_a_line_that_drowns_in_the_rounding_is_refused_and_the_named_step_leaves_it():
    lines = Lines.parse("20:140:20", 4000, 400)
    waveform = Waveform(lines, multisine(lines, [0.001, 1, 1, 1, 1, 1, 1]))
    error = refusal(lambda: waveform.quantised(0.5))
    assert (error.code, error.frequency_hz) == ("design.rounded-away", 20)
    left = waveform.quantised(error.fitting_step_n_m).spectrum[list(lines.bins)]
    assert np.all(np.abs(left / waveform.spectrum[list(lines.bins)] - 1) <= 0.5)


@settings(max_examples=60, deadline=None)
@given(peak=st.floats(1e-9, 10), times=st.floats(2.001, 1e6))
def test_an_amplitude_that_quantises_to_zero_is_refused_and_the_named_step_leaves_it(peak, times):
    period = np.array([0.0, peak, -peak / 2])
    error = refusal(lambda: quantised(period, peak * times))
    assert error.code == "design.rounded-away"
    assert np.any(quantised(period, 0.999 * error.step_max))


def test_an_experiment_that_the_drive_cannot_resolve_is_refused():
    spec = ExperimentSpec(lines="20:140:20", window=400, phases="schroeder", amplitude_n_m=1e-4, resolution_n_m=0.1)
    with refused(DesignError, "rounded-away", step=0.1):
        choose(spec, MACHINE)


def test_a_crest_factor_that_is_not_reached_is_refused_with_the_one_that_is():
    spec = {"lines": "20:140:20", "window": 400, "amplitude_n_m": 1.0}
    error = refusal(lambda: choose(ExperimentSpec(**spec, crest_factor_max=1.2), MACHINE))
    assert (error.code, error.crest_factor_max) == ("design.crest-factor-not-reached", 1.2)
    reached = error.crest_factor
    assert choose(ExperimentSpec(**spec, crest_factor_max=reached), MACHINE).waveform.crest_factor <= reached
    other = refusal(lambda: choose(ExperimentSpec(**spec, phases="schroeder", crest_factor_max=1.5), MACHINE))
    assert "phases = 'low crest'" in other.remedy


@settings(max_examples=200, deadline=None)
@given(
    st.one_of(
        st.text(max_size=80),
        st.sampled_from(sorted(KEYWORDS["C"])),
        st.from_regex(r"[0-9_]*[a-z_-]{0,70}", fullmatch=True),
    )
)
def test_a_name_that_c_forbids_is_refused_with_one_that_it_takes(name):
    error = refusal(lambda: identifier(name))
    if error is None:
        assert identifier(name) == name
        return
    assert (error.code, error.name) == ("design.name-forbidden", name)
    assert identifier(error.nearest) == error.nearest
    assert error.nearest not in KEYWORDS["C"]


def test_names_that_pass_compile(tmp_path):
    waveform = Waveform(LINES, np.sin(2 * np.pi * np.outer(np.arange(400), LINES.bins) / 400).sum(axis=1))
    for name in ("w", "Belt_2_axis", "int_w", "x" * 60):
        write(tmp_path / "a.h", waveform, name)
        (tmp_path / "a.c").write_text('#include "a.h"\nint main(void) { return 0; }\n')
        subprocess.run(["gcc", "-std=c99", "-Wall", "-Werror", "-c", "a.c"], cwd=tmp_path, check=True)
    for name in ("int", "2w", "w w", "", "_w"):
        with refused(DesignError, "name-forbidden", name=name):
            write(tmp_path / "b.h", waveform, name)
        assert not (tmp_path / "b.h").exists()
    with refused(UsageError, "not-one-of", value=".xyz"):
        write(tmp_path / "a.xyz", waveform)


GIVEN = {"lines": "20:140:20", "window": 400, "kind": "multisine"}
WRONG = [
    ({"accuracy": -1}, "usage.out-of-range", "accuracy"),
    ({"seed": -1}, "usage.out-of-range", "seed"),
    ({"amplitude_n_m": 0}, "usage.out-of-range", "amplitude_n_m"),
    ({"amplitude_n_m": [1, 2]} | GIVEN, "usage.wrong-shape", "amplitude_n_m"),
    ({"amplitude_n_m": [1, 1, 1, 0, 1, 1, 1]} | GIVEN, "design.line-without-power", None),
    ({"amplitude_n_m": [1, 2], "kind": "prbs"}, "usage.conflict", "amplitude_n_m"),
    ({"amplitude_n_m": [1, 2], "shape": "equal snr"}, "usage.conflict", "shape"),
    ({"window": 0}, "usage.out-of-range", "window"),
    ({"kind": "chirp", "lines": "20:140:20"}, "usage.conflict", "lines"),
    ({"shape": "equal snr", "kind": "prbs"}, "usage.conflict", "shape"),
    ({"resolution_n_m": float("inf")}, "usage.out-of-range", "resolution_n_m"),
    ({"resolution_hz": 2e-311, "kind": "prbs"}, "usage.out-of-range", "resolution_hz"),
    ({"amplitude_n_m": 1e-200}, "usage.out-of-range", "amplitude_n_m"),
    ({"accuracy": 1e-300}, "usage.out-of-range", "accuracy"),
    ({"crest_factor_max": 0.9}, "usage.out-of-range", "crest_factor_max"),
    ({"crest_factor_max": 2.0, "resolution_n_m": 0.7, "amplitude_n_m": 0.5} | GIVEN,
     "design.crest-factor-not-reached", None),
    ({"resolution_n_m": 1e-320}, "usage.out-of-range", "resolution_n_m"),
    ({"kind": "prbs", "order": 20, "rate_divider": 10**21}, "grid.window-too-long", None),
    ({"kind": "prbs", "band_hz": [20, 20], "resolution_hz": 1}, "grid.band-without-line", "band_hz"),
    ({"lines": "20:140:20"}, "usage.conflict", "band_hz"),
    ({"window": 400, "resolution_hz": 20}, "usage.conflict", "window"),
    ({"kind": "prbs", "window": 400}, "usage.conflict", "window"),
    ({"kind": "prbs", "order": 9, "resolution_hz": 5}, "usage.conflict", "order"),
    ({"kind": "stepped", "phases": "random"}, "usage.conflict", "phases"),
    ({"mains_hz": [50, 0]}, "usage.out-of-range", "mains_hz"),
    ({"order": 9}, "usage.conflict", "order"),
    ({"sweep": "linear"}, "usage.conflict", "sweep"),
    ({"periods": 2}, "usage.conflict", "periods"),
    ({"window": 3}, "grid.band-without-line", "band_hz"),
    ({"kind": "chirp", "band_hz": [20, 20], "resolution_hz": 5}, "grid.band-too-narrow", "band_hz"),
    ({"kind": "odd", "band_hz": [20, 20], "resolution_hz": 5}, "grid.band-without-line", "band_hz"),
]  # fmt: skip


@pytest.mark.parametrize(("excitation", "code", "argument"), WRONG)
def test_a_contradictory_specification_is_refused(excitation, code, argument):
    asked = Experiment.of({"excitation": completed(excitation), "belt": {}}, "here")
    error = refusal(lambda: choose(asked.spec(), MACHINE))
    assert (error.code, error.facts.get("argument")) == (code, argument), error


@pytest.mark.parametrize(
    ("excitation", "words"),
    [
        ({"kind": "multisin"}, "should be 'multisine', 'odd'"),
        ({"bands_hz": [20, 140]}, "did you mean 'band_hz'?"),
        ({"accuracy": "good"}, "should be a valid number"),
        ({"seed": 1.5}, "should be a valid integer"),
        ({"band_hz": [20, 140, 200]}, "at most 2 items"),
        ({"band_hz": "20:140"}, "valid list"),
        ({"window": 2}, "window=2"),
    ],
)
def test_a_key_of_the_wrong_kind_is_refused_with_what_it_should_be(excitation, words):
    data = {"excitation": completed(excitation), "belt": {}}
    assert words in str(refusal(lambda: choose(Experiment.of(data, "here").spec(), MACHINE)))


def completed(excitation):
    """What the excitation needs beside these keys."""
    data = {"band_hz": [20, 140]} | excitation
    if not {"window", "lines", "order", "resolution_hz"} & set(excitation):
        data["resolution_hz"] = 20
    if data.get("kind", "multisine") == "multisine":
        data["phases"] = "schroeder"
    if "lines" in excitation and "kind" in excitation:
        del data["band_hz"]
    return data


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({"excitation": {}}, "neither [belt] nor [measured]"),
        ({"excitation": {}, "belt": {}, "measured": {"run": "x"}}, "described twice"),
        ({"excitation": {}, "measured": {"run": "x", "noise": True}}, "measured.noise = True is not usable"),
        ({"excitation": {}, "measured": {"run": "x", "torque_n_m": [True, 1]}}, "torque_n_m.0 = True is not usable"),
        ({"excitation": {}, "belt": {}, "loop": {}}, "remove [loop]"),
        ({"excitation": {}, "measured": {"run": "x"}, "loop": {"velocity": {"foo": 1}}}, "Settings: rate_hz"),
        ({"excitation": {}, "belt": {}, "signals": {"input": "w"}}, "are both 'w'"),
        ({"excitation": {}, "belt": {}, "signals": {"output": "a\x7fb"}}, "cannot be the name of a channel"),
        ({"excitation": {}, "measured": {"noise": 1.0}}, "'measured.run' is missing"),
        ({"excitation": {}, "belt": {"mechanic": {}}}, "did you mean 'mechanics'?"),
        ({"excitation": {}, "belt": {"mechanics": {"load": 3}}}, "did you mean 'load_kg'?"),
        ({"excitation": {}, "belt": {"mechanics": {"load_kg": "much"}}}, "should be a valid number"),
        ({"excitation": {}, "belt": {"mechanics": {"load_kg": -1.0}}}, "load_kg=-1.0"),
        ({"excitation": {}, "belt": {"strokes": {}, "standstill": {}}}, "exclude each other"),
        ({"excitation": {}, "belt": {}, "limit": {}}, "did you mean 'limits'?"),
        ({"excitation": {}, "belt": {}, "limits": {"torque_n_m_max": 0}}, "not above 0"),
        ({"excitation": {}, "belt": {}, "signals": {"exitation": "w"}}, "did you mean 'excitation'?"),
        ({"excitation": {}, "measured": {"run": "nowhere"}}, "there is no directory 'nowhere'"),
        ({"excitation": {}, "belt": {"sensor": {"noise_rad_per_s": 1e300}}}, "noise=1e+300"),
    ],
)
def test_a_machine_that_makes_no_sense_is_refused(data, words):
    def read():
        asked = Experiment.of(data, "here")
        asked.machine(), asked.machine_limits(), asked.signal_names()

    assert words in str(refusal(read))


def test_nothing_known_but_the_lines_is_refused():
    silent = belt_machine(BeltAxis())
    spec = ExperimentSpec(lines="20:140:20", window=400, phases="schroeder")
    with refused(DesignError, "amplitude-undetermined"):
        choose(spec, silent)
    chosen = choose(spec, silent, MachineLimits(torque_n_m_max=10))
    assert 0.5 < max(-p.low for p in chosen.peaks if p.quantity == "torque") < 1.1
    with refused(DesignError, "feedback-unknown"):
        measured_machine(1.0, type(silent.loop)(), 4000.0)


def test_small_settings_of_the_excitations_are_checked():
    many = Lines(tuple(range(1, 4000)), window=8000, rate_hz=4000.0)
    for make, code, argument in (
        (lambda: low_crest_phases([1, 2], starts=0), "usage.out-of-range", "starts"),
        (lambda: low_crest_phases([1, 2], [1.0]), "usage.wrong-shape", "amplitude"),
        (lambda: prbs(3, rate_divider=0), "usage.out-of-range", "rate_divider"),
        (lambda: stepped_sine(LINES, periods=0), "usage.out-of-range", "periods"),
        (lambda: stepped_sine(LINES, periods=10**6), "grid.window-too-long", None),
        (lambda: stepped_sine(many, periods=1), "grid.window-too-long", None),
        (lambda: chirp(20, 140, 4000, 400, sweep="up"), "usage.not-one-of", "sweep"),
        (lambda: chirp(20, 25, 4000, 400), "grid.band-too-narrow", "band_hz"),
    ):
        error = refusal(make)
        assert (error.code, error.facts.get("argument")) == (code, argument)
    assert "take 2097 lines or fewer" in str(refusal(lambda: stepped_sine(many, periods=1)))


def test_the_window_that_a_band_with_too_few_odd_lines_needs_is_named():
    narrow = refusal(lambda: odd_lines(20, 60, 4000, 400))
    needed = int(re.search(r"take a window of (\d+) samples", narrow.remedy).group(1))
    assert len(odd_lines(20, 60, 4000, needed)) >= 3


@pytest.fixture
def experiment(tmp_path):
    path = tmp_path / "experiment.toml"
    path.write_text(
        '[excitation]\nlines = "20:140:20"\nwindow = 400\nphases = "schroeder"\namplitude_n_m = 1.0\n[belt]\n'
    )
    return path


def test_the_command_refuses_with_2_and_leaves_nothing(experiment, tmp_path):
    out = tmp_path / "design"
    for options, words in (
        (["--amplitude", "-1"], "(option --amplitude)"),
        (["--band", "20-140"], "write for example 20:140 (option --band)"),
        (["--to", "xlsx"], "'.xlsx' is not supported"),
        (["--name", "int"], "keyword or macro of C or C++; take for example 'int_w' (option --name)"),
        (["--name", "NULL", "--to", "h"], "take for example 'NULL_w'"),
        (["--name", "a,b", "--to", "csv"], "cannot head a column"),
        (["--name", "../a", "--to", "csv"], "the name of a file"),
        (["--name", "/tmp/a", "--to", "npz"], "the name of a file"),
        (["--name", "", "--to", "npz"], "the name of a file"),
    ):
        done = livebode("design", experiment, "--out", out, *options)
        assert done.code == 2, done.err
        assert words in done.err
        assert done.err.count("\n") == 1
        assert sorted(p.name for p in tmp_path.iterdir()) == ["experiment.toml"]
    assert livebode("design", tmp_path / "none.toml").code == 2
    broken = tmp_path / "broken.toml"
    broken.write_text("excitation = [")
    assert "is not TOML" in livebode("design", broken).err


def test_only_the_files_of_a_previous_design_are_replaced(experiment, tmp_path):
    out = tmp_path / "design"
    assert livebode("design", experiment, "--out", out).code == 0
    assert "exists already" in livebode("design", experiment, "--out", out).err
    assert livebode("design", experiment, "--out", out, "--amplitude", "0.5", "--force").code == 0
    assert json.loads((out / "design.json").read_text())["excitation"]["amplitude_n_m"] == 0.5
    done = livebode("design", experiment, "--out", out, "--accuracy", "0.002", "--force", "--json")
    assert max(json.loads(done.out)["bound_95_relative"]) <= 0.002
    (out / "log.parquet").write_text("an afternoon")
    assert "also contains 'log.parquet'" in livebode("design", experiment, "--out", out, "--force").err
    assert (out / "log.parquet").read_text() == "an afternoon"
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "thesis.txt").write_text("years")
    assert "not the directory of an earlier design" in livebode("design", experiment, "--out", mine, "--force").err
    assert (mine / "thesis.txt").read_text() == "years"


def test_a_recording_may_not_be_named_as_a_file_of_the_design(experiment, tmp_path):
    whole = experiment.read_text()
    for log, words in (("excitation.csv", "a file of the design"), ("", "cannot be the file of a recording")):
        experiment.write_text(f'log = "{log}"\n{whole}')
        assert words in livebode("design", experiment, "--out", tmp_path / "design").err


def test_a_design_may_be_replaced_from_within(experiment, tmp_path, monkeypatch):
    out = tmp_path / "design"
    assert livebode("design", experiment, "--out", out).code == 0
    monkeypatch.chdir(out)
    done = livebode("design", experiment, "--out", ".", "--force")
    assert done.code == 0, done.err
    assert (out / "design.json").is_file()


def test_a_disk_that_refuses_leaves_nothing(experiment, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    done = livebode("design", experiment, "--out", blocked / "design")
    assert done.code == 2
    assert "could not be written" in done.err


@settings(max_examples=FILES, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.dictionaries(
        st.sampled_from(["band_hz", "resolution_hz", "window", "kind", "amplitude_n_m", "seed", "order", "periods"]),
        st.one_of(st.integers(-3, 50), st.floats(allow_nan=True), st.text(max_size=5), st.booleans(),
                  st.lists(st.integers(1, 300), max_size=3)),
        max_size=5,
    )
)  # fmt: skip
def test_anything_in_a_file_ends_in_a_design_or_a_sentence(excitation):
    data = {"band_hz": [20, 140], "resolution_hz": 20, "phases": "schroeder"} | excitation

    def design():
        asked = Experiment.of({"excitation": data, "belt": {}}, "here")
        choose(asked.spec(), MACHINE, asked.machine_limits())

    assert "\n" not in str(refusal(design))
