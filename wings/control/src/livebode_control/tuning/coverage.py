"""Whether the lines show what a proposal depends on, and which lines are missing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import Lines, TuneError, counted
from livebode_control.tuning.missing_lines import MissingLines
from livebode_control.tuning.plant_band import PlantBand

_Span = tuple[float, float, float]

_GAP_MAX = 0.5  # of log G between two lines: more is a resonance that they do not resolve
_GAP_GOOD = 0.05
_MATTERS = (0.15, 8.0)  # |L| where the way past −1 is decided
_CROSSOVER_FROM_END = 2.0


def check_coverage(plant: PlantBand, loop: Complex, lines: Lines) -> None:
    """TuneError with the missing lines if crossover or a resonance near −1 is not covered.

    Parameters
    ----------
    plant, loop
        The band and L of its values, shape (places, frequencies).
    lines
        The measured lines, with which the missing ones are joined.
    """
    _check_gaps(plant, np.abs(loop), lines)
    first = min(_crossover_hz(plant, row)[0] for row in loop)
    last = max(_crossover_hz(plant, row)[1] for row in loop)
    low, high = plant.lines_hz[[0, -1]]
    if first < _CROSSOVER_FROM_END * low:
        raise _missing(first, f"the lowest line is {low:g} Hz", lines, (first / 8, low, first / 8))
    if last > high / _CROSSOVER_FROM_END:
        raise _missing(last, f"the highest line is {high:g} Hz", lines, (high, 4 * last, last / 8))


def missing_resonances(plant: PlantBand, lines: Lines) -> MissingLines | None:
    """The lines that would resolve what the lines do not show."""
    spans = _spans(plant, plant.coarseness.max(axis=0) > _GAP_MAX)
    return MissingLines.of(lines, spans) if spans else None


def _check_gaps(plant: PlantBand, size: Floats, lines: Lines) -> None:
    matters = (size > _MATTERS[0]) & (size < _MATTERS[1])
    wrong = np.any(matters & (plant.coarseness > _GAP_MAX), axis=0)
    if not wrong.any():
        return
    near_hz = float(plant.frequency_hz[int(np.argmax(np.where(wrong, plant.coarseness.max(axis=0), 0)))])
    if lacking := [f for f in plant.dropped_hz.tolist() if _in_gap(plant, wrong, f)]:
        raise TuneError(
            "coherence-low",
            f"{counted(len(lacking), 'line')} from {lacking[0]:g} to {lacking[-1]:g} Hz, where the loop is near −1, "
            "cannot be used: invalid, or too little coherence",
            "excite these lines with more amplitude, or measure longer",
            dropped_hz=lacking,
        )
    missing = MissingLines.of(lines, _spans(plant, wrong))
    raise TuneError(
        "lines-missing",
        f"the lines do not resolve the response near {near_hz:.4g} Hz, where the loop is close to −1",
        missing.remedy,
        frequency_hz=near_hz,
        lines=missing.lines,
        window=missing.window,
    )


def _in_gap(plant: PlantBand, wrong: NDArray[np.bool_], frequency_hz: float) -> bool:
    """Whether a dropped line is between the same lines as a point where the interpolation is unsure."""
    gaps = np.searchsorted(plant.lines_hz, plant.frequency_hz[wrong])
    return int(np.searchsorted(plant.lines_hz, frequency_hz)) in gaps


def _spans(plant: PlantBand, wrong: NDArray[np.bool_]) -> list[_Span]:
    """Ends and step of each group of neighbouring gaps, Hz; the step is that which the third difference asks for."""
    gaps = sorted(
        {
            min(int(np.searchsorted(plant.lines_hz, f, side="right")) - 1, plant.lines_hz.size - 2)
            for f in plant.frequency_hz[wrong & ~plant.above]
        }
    )
    groups: list[list[int]] = []
    for gap in gaps:
        if groups and gap == groups[-1][-1] + 1:
            groups[-1].append(gap)
        else:
            groups.append([gap])
    spans = []
    distance = np.diff(plant.lines_hz)
    for group in groups:
        low, high = float(plant.lines_hz[group[0]]), float(plant.lines_hz[group[-1] + 1])
        inside = (plant.frequency_hz >= low) & (plant.frequency_hz <= high)
        finer = float(np.ceil((plant.coarseness[:, inside].max() / _GAP_GOOD) ** (1 / 3)))
        # Across a resonance the third difference says too little: at least as fine as beside the gaps.
        beside = distance[max(0, group[0] - 1) : group[-1] + 2].min()
        spans.append((low, high, float(min(distance[group].min() / max(finer, 2.0), beside))))
    return spans


def _crossover_hz(plant: PlantBand, loop: Complex) -> tuple[float, float]:
    """First and last frequency with |L| = 1."""
    above = np.flatnonzero(np.abs(loop) >= 1)
    below = np.flatnonzero(np.abs(loop) < 1)
    first = plant.frequency_hz[below[0]] if below.size else plant.frequency_hz[-1]
    return float(first), float(plant.frequency_hz[above[-1]] if above.size else plant.frequency_hz[0])


def _missing(crossover_hz: float, fact: str, lines: Lines, span: _Span) -> TuneError:
    missing = MissingLines.of(lines, [span])
    return TuneError(
        "lines-missing",
        f"the loop crosses |L| = 1 at {crossover_hz:.4g} Hz, and {fact}",
        missing.remedy,
        frequency_hz=crossover_hz,
        lines=missing.lines,
        window=missing.window,
    )
