"""A crane, an aircraft and an electric circuit: no physical model of a drive fits, modes and poles do."""

from __future__ import annotations

import json
from pathlib import Path

import control
import numpy as np
import pytest
from numpy.typing import NDArray

from livebode.analysis import averaged
from livebode.core import Lines
from livebode.excitation import multisine
from livebode.records import RunRecord
from tests.support.command import livebode, write_parquet

Floats = NDArray[np.float64]


def driven(system: control.StateSpace, u: Floats, rate_hz: float) -> Floats:
    """Outputs (outputs, samples) of a system behind a zero-order hold."""
    sampled = control.sample_system(system, 1 / rate_hz)
    return np.atleast_2d(control.forced_response(sampled, U=u).outputs)


def run(log: Path, out: Path, *options: object) -> list[Path]:
    """Directories of the runs, one for each output."""
    found = livebode("run", log, *options, "--estimator", "direct", "--accept-roles", "--out", out, "--json")
    assert found.code == 0, found.err
    return [out] if (out / "run.json").exists() else sorted(out.iterdir())


def fit(runs: list[Path], *options: object) -> tuple[int, dict[str, object]]:
    found = livebode("fit", *runs, *options, "--json")
    return found.code, json.loads(found.out)


@pytest.fixture(scope="module")
def aircraft(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Elevator to pitch rate, angle of attack and normal acceleration: one short period, without integrators."""
    rate_hz, window = 50.0, 1000
    lines = Lines.parse("0.2:6:0.2", rate_hz, window)
    u = np.resize(multisine(lines), 9 * window)
    a, b = np.array([[-1.0, 0.96], [-16.0, -1.5]]), np.array([[-0.1], [-12.0]])
    system = control.ss(a, b, np.array([[0.0, 1.0], [1.0, 0.0], [-15.0, 0.0]]), np.array([[0.0], [0.0], [-1.5]]))
    y = driven(system, u, rate_hz)
    y += 0.002 * np.random.default_rng(1).standard_normal(y.shape) * y.std(axis=1, keepdims=True)
    columns = {"de [deg]": u, "q [deg/s]": y[0], "alpha [deg]": y[1], "az": y[2]}
    folder = tmp_path_factory.mktemp("aircraft")
    log = write_parquet(folder / "log.parquet", columns)
    options = ("--input", "de", "--rate", rate_hz, "--lines", "0.2:6:0.2", "--window", window)
    return run(log, folder / "runs", "--output", "q", "--output", "alpha", "--output", "az", *options)


def test_three_outputs_of_an_aircraft_share_their_short_period(aircraft: list[Path]) -> None:
    assert [one.name for one in aircraft] == ["alpha", "az", "q"]
    omega = np.sqrt(1.0 * 1.5 + 0.96 * 16.0)
    code, found = fit(aircraft, "--model", "modal")
    assert (code, found["order"]) == (0, 1)
    assert not (aircraft[2] / "stabilisation.svg").exists()
    fit(aircraft[2:], "--model", "modal", "--order", 1)
    assert "Stabilisation" not in (chart := (aircraft[2] / "stabilisation.svg").read_text())
    assert "order of the model" in chart
    for name, truth in (("frequency_1", omega / (2 * np.pi)), ("damping_1", 2.5 / (2 * omega))):
        quantity = found["quantities"][name]
        assert abs(quantity["value"] - truth) < 2 * quantity["bound_95"]
        assert quantity["bound_95"] < 0.05 * truth


def test_several_runs_or_an_order_need_modal_or_rational_and_options_of_a_drive_are_refused(
    aircraft: list[Path],
) -> None:
    assert "several runs cannot be combined with a physical model" in livebode("fit", *aircraft).err
    assert "--order cannot be combined" in livebode("fit", aircraft[0], "--order", 2).err
    assert (
        "the model 'modal' has no option 'side'" in livebode("fit", *aircraft, "--model", "modal", "--side", "load").err
    )
    assert "finished runs only" in livebode("margins", aircraft[0], "--model", "modal").err
    assert "more than once" in livebode("fit", aircraft[0], aircraft[0], "--model", "modal").err


def test_a_circuit_with_a_slight_cubic_spring_ends_in_one_mode(tmp_path: Path) -> None:
    """As Silverbox: m·y'' + d·y' + k·y + k3·y³ = u at 610 Hz, 65 Hz, in 160 lines; a drive does not fit."""
    rate_hz, window, finer = 610.35, 1024, 4
    lines = [i * rate_hz / window for i in range(8, 328, 2)]
    words = ",".join(f"{f:.9g}" for f in lines)
    u = np.resize(multisine(Lines.parse(words, rate_hz, window)), 5 * window)
    omega, damping = 2 * np.pi * 65.0, 0.05
    system = control.ss([[0, 1], [-(omega**2), -2 * damping * omega]], [[0], [omega**2]], [[1, 0]], [[0]])
    step = control.sample_system(system, 1 / (finer * rate_hz))
    (a, b), (c, d), (e, f) = *step.A.tolist(), step.B[:, 0].tolist()
    y, v, found = 0.0, 0.0, []
    for force in (u / u.std()).tolist():
        found.append(y)
        for _ in range(finer):
            drive = force - 0.0005 * y**3
            y, v = a * y + b * v + e * drive, c * y + d * v + f * drive
    noise = 1e-3 * np.random.default_rng(2).standard_normal(u.size)
    log = write_parquet(tmp_path / "log.parquet", {"u [V]": u / u.std(), "y [V]": noise + found})
    options = ("--output", "y", "--input", "u", "--rate", rate_hz, "--lines", words, "--window", window)
    runs = run(log, tmp_path / "run", *options)
    code, drive_fit = fit(runs, "--output", "position")
    assert code == 3
    assert "--model modal" in drive_fit["remarks"][-1]
    code, poles = fit(runs, "--model", "modal")
    assert (code, poles["order"]) == (0, 1)
    # The cubic spring stiffens by 3·k3·E[y²] (Gaussian linearisation), a few percent of the frequency at most.
    stiffer = 0.5 * 3 * 0.0005 * np.mean(np.square(found))
    assert poles["quantities"]["frequency_1"]["value"] == pytest.approx(65.0 * (1 + stiffer), rel=0.01)


def test_the_trolley_and_the_angle_of_a_crane_share_a_pendulum_in_closed_loop(tmp_path: Path) -> None:
    """Force on a trolley with a load on a rope, position controlled: a double integrator and a pendulum of 0.45 Hz."""
    rate_hz, window = 50.0, 2000
    lines = Lines.parse("0.05:1:0.05,1.2:4:0.2", rate_hz, window)
    w = np.resize(multisine(lines), 8 * window)
    trolley_kg, load_kg, rope_m, gravity, damping = 2.0, 0.6, 1.6, 9.81, 0.01
    square = gravity / rope_m * (1 + load_kg / trolley_kg)
    a = np.zeros((4, 4))
    a[0, 1] = a[2, 3] = 1
    a[1, 2] = load_kg * gravity / trolley_kg
    a[3, 2:] = -square, -2 * damping * np.sqrt(square)
    b = np.array([[0.0], [1 / trolley_kg], [0.0], [-1 / trolley_kg / rope_m]])
    step = control.sample_system(control.ss(a, b, np.eye(4), np.zeros((4, 1))), 1 / rate_hz)
    rng = np.random.default_rng(3)
    x, u, y = np.zeros(4), np.empty(w.size), np.empty((2, w.size))
    for i in range(w.size):
        y[:, i] = x[[0, 2]]
        u[i] = w[i] - 0.5 * x[0] - 1.5 * x[1]
        x = step.A @ x + step.B[:, 0] * u[i]
    y += 1e-4 * rng.standard_normal(y.shape) * y.std(axis=1, keepdims=True)
    columns = {"w [N]": w, "u [N]": u, "x [m]": y[0], "angle [rad]": y[1]}
    log = write_parquet(tmp_path / "log.parquet", columns)
    options = ("--input", "u", "--excitation", "w", "--rate", rate_hz, "--lines", "0.05:1:0.05,1.2:4:0.2")
    options = (*options, "--window", window, "--skip-periods", 4)
    found = livebode("run", log, "--output", "x", "--output", "angle", *options, "--out", tmp_path / "runs", "--json")
    assert found.code == 0
    runs = sorted((tmp_path / "runs").iterdir())
    code, poles = fit(runs, "--model", "modal")
    assert (code, poles["order"], poles["integrators"]) == (0, 1, 2)
    rigid = 1 / (trolley_kg + load_kg)
    for name, truth in (("frequency_1", np.sqrt(square) / (2 * np.pi)), ("damping_1", damping), ("1/s² x", rigid)):
        quantity = poles["quantities"][name]
        assert abs(quantity["value"] - truth) < 2 * quantity["bound_95"]
        assert quantity["bound_95"] < 0.05 * truth


def test_the_span_of_a_run_begins_at_its_first_valid_response(tmp_path: Path) -> None:
    """The first windows begin before the recording: the effective time of the first response is negative."""
    u = np.resize(multisine(Lines.parse("2:20:2", 100.0, 400)), 2000)
    noise = 1e-3 * np.random.default_rng(4).standard_normal(2000)
    log = write_parquet(tmp_path / "log.parquet", {"u": u, "y": np.concatenate([[0.0], u[:-1]]) + noise})
    options = ("--input", "u", "--rate", 100, "--lines", "2:20:2", "--window", 400, "--hop", 20, "--all-periods")
    (directory,) = run(log, tmp_path / "run", "--output", "y", *options)
    record = RunRecord.open(directory)
    every = np.concatenate([part.time_s for part in record.batches()])
    valid = np.concatenate([part.valid.any(axis=1) for part in record.batches()])
    assert every[0] < 0
    assert averaged(record).spans_s[0] == every[valid][0] > 0
