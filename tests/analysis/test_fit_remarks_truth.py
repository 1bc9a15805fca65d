"""`livebode fit` names the quantity that it took for the output, and finds an output that is inverted."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from livebode.configuration import Axis
from livebode.core import Lines
from livebode.excitation import multisine
from livebode.runtime import Destination, run
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
