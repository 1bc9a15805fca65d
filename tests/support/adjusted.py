"""A simulated axis at standstill that is adjusted while it is not ready: its drive is off, then its belt is slack."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from livebode.configuration import Axis
from livebode.core import Lines
from livebode.excitation import multisine
from livebode.records import RunRecord
from livebode.runtime import Destination, run
from livebode.simulation import BeltAxis, Sensor, SimulatedAxis, TensionLoss
from tests.support.command import write_parquet
from tests.support.shared import folder, shared

RATE_HZ, WINDOW = 4000, 400
LINES = Lines.parse("20:140:20", rate_hz=RATE_HZ, window=WINDOW)
CHANNELS = ("w", "u", "velocity")
SIGNALS = {"excitation": "w", "input": "u", "output": "velocity"}
SECTIONS = {
    "lines": {"frequencies": "20:140:20", "window": WINDOW},
    "tracking": {"hop": 100, "noise": "quiet"},
    "fit": {"model": "two-mass", "radius_m": 0.019},
}
OFF_S, SLACK_S = 1.0, 2.0
Columns = dict[str, np.ndarray]


def piece(seconds: float, seed: int, loss: float = 0.0) -> np.ndarray:
    """Samples of the axis with so much of its belt's stiffness missing."""
    faults = (TensionLoss(start_s=0.0, loss=loss),) if loss else ()
    axis = BeltAxis(
        excitation_n_m=multisine(LINES), sensor=Sensor(noise_rad_per_s=0.1), faults=faults, seconds=seconds,
        run_in_s=2, seed=seed,
    )  # fmt: skip
    block, _ = SimulatedAxis(axis).run()
    return np.array([block[name] for name in CHANNELS])


def off(seed: int) -> np.ndarray:
    """The drive is off: no excitation and no torque, and the noise of the sensor."""
    noise = 0.1 * np.random.default_rng(seed).standard_normal(round(OFF_S * RATE_HZ))
    return np.array([0 * noise, 0 * noise, noise])


def adjusted(before_s: float, after_s: float, loss: float, seed: int = 7) -> Columns:
    """Healthy; off, and with 30 % less stiffness, both with `enabled` at 0; then with the rest of the loss."""
    parts = [piece(before_s, seed), off(seed), piece(SLACK_S, seed + 1, 0.3), piece(after_s, seed + 2, loss)]
    enabled = np.concatenate([np.full(part.shape[1], i in (0, 3), dtype=float) for i, part in enumerate(parts)])
    return columns(np.concatenate(parts, axis=1), enabled)


def columns(data: np.ndarray, enabled: np.ndarray) -> Columns:
    time_s = np.arange(data.shape[1]) / RATE_HZ
    return {"t": time_s, **dict(zip(CHANNELS, data)), "enabled": enabled}


def ran(path: Path, given: Columns, *, ready: str | None = None, **sections: dict[str, object]) -> RunRecord:
    """The run on these columns; `ready` is signals.ready."""
    path.mkdir()
    signals = SIGNALS | ({} if ready is None else {"ready": ready})
    source = {"source": {"log": write_parquet(path / "log.parquet", given)}, "signals": signals}
    axis = Axis.of(source | SECTIONS | sections, "the test")
    return RunRecord.open(run(axis, Destination(path / "run", lambda *_: None)).directory)


@shared
def healthy() -> Path:
    """The run of the healthy axis."""
    data = piece(40.0, 1)
    return ran(folder() / "adjusted", columns(data, np.ones(data.shape[1]))).path


@shared
def baseline() -> Path:
    from livebode import learn

    path = folder() / "adjusted.json"
    learn([healthy()]).save(path)
    return path
