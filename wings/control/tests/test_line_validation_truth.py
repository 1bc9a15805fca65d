"""Models judged at the lines of another run: responses of a known machine, and a double integrator that drifts."""

from __future__ import annotations

import json
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from livebode.core import Lines, Response, SignalError
from livebode.excitation import multisine
from livebode.fitting import Fit, fit
from livebode.simulation import BeltAxis
from livebode_control.validation.line_validation import fitted_model, validate_at_lines
from livebode_control.validation.validation import Verdict
from tests.support.command import livebode, write_parquet

LINES = Lines.parse("20:120:5", rate_hz=4000, window=800)


def noisy(seed: int, *, stiffness: float = 1.0, dof: float = np.inf, share: float = 0.01) -> Response:
    """The belt axis with noise of a share of |G|; with finite dof the sigma is that of a sample."""
    axis = BeltAxis()
    truth = axis.linear(0.8).sampled(4000.0).response(LINES.frequency_hz / np.sqrt(stiffness))
    rng, ones = np.random.default_rng(seed), np.ones(len(LINES))
    sigma = share * np.abs(truth)
    noise = (rng.standard_normal(len(LINES)) + 1j * rng.standard_normal(len(LINES))) * sigma / np.sqrt(2)
    if np.isfinite(dof):
        sigma = sigma * np.sqrt(rng.gamma(dof, 1 / dof, len(LINES)))
    return Response(LINES, truth + noise, sigma, dof, ones, ones > 0, 0, 799, 0.1)


@pytest.fixture(scope="module")
def fits() -> list[Fit]:
    return [fit(noisy(seed), "two-mass", radius_m=0.019) for seed in range(8)]


@pytest.mark.parametrize("dof", [np.inf, 8.0])
def test_a_true_model_passes_on_other_data_as_often_as_its_level(fits: list[Fit], dof: float) -> None:
    """8 fits on 25 responses each: 3 % are rejected; more than 8 % of 200 by chance once in 10,000 campaigns."""
    found = [
        validate_at_lines(fitted_model(of), noisy(1000 + 25 * i + k, dof=dof), reason="a test")
        for i, of in enumerate(fits)
        for k in range(25)
    ]
    assert np.mean([one.verdict != "passes" for one in found]) < 0.08
    assert max(one.resolution for one in found) < 0.02


@pytest.mark.parametrize(("stiffness", "verdict"), [(1.02, "small error"), (1.3, "fails")])
def test_a_machine_that_changed_is_told_by_the_size_of_its_error(
    fits: list[Fit], stiffness: float, verdict: str
) -> None:
    changed = noisy(7, stiffness=stiffness)
    found = validate_at_lines(fitted_model(fits[0]), changed, reason="a test")
    assert found.verdict == verdict
    ours, theirs = fits[0].response(LINES.frequency_hz), noisy(8, stiffness=stiffness, share=0.0).value
    apart = np.abs(theirs - ours) / np.maximum(np.abs(ours), np.abs(theirs))
    assert found.missed == pytest.approx(np.sqrt(np.mean(apart**2)), rel=0.05)
    assert found.worst[0] in LINES.frequency_hz


def test_noise_as_large_as_the_response_cannot_judge(fits: list[Fit]) -> None:
    assert validate_at_lines(fitted_model(fits[0]), noisy(3, share=3.0), reason="a test").verdict == "cannot be judged"


def test_lines_outside_the_band_of_the_fit_or_another_rate_are_refused(fits: list[Fit]) -> None:
    lines = Lines.parse("200:400:50", rate_hz=4000, window=800)
    ones = np.ones(len(lines))
    other = Response(lines, 1j * ones, 0.1 * ones, np.inf, ones, ones > 0, 0, 799, 0.1)
    with pytest.raises(SignalError, match="0 valid lines"):
        validate_at_lines(fitted_model(fits[0]), other, reason="a test")
    lines = Lines.parse("20:120:5", rate_hz=2000, window=400)
    ones = np.ones(len(lines))
    with pytest.raises(SignalError, match="fitted at 4000 Hz"):
        validate_at_lines(
            fitted_model(fits[0]),
            Response(lines, 1j * ones, ones, np.inf, ones, ones > 0, 0, 399, 0.1),
            reason="a test",
        )


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two recordings of a rigid axis in position control with a slowly moving load, and a run on the first."""
    folder, rate_hz, window = tmp_path_factory.mktemp("drift"), 500.0, 500
    grid = "4:60:4"
    period = multisine(Lines.parse(grid, rate_hz, window))
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        w = np.resize(np.roll(period, 37 * seed), 20 * window)
        load = np.cumsum(rng.standard_normal(w.size)) * 0.005
        x, v, u, y = 0.0, 0.0, np.empty(w.size), np.empty(w.size)
        for i in range(w.size):
            y[i] = x
            u[i] = w[i] - 300 * x - 20 * v
            force = (u[i] + load[i]) / 2.0 / rate_hz
            x, v = x + v / rate_hz + force / 2 / rate_hz, v + force
        columns = {"w [N m]": w, "u [N m]": u, "y [rad]": y + 1e-6 * rng.standard_normal(w.size)}
        write_parquet(folder / f"log{seed}.parquet", columns)
    found = livebode(
        "run", folder / "log1.parquet", "--output", "y", "--input", "u", "--excitation", "w", "--rate", rate_hz,
        "--lines", grid, "--window", window, "--out", folder / "run",
    )  # fmt: skip
    assert found.code == 0, found.err
    return folder / "run", folder / "log2.parquet"


def test_a_double_integrator_whose_simulation_drifts_is_judged_at_the_lines(recordings: tuple[Path, Path]) -> None:
    run, log = recordings
    found = livebode("validate", run, "--on", log, "--model", "rigid", "--json")
    assert found.code == 0, found.err
    (at_lines,) = json.loads(found.out)["models"]
    assert at_lines["verdict"] == "passes"
    assert "drifts from the recording" in at_lines["sentence"]
    shown = livebode("validate", run, "--on", log, "--model", "rigid").out
    assert [word for word in get_args(Verdict) if f"rigid {word}:" in shown] == ["passes"]
    assert not (run / "validation.svg").exists()
    modes = livebode("validate", run, "--on", log, "--model", "modal")
    assert "a modal model is not simulated" in modes.out


def test_another_run_is_judged_at_its_lines_and_on_request_a_recording(recordings: tuple[Path, Path]) -> None:
    run, log = recordings
    other = livebode("validate", run, "--on", run, "--model", "rigid", "--json")
    assert "is a run, not a recording" in json.loads(other.out)["models"][0]["reason"]
    found = json.loads(livebode("validate", run, "--on", log, "--model", "rigid", "--at-lines", "--json").out)
    assert [one["judged_at"] for one in found["models"]] == ["lines"]
