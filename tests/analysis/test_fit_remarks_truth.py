"""`livebode fit` names the quantity that it took for the output, and finds an output that is inverted."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from livebode.analysis import averaged, fit_averaged, plain_fit
from livebode.configuration import Axis, FitSection
from livebode.core import Lines, Response
from livebode.excitation import multisine
from livebode.fitting import fit
from livebode.records import RunRecord
from livebode.runtime import Destination, run
from livebode.simulation import BeltAxis
from tests.support.command import livebode, write_parquet

RATE_HZ, WINDOW = 4000, 400
INERTIA = 0.01
GRID = {"frequencies": "20:140:20", "window": WINDOW}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A rigid axis behind a zero-order hold, and the same velocity and position with the other sign."""
    rng = np.random.default_rng(4)
    w = np.resize(multisine(Lines.parse("20:140:20", RATE_HZ, WINDOW)), 20 * WINDOW)
    w -= w[:WINDOW].mean()
    velocity = np.concatenate([[0.0], np.cumsum(w)[:-1]]) / RATE_HZ / INERTIA
    velocity += 1e-4 * rng.standard_normal(w.size)
    columns = {"w [N m]": w, "speed [rad/s]": velocity, "bare": velocity, "turned [rad/s]": -velocity}
    return write_parquet(tmp_path_factory.mktemp("rigid") / "log.parquet", columns)


def fitted(log: Path, out: Path, output: str, *options: str) -> dict[str, object]:
    signals = {"input": "w", "output": output}
    data = {"source": {"log": log, "rate_hz": RATE_HZ}, "lines": GRID, "signals": signals}
    run(Axis.of(data | {"tracking": {"estimator": "direct", "accept_roles": True}}, "the test"),
        Destination(out, lambda *_: None))  # fmt: skip
    return json.loads(livebode("fit", out, "--model", "rigid", *options, "--json").out)


@pytest.mark.parametrize(
    ("output", "options", "words"),
    [
        ("speed", (), "the output 'speed' is fitted as a velocity, by its unit rad/s"),
        ("speed", ("--output", "velocity"), "the output 'speed' is fitted as a velocity, as fit.output specifies"),
        ("bare", (), "the output 'bare' is fitted as a velocity, which has the smaller misfit, because neither"),
        ("diff(speed) [rad/s]", (), "by its unit rad/s"),
    ],
)
def test_the_quantity_and_its_reason_are_named(
    log: Path, tmp_path: Path, output: str, options: tuple[str, ...], words: str
) -> None:
    assert words in fitted(log, tmp_path / "run", output, *options)["remarks"][0]


def test_an_inverted_output_is_found_and_the_remedy_works(log: Path, tmp_path: Path) -> None:
    wrong = fitted(log, tmp_path / "wrong", "turned")
    assert wrong["status"] != "ok"
    assert "is inverted; run the recording again with the output '-turned'" in wrong["remarks"][1]
    right = fitted(log, tmp_path / "right", "-turned")
    assert (right["status"], len(right["remarks"])) == ("ok", 1)
    assert abs(right["quantities"]["J"]["value"] / INERTIA - 1) < 1e-3


def test_a_fit_that_fails_for_another_reason_offers_no_other_sign(log: Path, tmp_path: Path) -> None:
    assert len(fitted(log, tmp_path / "run", "0*speed + w [rad/s]")["remarks"]) == 2


@pytest.mark.parametrize(("error", "status"), [(0.2, "ok"), (0.38, "model does not fit")])
def test_a_kind_with_a_model_error_of_30_percent_is_refused_in_one_sentence(
    log: Path, tmp_path: Path, error: float, status: str
) -> None:
    fitted(log, tmp_path / "run", "speed")
    of = averaged(RunRecord.open(tmp_path / "run"))
    scattered = of.response.value * (1 + error * np.array([1, -1, -1, 1, 1, -1, 1]))
    of = replace(of, response=replace(of.response, value=scattered))
    section = FitSection(model="rigid", fixed={"delay": 0.0})
    found, _ = fit_averaged(of, section)
    assert found.status == status
    if status != "ok":
        assert "as a velocity the output differs from the rigid model by" in found.sentence
        assert found.sentence.endswith("so its parameters have no meaning"), (
            "the advice is the remedy of what needs a fit"
        )
        assert np.isnan(found["J"])
        assert plain_fit(found)["message"] == found.sentence


def test_the_motor_side_of_the_gain_model_may_be_named_and_its_load_side_is_refused(log: Path, tmp_path: Path) -> None:
    fitted(log, tmp_path / "run", "speed")
    motor = livebode("fit", tmp_path / "run", "--model", "two-mass-gain", "--side", "motor")
    assert "no option side" not in motor.err
    assert (
        "no option side = 'load'" in livebode("fit", tmp_path / "run", "--model", "two-mass-gain", "--side", "load").err
    )


def test_a_quantity_that_follows_from_fixed_values_is_shown_as_fixed() -> None:
    axis, lines = BeltAxis().linear(0.8), Lines.parse("20:120:5", 4000, 800)
    rng, ones = np.random.default_rng(1), np.ones(len(lines))
    truth = axis.sampled(4000.0).response(lines.frequency_hz)
    noise = rng.standard_normal((2, len(lines))) * 0.007 * np.abs(truth)
    one = Response(lines, truth + noise[0] + 1j * noise[1], 0.01 * np.abs(truth), np.inf, ones, ones > 0, 0, 799, 0.1)
    found = plain_fit(fit(one, "two-mass", inertia_ratio=6.7 * 0.019**2 / 0.0028))["quantities"]
    assert (found["inertia_ratio"]["bound_95"], found["inertia_ratio"]["fixed"]) == (0.0, True)
    assert "fixed" not in found["Js"]
