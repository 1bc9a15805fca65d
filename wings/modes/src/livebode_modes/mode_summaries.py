"""Summaries of the modes and harmonics of an output-only run, for run.json."""

from __future__ import annotations

from typing import Any

import numpy as np

from livebode.core import Event, Parameters
from livebode.language import Message


class ModeSummaries:
    """Collects the rows of each track.

    Attributes
    ----------
    modes, harmonics
        One entry for each track: name, number of rows and of those with values, lowest and highest frequency, means of
        damping and share, and the newest values with sigma.
    """

    def __init__(self) -> None:
        self._tracks: dict[str, dict[str, Any]] = {}

    def take(self, rows: Parameters) -> None:
        """Rows of one track."""
        track = self._tracks.setdefault(rows.model, {"name": rows.model, "rows": 0, "found": 0})
        track["rows"] += len(rows)
        ok = np.flatnonzero(rows.ok)
        if not ok.size:
            return
        f, before = rows["frequency"][ok], track["found"]
        low, high = track.get("frequency_hz", (np.inf, -np.inf))
        track["frequency_hz"] = [min(low, float(f.min())), max(high, float(f.max()))]
        track.setdefault("first", _values(rows, int(ok[0])))
        track["newest"] = _values(rows, int(ok[-1]))
        track["found"] = before + ok.size
        for name in rows.names[1:]:
            mean = track.get(f"mean_{name}", 0.0)
            track[f"mean_{name}"] = (before * mean + float(rows[name][ok].sum())) / track["found"]

    @property
    def modes(self) -> list[dict[str, Any]]:
        return [track for name, track in self._tracks.items() if name.startswith("mode")]

    @property
    def harmonics(self) -> list[dict[str, Any]]:
        return [track for name, track in self._tracks.items() if name.startswith("harmonic")]

    def harmonic_events(self, sample: int, time_s: float) -> list[Event]:
        """An event for each harmonic."""
        return [
            Event(
                "harmonic",
                sample,
                time_s,
                Message(
                    "{frequency_hz:.5g} Hz has a constant amplitude and almost no damping: a harmonic, such as a "
                    "rotation or the mains, not a mode",
                    frequency_hz=track["newest"]["frequency_hz"],
                ),
                {"name": track["name"]},
            )
            for track in self.harmonics
        ]


def _values(rows: Parameters, i: int) -> dict[str, float]:
    found = {"time_s": float(rows.time_s[i])}
    for j, name in enumerate(rows.names):
        key = "frequency_hz" if name == "frequency" else name
        found[key] = float(rows.value[i, j])
        if np.isfinite(sigma := rows.sigma[i, j]):
            found[f"{key}_sigma"] = float(sigma)
    return found
