"""The figure of docs/how-to/monitoring.md: what an alarm sees along a few strokes of four faults."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

from livebode.monitoring import DEFAULT_INTERVAL_S, Evidence, LearnedMachine, MachineMonitor
from livebode.monitoring.model_evidence import ModelEvidence
from livebode.monitoring.sensitivity import Offset
from livebode.monitoring.stretches import Stretches
from livebode.simulation import LoadChange, SoftSpot, TensionLoss
from studies.monitoring_axis import LINES, axis, run, strokes

NAMES = ("u", "velocity", "x")
_CASES: dict[str, tuple[Any, int]] = {
    "healthy": ((), 0),
    "stiffness −0.5 % from 20 s on": ((TensionLoss(loss=0.005, start_s=20.0),), 0),
    "load +2 % from 20 s on": ((LoadChange(load_kg=0.134, start_s=20.0),), 1),
    "soft spot of 10 % over 10 cm at 0.9 m": ((SoftSpot(position_m=0.9, width_m=0.0777, loss=0.1),), 0),
}
_LABEL = ("stiffness", "load")


def draw(machine: LearnedMachine, path: Path) -> None:
    """Estimates of single windows, all else held at the baseline, and where the alarm came."""
    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(10, 6), layout="constrained")
    for place, (title, (faults, direction)) in zip(axes.ravel(), _CASES.items()):
        motion = strokes(8, np.random.default_rng(12))
        watcher = MachineMonitor(machine, LINES, NAMES, DEFAULT_INTERVAL_S)
        plain, stretches = ModelEvidence(machine, LINES), Stretches(NAMES, LINES.window, LINES.rate_hz)
        events, kept = [], []
        for block in run(axis(motion, 4, faults=faults))():
            events += watcher.process(block)
            kept += [plain.process(stretch, Offset()) for stretch in stretches.process(block)]
        seen = Evidence.join(kept)
        seen = seen[seen.judged]
        information = seen.information[:, direction, direction]
        change = 100 * np.expm1(seen.score[:, direction] / information)
        local = "spot" in title
        at = seen.position_m if local else seen.time_s
        place.plot(at, change, ".", markersize=4, color="#1f77b4", label="one window of 0.1 s")
        _mark(place, [e for e in events if e.kind == "change"], local)
        place.set_title(title, fontsize=10)
        place.set_xlabel("cart, m" if local else "time, s")
        place.set_ylabel(f"{_LABEL[direction]} against the baseline, %")
        place.grid(alpha=0.3)
        place.legend(fontsize=8, loc="best")
    figure.savefig(path, dpi=120, facecolor="white")


def _mark(place: Any, alarms: list[Any], local: bool) -> None:
    for i, event in enumerate(alarms):
        found = event.details
        label = f"alarm: {found['amount_percent']:.2f} ± {found['bound_percent']:.2f} %" if i == 0 else None
        if local:
            place.axvline(found["place_m"], color="#d62728", label=f"placed at {found['place_m']:.3f} m")
        else:
            place.axvline(event.time_s, color="#d62728", label=label)
            place.axvline(found["since_s"], color="#d62728", linestyle=":", label="since" if i == 0 else None)
