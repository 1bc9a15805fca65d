"""Friction found from strokes: known friction within its bounds, and the benchmark of a real axis."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from livebode.core import Block, Channel, SignalError, UsageError
from livebode.motion import FrictionCurve, friction_curve
from livebode_control.strokes.friction import FrictionReport, friction_of
from livebode_control.strokes.motion_samples import MotionSamples
from studies.friction import CASES, STRIBECK, measured, truth
from tests.support.command import livebode
from tests.support.real_recordings import recording

RATE_HZ = 1000.0
MASS, COULOMB, VISCOUS, OFFSET = 95.0, 20.0, 200.0, -3.0
SPEEDS = (0.02, 0.05, 0.1, 0.2)


def _speed() -> NDArray[np.float64]:
    """Strokes there and back with rounded ramps, after standstill."""
    once = np.concatenate([np.repeat([v, -v], 1500) for v in SPEEDS] + [np.zeros(1000)])
    ramp = np.hanning(300)
    return np.convolve(np.tile(once, 2), ramp / ramp.sum(), mode="same")


def _block(seed: int, slope: float = 0.0) -> Block:
    """A rigid axis under a force that has noise with a memory of 50 ms; `slope` of the Coulomb friction, N/m."""
    v = _speed()
    x = np.concatenate([[0.0], np.cumsum((v[1:] + v[:-1]) / 2)]) / RATE_HZ
    noise = np.random.default_rng(seed).normal(size=v.size)
    memory = np.exp(-np.arange(400) / 50)
    disturbance = np.convolve(noise, memory / np.linalg.norm(memory))[: v.size]
    force = MASS * np.gradient(v) * RATE_HZ + VISCOUS * v + (COULOMB + slope * x) * np.sign(v) + OFFSET + disturbance
    steps = np.round(x / 1e-6) * 1e-6
    return Block([force, steps], (Channel("F", "N"), Channel("x", "m")), RATE_HZ)


def _curve(block: Block, **options: int) -> FrictionCurve:
    return friction_curve(block, input="F", output="x", kind="position", **options)


def test_friction_bounds_cover_the_truth_although_residuals_are_correlated() -> None:
    true = {"inertia": MASS, "viscous": VISCOUS, "coulomb": COULOMB, "offset": OFFSET}
    curves = [_curve(_block(seed)) for seed in range(40)]
    assert {curve.names for curve in curves} == {("inertia", "viscous", "offset", "coulomb")}
    error = np.array([np.abs(curve.value - [true[name] for name in curve.names]) for curve in curves])
    for probability, low, high in ((0.632, 0.52, 0.74), (0.982, 0.95, 1.0)):
        share = np.mean(error <= [curve.bound(probability) for curve in curves])
        print(f"{100 * share:.1f} % within the bound of {100 * probability:.1f} %")
        assert low <= share <= high


def test_friction_over_the_position_is_found() -> None:
    curve = _curve(_block(1, slope=40.0), places=3)
    names = [f"coulomb_{j + 1}" for j in range(3)]
    error = [curve[name] - (COULOMB + 40.0 * at) for name, at in zip(names, curve.places)]
    assert np.all(np.abs(error) <= [1.5 * curve.bound(0.99)[curve.index(name)] for name in names])
    assert curve["coulomb_3"] - curve["coulomb_1"] > 5
    assert curve.units[curve.index("coulomb_1")] == "N"
    assert curve.units[curve.index("viscous")] == "N/(m/s)"


def test_stribeck_friction_of_the_simulated_axis_is_found() -> None:
    curve, true = measured(CASES["with Stribeck"], seed=1), truth(STRIBECK)
    for name in curve.names:
        assert abs(curve[name] - true[name]) <= 1.3 * curve.bound(0.99)[curve.index(name)]
    assert curve["stribeck"] == pytest.approx(true["stribeck"], rel=0.2)


def test_friction_of_one_direction_or_one_speed_is_refused() -> None:
    block = _block(0)
    with pytest.raises(SignalError, match="forward for 0 smoothed samples"):
        _curve(Block([block["F"], -np.abs(np.cumsum(np.abs(_speed())))], block.channels, RATE_HZ))
    with pytest.raises(UsageError, match="places=1 is out of its range"):
        _curve(block, places=1)


def test_friction_of_emps_is_that_of_the_benchmark() -> None:
    path = str(recording("emps/DATA_EMPS.mat"))
    done = livebode("friction", path, "--input", "35.15065188248547*vir", "--position", "qm", "--json")
    found = json.loads(done.out)["parameters"]
    print({name: (one["value"], one["bound"]) for name, one in found.items()})
    assert found["coulomb"]["value"] == pytest.approx(20.39, rel=0.03)
    assert found["viscous"]["value"] == pytest.approx(203.5, rel=0.03)
    assert found["inertia"]["value"] == pytest.approx(95.11, rel=0.01)
    assert abs(found["offset"]["value"] + 3.165) <= found["offset"]["bound"]


def test_friction_that_is_not_described_ends_in_a_sentence() -> None:
    done = livebode("friction", str(recording("emps/DATA_EMPS.mat")), "--input", "vir", "--json")
    assert done.code == 2
    assert json.loads(done.err)["error"]["facts"]["argument"] == "position"


def test_strokes_slower_than_the_speed_of_standstill_are_left_out(tmp_path: Path) -> None:
    block = _block(0)
    table = np.column_stack([np.arange(len(block)) / RATE_HZ, block["F"], block["x"]])
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header="time,F,x", comments="", fmt="%.17g")
    options = ("--input", "F", "--position", "x", "--json", "--slowest", 0.03)
    found = json.loads(livebode("friction", tmp_path / "log.csv", *options).out)
    usual = json.loads(livebode("friction", tmp_path / "log.csv", *options[:-2]).out)
    slow = 2 * 3000 / len(block)  # the strokes of 0.02 m/s
    assert (found["excluded"] - usual["excluded"]) / (usual["samples"] + usual["excluded"]) == pytest.approx(
        slow, abs=0.06
    )
    for name, true in (("coulomb", COULOMB), ("viscous", VISCOUS)):
        assert abs(found["parameters"][name]["value"] - true) <= 1.5 * found["parameters"][name]["bound"]


def test_a_part_of_the_recording_is_what_another_program_cuts_from_it(tmp_path: Path) -> None:
    block = _block(0)
    names = [channel.name for channel in block.channels]

    def read(path: Path, first: int, stop: int, *more: object) -> Any:
        t = np.arange(first, stop) / RATE_HZ
        table = np.column_stack([t, *(block[name][first:stop] for name in names)])
        np.savetxt(path, table, delimiter=",", header=",".join(["time", *names]), comments="", fmt="%.17g")
        done = livebode("friction", path, "--input", "F", "--position", "x", "--json", *more)
        assert done.code == 0, done.err
        return json.loads(done.out)["parameters"]

    half = len(block) // 2
    whole = read(tmp_path / "a.csv", 0, len(block), "--from", f"{len(block) - half} samples")
    assert whole == read(tmp_path / "b.csv", len(block) - half, len(block))
    refused = livebode("friction", tmp_path / "a.csv", "--input", "F", "--position", "x", "--to", "3 periods")
    assert refused.code == 2
    assert "no periods" in refused.err


def _written(block: Block, path: Path) -> Path:
    table = np.column_stack([np.arange(len(block)) / RATE_HZ, block["F"], block["x"]])
    np.savetxt(path, table, delimiter=",", header="time,F,x", comments="", fmt="%.17g")
    return path


@pytest.mark.parametrize("given", ["-F", "0.5*F - 1.5*F"])
def test_a_negative_friction_is_refused_with_the_input_that_gives_the_positive_one(given: str, tmp_path: Path) -> None:
    log = _written(_block(0), tmp_path / "log.csv")
    refused = livebode("friction", log, "--input", given, "--position", "x", "--json")
    assert refused.code == 2
    error = json.loads(refused.err)["error"]
    assert error["code"] == "signal.friction-negative"
    assert error["facts"]["coulomb"] < -15
    option, value = shlex.split(error["remedy"].removeprefix("give ").partition(", or ")[0])
    found = json.loads(livebode("friction", log, option, value, "--position", "x", "--json").out)
    assert abs(found["parameters"]["coulomb"]["value"] - COULOMB) <= 1.5 * found["parameters"]["coulomb"]["bound"]
    assert found["notes"] == []


def test_a_friction_that_noise_hides_is_reported_as_not_shown() -> None:
    """No friction under noise of 50 N: of 12 runs, at most 2 are refused as negative (1 % expected)."""
    refused = 0
    for seed in range(12):
        rng, v = np.random.default_rng([seed, 1]), _speed()
        block = Block([50 * rng.standard_normal(v.size), _block(0)["x"]], _block(0).channels, RATE_HZ)
        try:
            report = _report(block)
        except SignalError:
            refused += 1
            continue
        assert all(f"the {name} is " in " ".join(report.notes) for name in ("inertia", "coulomb", "viscous"))
    assert refused <= 2


def _report(block: Block) -> FrictionReport:
    return friction_of(MotionSamples(block, "F", "x", "position", len(block), None, {}, None))
