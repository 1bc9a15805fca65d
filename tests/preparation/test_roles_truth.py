"""Channels in wrong roles are named with what was measured and end with 2; right ones pass on any machine."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from livebode.core import Block, Channel, Gain, Lines, Loop
from livebode.estimation import Settings
from livebode.excitation import multisine
from livebode.preparation import ROLES, beginnings, role_spectra, suspicions
from livebode.preparation.roles import Suspicion
from livebode.simulation import BeltAxis, Drive, Friction, Sensor, SimulatedAxis, Strokes
from livebode.sources import open_log
from tests.support.command import Result, livebode, signals, write_parquet
from tests.support.real_recordings import recording

LINES = Lines.parse("20:140:20", 4000, 400)
LOOP = Drive().loop()
RIGHT = {"excitation": "w", "input": "u", "output": "velocity"}
MACHINES = {
    "standstill": {},
    "strokes": {
        "motion": Strokes(),
        "friction": Friction(load_coulomb_n=15.0),
        "seconds": 12.0,
    },
    "quantised and differenced": {"sensor": Sensor(encoder_counts_per_turn=2**14, velocity_differenced=True)},
    "delayed": {"drive": Drive(delay_ticks=2)},
    "low coherence": {"sensor": Sensor(noise_rad_per_s=0.5), "excitation_n_m": multisine(LINES, 0.1)},
}


@cache
def recorded(machine: str) -> Block:
    usual = {"sensor": Sensor(noise_rad_per_s=0.1), "excitation_n_m": multisine(LINES, 1.0), "seconds": 6.0}
    return SimulatedAxis(BeltAxis(**(usual | MACHINES[machine]))).run()[0]


def suspected(block: Block, estimator: str = "joint", loop: Loop | None = None, **names: str) -> list:
    asked = Settings(lines=LINES, estimator=estimator, loop=loop or Loop(), **names)
    return suspicions({role: block[name] for role in ROLES if (name := asked.channel(role))}, asked)


@pytest.mark.parametrize("machine", MACHINES)
def test_right_roles_are_not_suspected(machine: str) -> None:
    block = recorded(machine)
    inverted = Block(np.vstack([block.data, -block["velocity"]]), (*block.names, "inverted"), block.rate_hz)
    assert not suspected(inverted, **RIGHT)
    assert not suspected(inverted, **RIGHT | {"output": "inverted"})
    assert not suspected(inverted, **RIGHT | {"output": "position"})
    assert not suspected(inverted, "direct", input="u", output="velocity")
    if machine != "delayed":  # the delay is not in this description of the loop
        assert not suspected(inverted, "indirect", LOOP, **RIGHT)


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"input": "velocity", "output": "u"}, "look exchanged"),
        ({"excitation": "x"}, "excitation"),
        ({"estimator": "indirect", "loop": Loop(LOOP.feedback, entry=Gain(10.0))}, "contradicts 'u'"),
        ({"estimator": "indirect", "loop": Loop(LOOP.feedback, entry=Gain(0.1))}, "contradicts 'u'"),
    ],
    ids=["exchanged", "a position as excitation", "ten times the gain", "a tenth of the gain"],
)
def test_wrong_roles_are_certainly_detected(machine: str, wrong: dict, words: str) -> None:
    found = suspected(recorded(machine), **RIGHT | wrong)
    assert any(one.certain and words in one.message for one in found), found


def test_a_description_of_the_loop_without_its_delay_is_doubted_but_not_refused() -> None:
    (found,) = suspected(recorded("delayed"), "indirect", LOOP, **RIGHT)
    assert not found.certain
    assert "contradicts 'u': at 60 Hz" in found.message


@pytest.mark.parametrize("missing", [np.nan, np.inf])
@pytest.mark.parametrize("samples", [1, 250, 400, 3999, 4000])
def test_a_recording_whose_signals_begin_late_is_looked_at_without_a_warning(missing: float, samples: int) -> None:
    lines = Lines.parse("20:140:20", 4000.0, 400)
    w = np.tile(multisine(lines), 10)
    late = np.where(np.arange(w.size) < samples, missing, w)
    described = Settings(lines=lines, output="y", input="u", excitation="w")
    found = role_spectra({"output": late, "input": w, "excitation": late}, described)
    assert (found is None) == (samples > 3200)
    assert found is None or found.exact


def test_exchanged_signals_of_the_direct_estimator_are_seen_by_their_gain() -> None:
    found = suspected(recorded("strokes"), "direct", input="velocity", output="u")
    assert [one.certain for one in found] == [True]
    assert "the output leads the input by" in found[0].message


def ran(tmp_path: Path, columns: dict, *arguments: object) -> Result:
    log = write_parquet(tmp_path / "log.parquet", columns)
    return livebode("run", log, "--lines", "50,100,200", "--window", 100, *arguments, "--out", tmp_path / "run")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--excitation", "w", "--input", "u", "--output", "w"), "'w' is both the excitation and the output"),
        (
            ("--excitation", "w", "--input", "w", "--output", "y"),
            "to 'direct' and name only that input",
        ),
        (
            ("--excitation", "w", "--input", "u", "--output", "copy"),
            "'w' (excitation) and 'copy' (output) have the same samples",
        ),
        (("--excitation", "moved", "--input", "u", "--output", "y"), "'moved' does not repeat like an excitation: 0"),
        (("--input", "noise", "--output", "y", "--estimator", "direct"), "'noise' is noise at all 3 lines"),
    ],
    ids=["output is excitation", "input is excitation", "a copy", "a motion as excitation", "noise under direct"],
)
def test_wrong_roles_end_with_2(tmp_path: Path, arguments: tuple, words: str) -> None:
    columns = signals(samples=4000)
    columns |= {
        "copy": columns["w"],
        "moved": np.cumsum(np.sin(np.arange(4000) / 300)) + columns["y"] / 100,
        "noise": np.random.default_rng(4).standard_normal(4000),
    }
    refused = ran(tmp_path, columns, *arguments)
    assert (refused.code, refused.err.count("\n")) == (2, 1), refused
    assert words in refused.err
    assert "tracking.accept_roles" in refused.err
    assert not (tmp_path / "run").exists()


def test_accepted_roles_run_and_the_record_contains_the_suspicion(tmp_path: Path) -> None:
    columns = signals(samples=4000)
    columns["copy"] = columns["w"]
    arguments = ("--excitation", "w", "--input", "u", "--output", "copy", "--accept-roles")
    done = ran(tmp_path, columns, *arguments)
    assert (done.code, "have the same samples" in done.err) == (0, True)
    assert events(tmp_path) == ["roles-doubtful"]
    assert json.loads((tmp_path / "run" / "run.json").read_text())["configuration"]["tracking"]["accept_roles"]


def events(tmp_path: Path) -> list[str]:
    return [json.loads(line)["kind"] for line in (tmp_path / "run" / "events.jsonl").read_text().splitlines()]


def test_a_doubt_is_an_event_of_the_run_and_printed_behind_it(tmp_path: Path) -> None:
    columns = signals(samples=4000)
    columns["y"] = np.random.default_rng(5).standard_normal(4000)
    done = ran(tmp_path, columns, "--excitation", "w", "--input", "u", "--output", "y")
    assert done.code == 0, done.err
    assert "does not respond to 'w' at any line" in " ".join(done.err.split())
    assert events(tmp_path) == ["roles-doubtful"]


@pytest.mark.parametrize("output", ["theta_mx", "omega_max", "theta_my", "omega_may"])  # the last two inverted
def test_a_real_bench_in_its_right_roles_is_not_suspected_and_exchanged_is(output: str) -> None:
    log = open_log(recording("motorbench/MultisineTypeA.mat"))
    w, u, y = beginnings(log, ["iq_refx", "iq_adx", output], 20 * 2500)
    lines = Lines.parse("11:250:1", 2500, 2500)
    right = Settings(lines=lines, excitation="iq_refx", input="iq_adx", output=output)
    direct = Settings(lines=lines, estimator="direct", input="iq_adx", output=output)
    assert not suspicions({"excitation": w, "input": u, "output": y}, right)
    assert not suspicions({"input": u, "output": y}, direct)
    (found,) = suspicions({"excitation": w, "input": y, "output": u}, right)
    assert found.certain
    assert "gain flat within 3 %" in found.message


def test_a_real_spindle_in_its_right_roles_is_not_suspected() -> None:
    log = open_log(recording("sinumerik/freq_trace.XML"))
    u, y = beginnings(log, ["input", "output"], 2 * 2047)
    asked = Settings(lines=Lines.parse("k=1:300", 8000, 2047), estimator="direct", input="input", output="output")
    assert not suspicions({"input": u, "output": y}, asked)


def test_random_two_mass_machines_in_a_loop_are_not_refused() -> None:
    """Any inertia ratio to 5, any antiresonance, damping, bandwidth and delay, at 1:10 noise over 20 … 140 Hz."""
    rng, refused = np.random.default_rng(0), {1.0: 0, -1.0: 0}
    for _ in range(250):
        for sign in refused:
            refused[sign] += any(one.certain for one in _suspected_of_random_machine(rng, sign))
    assert refused == {1.0: 0, -1.0: 0}


def _suspected_of_random_machine(rng: np.random.Generator, sign: float) -> list[Suspicion]:
    """The channels have names that say nothing."""
    ratio, zeta, delay = rng.uniform(0.2, 5.0), rng.uniform(0.01, 0.2), rng.integers(0, 5)
    notch_hz = np.exp(rng.uniform(np.log(15.0), np.log(200.0)))
    loop_hz, position = rng.uniform(1.0, min(20.0, notch_hz / 2)), rng.integers(0, 2)
    n = 20 * 400
    s = 2j * np.pi * np.fft.rfftfreq(n, 1 / 4000)
    s[0] = 1e-9
    top_hz = notch_hz * np.sqrt(1 + ratio)
    zero, pole = (s**2 / w**2 + 2 * zeta * s / w + 1 for w in 2 * np.pi * np.array([notch_hz, top_hz]))
    plant = zero / pole / s
    loop = 2 * np.pi * loop_hz * np.exp(-s * (delay + 0.5) / 4000)
    w = np.resize(multisine(LINES), n)
    u = np.fft.irfft(np.fft.rfft(w) / (1 + plant * loop), n)
    y = sign * np.fft.irfft(np.fft.rfft(u) * plant * np.exp(-s * (delay + 0.5) / 4000) / (s if position else 1), n)
    noisy = [x + 0.1 * np.std(x) * rng.standard_normal(n) for x in (u, y)]
    names = {"excitation": "ai0", "input": "ai1", "output": "ai2"}
    return suspected(Block(np.array([w, *noisy]), tuple(names.values()), 4000.0), **names)


LABELS = [
    (Channel("ai1", "N"), Channel("ai2", "m/s²")),
    (Channel("ai1"), Channel("ai2", "g")),
    (Channel("ai1"), Channel("Acc_wing")),
    (Channel("ai1"), Channel("-xAcceleration")),
    (Channel("ai1", "V"), Channel("ai2", "V", "acceleration")),
]


def structure(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Voltage of a shaker, force and acceleration of a structure with up to four modes; the force drops at them."""
    n = 20 * 400
    s = 2j * np.pi * np.fft.rfftfreq(n, 1 / 4000)
    mobility = rng.uniform(0.0, 1.0) / np.where(s == 0, 1e-9, s)
    for f_hz in np.exp(rng.uniform(np.log(15.0), np.log(600.0), rng.integers(1, 5))):
        mode = 2 * np.pi * f_hz
        mobility = mobility + rng.choice([1.0, 1.0, -1.0]) * s / (
            s**2 + 2 * rng.uniform(0.005, 0.05) * mode * s + mode**2
        )
    voltage = np.resize(multisine(LINES), n)
    w = np.fft.rfft(voltage)
    force = w / (1 + 10 ** rng.uniform(-1, 2) * np.where(s == 0, 0, mobility))
    signals = [np.fft.irfft(x, n) for x in (force, force * mobility * s)]
    return voltage, *(x + 0.02 * np.std(x) * rng.standard_normal(n) for x in signals)


