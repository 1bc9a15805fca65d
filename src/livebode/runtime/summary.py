"""Contents of run.json."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.core import ENCODING, PlantKinds
from livebode.estimation import Follower
from livebode.kernel import instruction_set
from livebode.runtime.run_counts import RunCounts
from livebode.version import __version__

if TYPE_CHECKING:
    from livebode.sources.live import LiveSource


def begun(about: Mapping[str, Any], tracker: Follower, unit: str, kinds: PlantKinds) -> dict[str, Any]:
    """Entries at the beginning: configuration, findings, versions."""
    found = tracker.found() | {"quantity": tracker.settings.quantity, "unit": unit, "kinds": asdict(kinds)}
    return dict(about) | {"found": about.get("found", {}) | found, "versions": versions()}


def versions() -> dict[str, str | int]:
    """Versions of livebode, of what its results depend on, and of the encoding of its states."""
    return {
        "livebode": __version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
        "instruction_set": instruction_set(),
        "states": ENCODING,
    }


def done(tracked: Mapping[str, int], rate_hz: float, run: RunCounts) -> dict[str, Any]:
    """Entries at the end: counts and speed; `tracked` are the counts of the tracker."""
    counts, run_s = run.counts(tracked), run.run_s
    recorded_s = counts["samples"] / rate_hz
    speed = {
        "recorded_s": recorded_s,
        "run_s": run_s,
        "tracking_s": run.tracked_s,
        "times_real_time": recorded_s / run_s,
        "samples_per_s": counts["samples"] / run.tracked_s,
    }
    counts |= {"responses": run.responses, "invalid_responses": run.invalid}
    return {"counts": counts, "speed": speed}


def of_source(source: LiveSource | None) -> dict[str, Any]:
    """Entries on a live source; none for a recording."""
    if source is None:
        return {}
    return {"source": asdict(source.health) | {"first_sample": source.first_sample}}
