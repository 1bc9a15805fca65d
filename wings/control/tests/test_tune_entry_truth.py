"""`livebode tune --entry` on a simulated gantry: the proposal keeps its promise in the true loop of two controllers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
import scipy.signal
from numpy.typing import NDArray
from playwright.sync_api import Browser

from livebode.dashboard import Dashboard, ServerSettings
from livebode.interface import write_examples
from livebode.simulation import GantryLoop
from tests.support.browser import Tab
from tests.support.command import livebode

RATE_HZ = 4000.0
LOOP = GantryLoop()  # of the example
GRID_HZ = np.linspace(0.05, RATE_HZ / 2, 40_000)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example, with a checked description of both controllers."""
    folder = tmp_path_factory.mktemp("gantry")
    write_examples(["matrix-tune"], folder)
    assert livebode("run", folder / "gantry-tune.toml", "--out", folder / "run").code == 0
    assert "as described" in livebode("validate", folder / "run", "--loop").out
    return folder / "run"


@pytest.mark.parametrize("number", [0, 1])
def test_one_controller_is_tuned_and_keeps_its_promise_in_the_true_loop(run: Path, number: int) -> None:
    name = f"velocity{number + 1}/u{number + 1}"
    done = livebode("tune", run, "--entry", name, "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    controllers = [_transfer(one.gain, one.integral_time_s, []) for one in LOOP.controllers]
    proposed = found["controller"]
    controllers[number] = _transfer(proposed["gain"], proposed["integral_time_s"], found["biquads"])
    assert _decay(controllers) < 1
    promised, true = found["promised"], _margins(controllers, number)
    assert promised["max_sensitivity"] <= 2.001
    assert true["max_sensitivity"] <= promised["max_sensitivity"]
    for margin in ("disk_margin", "phase_margin_deg", "gain_margin_db"):
        limit = np.inf if promised[margin] is None else promised[margin]
        assert true[margin] >= limit, margin
    assert true["bandwidth_hz"] >= promised["bandwidth_hz"] > 2 * found["before"]["bandwidth_hz"]


@pytest.mark.parametrize("axis", [0, 3])
def test_what_if_shows_the_loop_check_of_the_controller_of_an_entry(browser: Browser, run: Path, axis: int) -> None:
    """The check compared the descriptions of both controllers; the page shows the entry of one of them."""
    dashboard = Dashboard(ServerSettings("127.0.0.1", 0))
    dashboard.view(run)
    with dashboard, Tab(browser, dashboard.url, wait=False) as tab:
        tab.page.locator(f'[data-axis="{axis}"]').click()
        tab.until(f"bode.curves.measured?.frame?.axis === {axis}")
        tab.page.locator("#what-if").click()
        tab.until("whatIf.facts")
        assert tab.page.locator("#what-if-check").inner_text() == "loop check: as described"
        assert tab.wrong == []


def _transfer(gain: float, integral_time_s: float, biquads: list[dict[str, Any]]) -> control.TransferFunction:
    """Gain·(1 + sum of the samples/(rate·Ti)) with the filters, at the rate of the drive."""
    step = 1 / RATE_HZ
    found = control.tf(gain * np.array([1 + step / integral_time_s, -1]), [1, -1], step)
    for one in biquads:
        found *= control.tf(one["b"], one["a"], step)
    return found


def _decay(controllers: list[control.TransferFunction]) -> float:
    """Size of the largest pole of the whole loop, without those of the place where the gantry stops."""
    a, b, c = LOOP.mechanism.sampled(RATE_HZ)
    plant = control.ss(a, b, c[:2], 0, 1 / RATE_HZ)
    poles = control.feedback(plant, control.append(*(control.ss(one) for one in controllers))).poles()
    return float(np.abs(poles[np.abs(poles - 1) > 1e-7]).max())


def _margins(controllers: list[control.TransferFunction], number: int) -> dict[str, float]:
    """Of L = F·(G₁₁ − G₁₂·F₂·G₂₁/(1 + G₂₂·F₂)), all from the truth; 1 is the controller, 2 the other one."""
    other = 1 - number
    g = LOOP.mechanism.response(GRID_HZ, RATE_HZ)
    f = [scipy.signal.freqz(one.num[0][0], one.den[0][0], worN=GRID_HZ, fs=RATE_HZ)[1] for one in controllers]
    around = g[:, number, other] * f[other] * g[:, other, number] / (1 + g[:, other, other] * f[other])
    loop = f[number] * (g[:, number, number] - around)
    sensitivity = 1 / (1 + loop)
    return {
        "max_sensitivity": float(np.abs(sensitivity).max()),
        "disk_margin": float(1 / np.abs(sensitivity - 0.5).max()),
        "phase_margin_deg": float(np.degrees(np.abs(np.angle(-loop[_changes(np.abs(loop) - 1)])).min())),
        "gain_margin_db": _gain_margin_db(loop),
        "bandwidth_hz": float(GRID_HZ[np.flatnonzero(np.abs(1 - sensitivity) < np.sqrt(0.5))[0]]),
    }


def _gain_margin_db(loop: NDArray[np.complex128]) -> float:
    """By how much the gain may rise until the curve passes −1."""
    crossed = loop[_changes(loop.imag)].real
    crossed = crossed[(crossed < 0) & (crossed > -1)]
    return float(-20 * np.log10(-crossed.min())) if crossed.size else np.inf


def _changes(value: NDArray[np.float64]) -> NDArray[np.intp]:
    """Before each change of sign."""
    return np.flatnonzero(np.diff(np.sign(value)) != 0)
