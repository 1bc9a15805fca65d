"""Roles are proposed for channels whose names say nothing, on machines whose roles are known from their simulation."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from livebode.core import Block, Lines
from livebode.excitation import multisine
from livebode.preparation import Proposals
from livebode.simulation import BeltAxis, Drive, Friction, Sensor, SimulatedAxis, Strokes
from livebode.sources import open_log
from tests.support.command import write_parquet

LINES = Lines.parse("20:140:20", 4000, 400)
MACHINES = {
    "standstill": {},
    "strokes": {"motion": Strokes(), "friction": Friction(load_coulomb_n=15.0), "seconds": 12.0},
    "quantised": {"sensor": Sensor(encoder_counts_per_turn=2**14, velocity_differenced=True)},
    "delayed": {"drive": Drive(delay_ticks=2)},
    "low coherence": {"sensor": Sensor(noise_rad_per_s=0.5), "excitation_n_m": multisine(LINES, 0.1)},
}
RNG = np.random.default_rng(7)
SAMPLES = 48000
SECONDS = np.arange(SAMPLES) / 4000
EXCITATIONS = {
    "noise": 0.05 * RNG.standard_normal(SAMPLES),
    "single chirp": 0.05 * np.sin(2 * np.pi * (2 * SECONDS + 8 * SECONDS**2)),
    "multisine with noise": np.resize(multisine(LINES, 0.05), SAMPLES) + 1e-3 * RNG.standard_normal(SAMPLES),
}


@cache
def recorded(machine: str) -> Block:
    usual = {"sensor": Sensor(noise_rad_per_s=0.1), "excitation_n_m": multisine(LINES, 1.0), "seconds": 6.0}
    return SimulatedAxis(BeltAxis(**(usual | MACHINES[machine]))).run()[0]


def closed_loop(w: np.ndarray, gain: float, inertia: float = 0.0037, noise: float = 2e-3) -> dict[str, np.ndarray]:
    """A rigid motor with a low-pass filter, at 4 kHz, under a P controller of its speed."""
    u, y, speed = np.zeros(w.size), np.zeros(w.size), 0.0
    disturbed = noise * RNG.standard_normal(w.size)
    for i in range(w.size):
        y[i] = speed + disturbed[i]
        u[i] = w[i] - gain * y[i]
        speed += (u[i] - 1e-3 * speed) / (inertia * 4000)
    return {"w": w, "u": u, "y": y}


def proposed(folder: Path, named: dict[str, np.ndarray], order: list[str]) -> dict[str, str | None]:
    """Roles of channels that are named by numbers, in this order, by the names that they had."""
    numbers = {name: f"Ch{number}" for number, name in enumerate(order)}
    columns = {"time [s]": np.arange(len(named[order[0]])) / 4000} | {numbers[name]: named[name] for name in order}
    names = {number: name for name, number in numbers.items()}
    roles = Proposals(open_log(write_parquet(folder / "log.parquet", columns))).roles()
    return {role: None if guess.channel is None else names[guess.channel] for role, guess in roles.items()}


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("reverse", [False, True])
def test_numbered_channels_of_a_machine_get_its_roles(machine: str, reverse: bool, tmp_path: Path) -> None:
    block = recorded(machine)
    named = {name: block[name] for name in block.names if name in ("w", "u", "velocity", "position", "x")}
    named |= {"temperature": np.cumsum(RNG.standard_normal(len(block))), "zero": np.zeros(len(block))}
    order = sorted(named, reverse=reverse)
    roles = proposed(tmp_path, named, order)
    assert [roles[role] for role in ("excitation", "input", "output")] == ["w", "u", "velocity"]


@pytest.mark.parametrize("excitation", EXCITATIONS)
@pytest.mark.parametrize("gain", [0.08, 0.5])
@pytest.mark.parametrize("order", ["wuy", "yuw"])
def test_an_excitation_that_does_not_repeat_exactly_is_distinguished_from_what_follows_it(
    excitation: str, gain: float, order: str, tmp_path: Path
) -> None:
    roles = proposed(tmp_path, closed_loop(EXCITATIONS[excitation], gain), list(order))
    assert [roles[role] for role in ("excitation", "input", "output")] == ["w", "u", "y"]


@pytest.mark.parametrize("excitation", EXCITATIONS)
def test_of_an_open_loop_the_cause_is_the_input(excitation: str, tmp_path: Path) -> None:
    named = closed_loop(EXCITATIONS[excitation], 0.0)
    roles = proposed(tmp_path, {name: named[name] for name in "uy"}, ["y", "u"])
    assert [roles[role] for role in ("excitation", "input", "output")] == [None, "u", "y"]


def test_noise_that_is_unrelated_gets_no_role(tmp_path: Path) -> None:
    named = {name: RNG.standard_normal(SAMPLES) for name in "abc"}
    assert set(proposed(tmp_path, named, list("abc")).values()) == {None}


def test_time_and_counters_are_no_channels_also_where_they_wrap_or_jitter(tmp_path: Path) -> None:
    named = closed_loop(EXCITATIONS["noise"], 0.08)
    number = np.arange(SAMPLES)
    columns = {
        "time [s]": SECONDS + 1e-6 * RNG.uniform(-1, 1, SAMPLES),
        "Sample": number, "Counter": number % 65536, "Byte": number % 256,
    } | named  # fmt: skip
    proposals = Proposals(open_log(write_parquet(tmp_path / "log.parquet", columns)))
    assert [channel.name for channel in proposals.channels] == ["w", "u", "y"]


def test_a_second_speed_that_its_name_does_not_distinguish_is_listed_as_suitable_too(tmp_path: Path) -> None:
    block = recorded("standstill")
    columns = {"t [s]": np.arange(len(block)) / 4000, "w [N m]": block["w"], "u [N m]": block["u"]}
    columns |= {"speed1 [rad/s]": block["velocity"], "speed2 [rad/s]": np.gradient(block["x"]) * 4e4}
    proposals = Proposals(open_log(write_parquet(tmp_path / "log.parquet", columns)))
    guess = proposals.roles()["output"]
    assert {guess.channel, *guess.others} == {"speed1", "speed2"}
    assert proposals.roles({"output": "speed2"})["input"].channel == "u"
