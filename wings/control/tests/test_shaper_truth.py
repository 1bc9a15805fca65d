"""`livebode tune --shaper`: the mode that `livebode fit` finds is shaped, and the advice of a refusal works."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.support.command import livebode, write_csv


@pytest.fixture(scope="module", params=["position", "velocity"])
def crane(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run of a swinging load: force to angle, or its speed, 0.7355 Hz and 2 % damping; no drive's model fits it."""
    folder = tmp_path_factory.mktemp("crane")
    rate_hz, window, rng = 50.0, 1000, np.random.default_rng(5)
    bins = np.arange(2, 80)
    spectrum = np.zeros(window // 2 + 1, complex)
    spectrum[bins] = np.exp(2j * np.pi * rng.random(bins.size))
    s = 2j * np.pi * np.fft.rfftfreq(window, 1 / rate_hz)
    pole = 2 * np.pi * 0.7355
    plant = 0.5 / (s**2 + 2 * 0.02 * pole * s + pole**2) * (s if request.param == "velocity" else 1)
    force, angle = (np.tile(np.fft.irfft(x * window / 2, window), 6) for x in (spectrum, spectrum * plant))
    angle = angle + 1e-3 * np.std(angle) * rng.standard_normal(angle.size)
    log = write_csv(folder / "load.csv", {"t": np.arange(force.size) / rate_hz, "force": force, "angle": angle})
    options = ("--input", "force", "--output", "angle", "--estimator", "direct", "--average", "--window", window)
    result = livebode("run", log, *options, "--out", folder / "run")
    assert result.code == 0, result.err
    return folder / "run"


def test_the_mode_of_a_fit_is_shaped(crane: Path) -> None:
    fitted = json.loads(livebode("fit", crane, "--model", "modal", "--json").out)
    shaped = livebode("tune", crane, "--shaper", "--model", "modal", "--json")
    assert shaped.code == 0, shaped.err
    mode = json.loads(shaped.out)["mode"]
    assert mode["low_hz"] < 0.7355 < mode["high_hz"]
    assert mode["low_damping"] < 0.02 < mode["high_damping"]
    assert "0.735" in json.dumps(fitted)


def test_options_of_shapers_and_of_gains_exclude_each_other(crane: Path) -> None:
    for options in (("--tolerance", 0.02), ("--mode", "resonance"), ("--model", "modal"), ("--klipper-axis", "y")):
        refused = livebode("tune", crane, *options)
        assert (refused.code, f"{options[0]} belongs to --shaper; give --shaper too" in refused.err) == (2, True)
    for option in ("--loop-checked", "--no-low-pass", "--odrive"):
        refused = livebode("tune", crane, "--shaper", option)
        assert refused.code == 2
        assert f"{option.replace('no-', '')} and --shaper exclude each other" in refused.err


def test_an_axis_that_klipper_has_not_is_refused(crane: Path) -> None:
    (crane / "shaper.cfg").unlink(missing_ok=True)
    refused = livebode("tune", crane, "--shaper", "--model", "modal", "--klipper-axis", "q")
    assert (refused.code, "Invalid value for '--klipper-axis': 'q' is not one of" in refused.err) == (2, True)
    assert not (crane / "shaper.cfg").exists()


def test_the_advice_of_a_refusal_is_an_option_that_works(crane: Path) -> None:
    advice = set()
    for model in ((), ("--model", "two-mass-gain"), ("--model", "rational")):
        refused = livebode("tune", crane, "--shaper", *model)
        assert refused.code == 2
        found = re.search(r"choose the model '(\w+)'.*\(option (--\w+)\)", refused.err)
        assert found is not None, refused.err
        advice.add((found[2], found[1]))
    for option in advice:
        assert livebode("tune", crane, "--shaper", *option).code == 0