def test_an_acceleration_over_a_force_is_not_exchanged_and_without_a_name_at_most_doubted() -> None:
    rng, doubted = np.random.default_rng(13), 0
    for number in range(60):
        w, u, y = structure(rng)
        for channels in (LABELS[number % len(LABELS)], (Channel("ai1"), Channel("ai2"))):
            of = {"input": channels[0].name, "output": channels[1].name}
            direct = Settings(lines=LINES, estimator="direct", **of)
            shaken = Settings(lines=LINES, excitation="ai0", **of)
            found = suspicions({"input": u, "output": y}, direct, channels)
            found += suspicions({"excitation": w, "input": u, "output": y}, shaken, channels)
            exchanged = [one for one in found if "exchanged" in one.message]
            assert not any(one.certain for one in exchanged), (number, exchanged)
            assert (channels[1].name == "ai2" and not channels[1].unit) or not exchanged
            doubted += bool(exchanged)
    assert doubted > 20


def test_a_window_that_is_no_multiple_of_the_period_is_answered_with_the_period(tmp_path: Path) -> None:
    lines = Lines.parse("4:199:3", 4000, 4000)
    w = np.tile(multisine(lines, 1.0), 8)
    y = np.convolve(w, np.exp(-np.arange(200) / 20))[: len(w)]
    columns = {"t": np.arange(len(w)) / 4000, "w": w, "u": w - 0.1 * y, "y": y}
    write_parquet(tmp_path / "log.parquet", columns)
    roles = ("--excitation", "w", "--input", "u", "--output", "y", "--out", tmp_path / "run")
    refused = livebode("run", tmp_path / "log.parquet", *roles, "--window", 400)
    assert refused.code == 2
    assert "it repeats every 4000 samples: choose a multiple of them as window" in refused.err
    assert livebode("run", tmp_path / "log.parquet", *roles, "--window", 4000).code == 0
