"""How far a promise reaches above the highest line."""

from __future__ import annotations

from typing import Any

import numpy as np

from livebode.arrays import Complex
from livebode.core import Lines
from livebode.dataclass import dataclass
from livebode_control.tuning.missing_lines import MissingLines
from livebode_control.tuning.plant_band import PlantBand

_MULTIPLES = (1.0, 2.0, 4.0)  # of the highest line
_LARGEST_DB = 120.0
_HIGHEST = 0.45  # of the rate, for lines
_BELOW = 0.1  # |L| at the last of the lines that are proposed: 20 dB below one


@dataclass(frozen=True)
class PromiseReach:
    """Above the highest line a promise holds for every plant whose resonances are not larger than these.

    Attributes
    ----------
    highest_line_hz
        Up to which it holds without a condition.
    resonance_db
        At some frequencies above it, Hz: by how many dB |G| may exceed the fall that the lines predict, at every place.
    shown_hz
        Where the lines show a mode above the highest of them; None where they do not.
    """

    highest_line_hz: float
    resonance_db: tuple[tuple[float, float], ...]
    shown_hz: float | None

    @classmethod
    def of(cls, plant: PlantBand, loop: Complex, largest: float) -> PromiseReach:
        """For L of the values of `plant`, and the largest |L| above the highest line that keeps the promise."""
        f, top = plant.frequency_hz, float(plant.lines_hz[-1])
        fall = np.abs(loop).max(axis=0)
        db = np.minimum(20 * np.log10(np.maximum(largest, 1e-300) / np.maximum(fall, 1e-300)), _LARGEST_DB)
        above = np.flatnonzero(plant.above)
        indices = [
            int(above[np.argmin(np.abs(f[above] - top * multiple))])
            for multiple in _MULTIPLES
            if top * multiple <= f[-1]
        ]
        rows = tuple((float(f[i]), float(db[i:].min())) for i in dict.fromkeys(indices))
        return cls(top, rows, plant.lowest_shown_hz)

    @property
    def sentence(self) -> str:
        """For people."""
        rows = ", ".join(f"{db:.0f} dB from {hz:.0f} Hz" for hz, db in self.resonance_db)
        shown = "" if self.shown_hz is None else f"; the lines show a mode near {self.shown_hz:.4g} Hz"
        return (
            f"promised up to the highest line, {self.highest_line_hz:g} Hz; above it if no resonance exceeds the fall "
            f"that the lines predict by more than {rows}{shown}"
        )

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "highest_line_hz": self.highest_line_hz,
            "resonance_db": [list(row) for row in self.resonance_db],
            "shown_hz": self.shown_hz,
            "sentence": self.sentence,
        }


def lines_above(plant: PlantBand, loop: Complex, lines: Lines) -> MissingLines | None:
    """Lines that show what is above the highest: to twice a mode that is shown, and to where L is 20 dB below one.

    For L of the values of `plant`. None where the lines reach that far, or where the rate permits no more.
    """
    top = float(plant.lines_hz[-1])
    loud = plant.frequency_hz[plant.above & (np.abs(loop).max(axis=0) > _BELOW)]
    last = min(max(2 * (plant.lowest_shown_hz or 0.0), loud.max(initial=top)), _HIGHEST * lines.rate_hz)
    step = float(plant.lines_hz[-1] - plant.lines_hz[-2])
    return MissingLines.of(lines, [(top, last, step)]) if last >= top + 2 * step else None
