"""MachineYear: a quantity of a machine over its runs, as a lake has it, with known changes."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Floats
from livebode.dataclass import dataclass

START_S = 1_735_689_600.0
"""The first run is after this: 2025-01-01."""
LEVEL = 100.0
"""Value of a machine that does not change: changes are in percent."""
_MEAN_C = 25.0
_MONTH_S = 365.25 / 12 * 86400


@dataclass(frozen=True)
class MachineYear:
    """Runs of a machine: percent of change, °C, and the correlation of the scatter from run to run."""

    runs: int = 200
    months: float = 12.0
    scatter: float = 0.3
    correlation: float = 0.0
    per_month: float = 0.0
    jump: float = 0.0
    bend: float = 0.0
    change_month: float = 7.0
    per_kelvin: float = 0.1
    swing_kelvin: float = 10.0
    outliers: float = 0.03
    bound_95: float = 0.2

    def measured(self, seed: int) -> tuple[Floats, Floats, Floats, dict[str, Floats]]:
        """Times in s, values, bounds and covariates, as `trend_of` takes them."""
        rng = np.random.default_rng(seed)
        month = np.sort(rng.uniform(0, self.months, self.runs))
        own = rng.standard_normal(self.runs)
        scatter = np.empty(self.runs)
        before = rng.standard_normal()
        for i, new in enumerate(own):
            before = scatter[i] = self.correlation * before + np.sqrt(1 - self.correlation**2) * new
        season = np.sin(2 * np.pi * (month / 12 + rng.uniform()))
        kelvin = self.swing_kelvin * season + 0.2 * self.swing_kelvin * rng.standard_normal(self.runs)
        error = self.bound_95 / 2 * rng.standard_normal(self.runs)
        after = month - self.change_month
        value = LEVEL + self.scatter * scatter + self.per_kelvin * kelvin + error + self.per_month * month
        value += self.jump * (after >= 0) + self.bend * np.maximum(after, 0)
        off = rng.random(self.runs) < self.outliers
        value[off] += rng.uniform(-5, 5, int(off.sum()))
        return START_S + month * _MONTH_S, value, np.full(self.runs, self.bound_95), {"temperature": _MEAN_C + kelvin}
