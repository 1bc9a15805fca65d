"""Contents of run.json."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from livebode.analysis import loop_report, proposed_filter
from livebode.core import ENCODING, Lines, PlantKinds, Responses, moment
from livebode.estimation import Follower
from livebode.fitting import Drift, Fit, RecordingsMean
from livebode.kernel import instruction_set
from livebode.runtime.fits import Fits
from livebode.runtime.run_counts import RunCounts
from livebode.sources.live import LiveSource
from livebode.version import __version__


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


def of_source(source: object) -> dict[str, Any]:
    """Entries on a live source; none for a recording."""
    if not isinstance(source, LiveSource):
        return {}
    return {"source": asdict(source.health) | {"first_sample": source.first_sample}}


def of_drift(drift: Drift, lines: Lines) -> dict[str, Any]:
    """Entries on a drift of the machine within the recording: at the lines where it is significant, or the clearest."""
    if not drift.found:
        return {"found": False, "lines": []}
    shown = drift.lines.copy()
    if not shown.any():
        shown[np.nanargmax(np.abs(drift.change) / drift.sigma)] = True
    size = np.abs(drift.value)
    rows = [
        {
            "frequency_hz": float(lines.frequency_hz[i]),
            "percent": 100 * float(abs(drift.change[i]) / size[i]),
            "percent_sigma": 100 * float(drift.sigma[i] / size[i]),
        }
        for i in np.flatnonzero(shown)
    ]
    return {"found": True, "lines": rows}


def of_recordings(mean: RecordingsMean) -> dict[str, Any]:
    """Entries on the scatter between several recordings; at lines where something is not known it is null."""
    found = mean.result()[1]
    of_line = {"noise_sigma": found.noise, "total_sigma": found.total, "distortion": found.distortion}
    of_all = {"chance": found.chance, "distortion_db": found.distortion_db, "noise_db": found.noise_db}
    return {
        "recordings": found.recordings,
        "realisations": mean.realisations,
        "differs": found.differs,
        **{name: value if np.isfinite(value) else None for name, value in of_all.items()},
        **{name: [v if np.isfinite(v) else None for v in values.tolist()] for name, values in of_line.items()},
    }


def fitted(fits: Fits | None, newest: Fit | None, responses: Responses) -> dict[str, Any]:
    """Results of the fits, and the margins of a known loop with them."""
    if fits is None:
        return {}
    summary = {"fit": fits.summary(newest)}
    if newest is not None and fits.loop is not None:
        words = f"newest fit, at {moment(newest.parameters.time_s[0], 2)}"
        report = loop_report(newest, words, responses, fits.loop)
        summary["loop"] = report.plain(proposed_filter(report))
    return summary
