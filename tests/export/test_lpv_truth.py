"""A model over the position: the C header interpolates as NumPy does, the .mat is the plant of the simulated belt."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import xarray as xr

from livebode.core import Lines, Responses, UsageError
from livebode.export import LpvModel, writers
from livebode.fitting import Fitter, TwoMass
from livebode.plugins import loaded
from livebode.simulation import BeltAxis

RATE_HZ = 4000.0
LINES = Lines.parse("2:520:2", RATE_HZ, 2000)
PLACES_M = np.array([0.4, 0.7, 1.0, 1.4])


@pytest.fixture(scope="module")
def model() -> LpvModel:
    """Two masses fitted to noisy responses of the simulated belt at four places."""
    truth = np.array([BeltAxis().linear(x).sampled(RATE_HZ).response(LINES.frequency_hz) for x in PLACES_M])
    noise = np.random.default_rng(0).standard_normal((2, *truth.shape)) / np.sqrt(2)
    sigma, ones, row = 0.02 * np.abs(truth), np.ones(truth.shape), np.zeros(4, dtype=np.int64)
    value = truth + sigma * (noise[0] + 1j * noise[1])
    rows = Responses(LINES, value, sigma, row + np.inf, ones, ones > 0, row, row, row + 0.0, PLACES_M)
    return LpvModel(Fitter(TwoMass(radius_m=0.019)).process(rows), radius_m=0.019)


def test_the_frozen_response_of_the_mat_file_is_that_of_the_belt(model: LpvModel, tmp_path: Path) -> None:
    """From 10 to 100 Hz at every place within 5 %; the stiffness within four sigma."""
    loaded(writers("model")["mat"])(tmp_path / "belt.mat", model)
    found = scipy.io.loadmat(tmp_path / "belt.mat")["livebode"][0, 0]
    f = np.linspace(10.0, 100.0, 40)
    for i, x in enumerate(found["position"][0]):
        s = 2j * np.pi * f[:, np.newaxis, np.newaxis]
        solved = np.linalg.solve(s * np.eye(4) - found["A"][..., i], found["B"][..., i])
        np.testing.assert_allclose((found["C"][..., i] @ solved)[:, 0, 0], BeltAxis().linear(x).response(f), rtol=0.05)
    stiffness = found["value"][2]
    wide = 4 * np.sqrt(found["covariance"][2, 2])
    assert np.all(np.abs(stiffness - BeltAxis().mechanics.stiffness_at(PLACES_M)) < wide)


def test_the_c_header_interpolates_as_numpy(model: LpvModel, tmp_path: Path) -> None:
    gcc = shutil.which("gcc")
    if gcc is None:
        pytest.skip("gcc is not installed")
    loaded(writers("model")["c"])(tmp_path / "belt.h", model)
    at = np.linspace(0.3, 1.5, 49)
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "belt.h"\nint main(void) {\ndouble p[LIVEBODE_PARAMETERS];\n'
        "for (int i = 0; i < 49; i++) {\nlivebode_at(0.3 + i * 1.2 / 48, p);\n"
        'for (int k = 0; k < LIVEBODE_PARAMETERS; k++) {\nprintf("%.17g ", p[k]);\n}\n}\nreturn 0;\n}\n'
    )
    built = str(tmp_path / "main")
    warnings = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    subprocess.run([gcc, *warnings, str(tmp_path / "main.c"), "-o", built], check=True)
    out = subprocess.run([built], check=True, capture_output=True, text=True).stdout
    np.testing.assert_allclose(
        np.array(out.split(), float).reshape(49, -1), [model.at(x) for x in at], rtol=1e-9, atol=1e-15
    )


def test_json_and_netcdf_have_value_and_covariance(model: LpvModel, tmp_path: Path) -> None:
    for name in ("json", "netcdf"):
        loaded(writers("model")[name])(tmp_path / name, model)
    plain = json.loads((tmp_path / "json").read_text())
    assert plain["names"] == list(model.names)
    np.testing.assert_allclose(plain["covariance"], model.parameters.covariance)
    with xr.open_dataset(tmp_path / "netcdf", engine="scipy") as dataset:
        stiffness = dataset["value"].sel(parameter="Keff").interp(position=0.85)
        assert float(stiffness) == pytest.approx(model.at(0.85)[2])
        np.testing.assert_allclose(dataset["covariance"], model.parameters.covariance)


def test_one_place_is_no_model_over_the_position(model: LpvModel) -> None:
    with pytest.raises(UsageError, match="needs two or more"):
        LpvModel(model.parameters[:1], radius_m=0.019)
