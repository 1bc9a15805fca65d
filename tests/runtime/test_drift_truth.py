"""A run on a recording reports that its machine drifts, and its mean covers the machine's response meanwhile."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import livebode
from livebode import BeltAxis, Lines, SimulatedAxis, multisine
from livebode.simulation import Sensor, Standstill, TensionLoss
from tests.support.command import livebode as command

LINES = Lines.parse("20:140:20", rate_hz=4000, window=400)
SECONDS = 8.0


def recorded(folder: Path, loss: float) -> tuple[livebode.Run, np.ndarray]:
    """A run of an axis whose belt loses stiffness evenly, and its true responses, (moments, lines)."""
    axis = BeltAxis(
        motion=Standstill(position_m=0.8),
        excitation_n_m=multisine(LINES),
        sensor=Sensor(noise_rad_per_s=0.05),
        faults=[TensionLoss(loss=loss, ramp_s=SECONDS)] if loss else [],
        seconds=SECONDS,
        run_in_s=1.0,
        seed=3,
    )
    block, truth = SimulatedAxis(axis).run()
    pq.write_table(pa.table({name: block[name] for name in ("w", "u", "velocity")}), folder / "log.parquet")
    roles = ("--excitation", "w", "--input", "u", "--output", "velocity", "--rate", "4000")
    done = command("run", folder / "log.parquet", *roles, "--window", "400", "--out", folder / "run")
    assert done.code == 0, done.err
    samples = np.linspace(0, len(block) - 1, 40).astype(int)
    return livebode.Run(folder / "run"), np.array(
        [truth.linear(n).sampled(4000).response(LINES.frequency_hz) for n in samples]
    )


def test_a_belt_that_softens_is_a_drift_and_in_the_bound_of_the_mean(tmp_path: Path) -> None:
    run, truth = recorded(tmp_path, 0.05)
    (event,) = (event for event in run.events if event.kind == "drift")
    found = {line["frequency_hz"]: line for line in run.summary["drift"]["lines"]}
    assert event.details["lines"] == run.summary["drift"]["lines"]
    change = dict(zip(LINES.frequency_hz, 100 * np.abs(truth[-1] - truth[0]) / np.abs(truth.mean(axis=0))))
    for frequency_hz, line in found.items():
        assert abs(line["percent"] - change[frequency_hz]) < 4 * line["percent_sigma"] + 0.1 * change[frequency_hz]
    mean = run.average
    inside = np.abs(truth - mean.value) < 2 * mean.sigma
    assert np.mean(inside) >= 0.95


def test_a_machine_that_does_not_change_has_no_drift(tmp_path: Path) -> None:
    run, _ = recorded(tmp_path, 0.0)
    assert run.summary["drift"] == {"found": False, "lines": []}
    assert "drift" not in {event.kind for event in run.events}
