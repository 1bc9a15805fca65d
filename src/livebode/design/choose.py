"""From a wish, a machine and its limits to an experiment, with the reasons."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, inf
from typing import Any

import numpy as np

from livebode.design.accuracy import HOLDING_95, Accuracy, accuracy_of
from livebode.design.grid import Grid, grid
from livebode.design.limits import Bearable, check, room
from livebode.design.machine import UNITS, Machine
from livebode.design.make import unit_waveform
from livebode.design.peaks import Peak, peaks, worst
from livebode.design.waveform import Waveform
from livebode.design.wish import Wish
from livebode.estimation.settings import default_hop
from livebode.nouns import InputError

# Of the room that the limits leave: what the prediction may err by.
_RESERVE = 0.1
_WITHOUT_NOISE = 0.1  # of the room, where nothing says how much is needed
# From rest the position drifts further than in the periodic state; brought in so slowly, by 4 % (studies/design.py).
_RAMP_S = 0.5
_STROKES_MIN = 2  # there and back
_WINDOWS_MIN = 10  # sigma is learned from the scatter between periods, and needs some


@dataclass(frozen=True)
class Choice:
    """One row of the table that explains a design."""

    what: str
    value: str
    why: str


@dataclass(frozen=True, eq=False)
class Design:
    """An experiment: the excitation, what it does, and what it will tell.

    Attributes
    ----------
    waveform
        The excitation as it is to be played.
    amplitude_n_m
        Of each line, chirp, step or bit; of shaped or listed lines their rms.
    limits, peaks
        What is borne, and what is predicted at each place.
    accuracy, windows
        What one window tells, and how many bring every line's 95 % bound within `wish.accuracy`.
    recording_s
        How long to record for that.
    hop
        Samples between responses.
    ramp_s
        In how long to bring the excitation in, whole periods: the peaks are those of the periodic state.
    choices
        All of it as rows of a table.
    """

    wish: Wish
    machine: Machine
    waveform: Waveform
    amplitude_n_m: float
    limits: Bearable
    peaks: tuple[Peak, ...]
    accuracy: Accuracy
    windows: int
    recording_s: float
    hop: int
    ramp_s: float
    choices: tuple[Choice, ...]

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        lines = self.waveform.lines
        low_high = {name: {"low": p.low, "high": p.high, "unit": UNITS[name], "place": p.place}
                    for name, p in worst(self.peaks).items()}  # fmt: skip
        return {
            "excitation": dict(self.waveform.about),
            "rate_hz": lines.rate_hz,
            "window": lines.window,
            "frequency_hz": lines.frequency_hz.tolist(),
            "amplitude_n_m": self.waveform.amplitude.tolist(),
            "peak_n_m": self.waveform.peak,
            "rms_n_m": self.waveform.rms,
            "crest_factor": self.waveform.crest_factor,
            "predicted": low_high,
            "sigma": self.accuracy.sigma.tolist(),
            "sigma_relative": self.accuracy.relative.tolist(),
            "windows": self.windows,
            "recording_s": self.recording_s,
            "hop": self.hop,
            "ramp_s": self.ramp_s,
            "choices": [vars(choice) for choice in self.choices],
            "notes": list(self.machine.notes),
        }


def choose(wish: Wish, machine: Machine, limits: Bearable | None = None) -> Design:
    """The experiment for a wish: lines and window by the resolution, amplitude by accuracy and limits, then the rest.

    Raises
    ------
    InputError
        If a limit would be broken (with the largest amplitude that passes), the grid has no such lines, a crest factor
        is not reached, or nothing is left of the excitation in the drive's steps.
    """
    limits = limits or Bearable()
    found = grid(wish, machine.rate_hz)
    unit = unit_waveform(wish, found, machine)
    listed = wish.amplitude_n_m is not None and np.ndim(wish.amplitude_n_m) == 1
    per_unit = float(np.sqrt(np.mean(np.square(np.asarray(wish.amplitude_n_m, dtype=float))))) if listed else 1.0
    factor, why = _factor(wish, unit, machine, limits)
    waveform = replace(unit.scaled(factor), about={**unit.about, "amplitude_n_m": factor * per_unit})
    if wish.resolution_n_m is not None:
        waveform = waveform.quantised(wish.resolution_n_m)
    predicted = peaks(waveform, machine)
    check(predicted, limits, factor * per_unit)
    accuracy = accuracy_of(waveform, machine)
    windows = accuracy.windows(wish.accuracy)
    recording_s = _recording_s(waveform, machine, windows)
    design = Design(
        wish=wish,
        machine=machine,
        waveform=waveform,
        amplitude_n_m=factor * per_unit,
        limits=limits,
        peaks=predicted,
        accuracy=accuracy,
        windows=windows,
        recording_s=recording_s,
        hop=default_hop(waveform.lines.window),
        ramp_s=ceil(_RAMP_S * machine.rate_hz / waveform.lines.window) * waveform.lines.window / machine.rate_hz,
        choices=(),
    )
    return replace(design, choices=explained(design, found, why))


def _factor(wish: Wish, unit: Waveform, machine: Machine, limits: Bearable) -> tuple[float, str]:
    """What the unit waveform is to be multiplied by, and why."""
    if wish.amplitude_n_m is not None:
        return (1.0 if np.ndim(wish.amplitude_n_m) else float(np.asarray(wish.amplitude_n_m))), "as given"
    predicted = peaks(unit, machine)
    largest, first = room(predicted, limits)
    if first is not None and largest <= 0:
        check(predicted, limits, 1.0)
    needed = accuracy_of(unit, machine).factor_for(wish.accuracy)
    allowed = largest * (1 - _RESERVE)
    if needed == 0:
        if largest == inf:
            raise InputError("neither noise nor limits are known, so no amplitude can be chosen; give one of the three")
        return largest * _WITHOUT_NOISE, "a tenth of what the limits leave; nothing says how much noise there is"
    if needed <= allowed:
        return needed, f"the least for {100 * wish.accuracy:g} % at every line in one window"
    assert first is not None
    return allowed, f"the most that the {first.quantity} bears, less {100 * _RESERVE:g} %"


def _recording_s(waveform: Waveform, machine: Machine, windows: int) -> float:
    if machine.stroke_s is not None:
        return max(windows, _STROKES_MIN) * machine.stroke_s
    return (max(windows, _WINDOWS_MIN) + 1) * waveform.lines.window / waveform.lines.rate_hz


def explained(design: Design, found: Grid, amplitude_why: str) -> tuple[Choice, ...]:
    """The table: what was chosen, and why."""
    waveform, lines, machine = design.waveform, design.waveform.lines, design.machine
    f, window_s = lines.frequency_hz, lines.window / lines.rate_hz
    spacing = f"{np.diff(f).min():g} Hz apart" if len(f) > 1 else "alone"
    bound = HOLDING_95 * design.accuracy.relative / np.sqrt(design.windows)
    weakest = int(np.argmax(design.accuracy.relative))
    rows = [
        Choice("lines", f"{len(f)}, {f[0]:g} … {f[-1]:g} Hz, {spacing}", found.lines_why),
        Choice("window", f"{lines.window} samples, {1000 * window_s:.4g} ms", found.window_why),
        Choice("amplitude", f"{design.amplitude_n_m:.4g} N m", amplitude_why),
        Choice(
            "peak, rms", f"{waveform.peak:.4g}, {waveform.rms:.4g} N m", f"crest factor {waveform.crest_factor:.3f}"
        ),
    ]
    rows += [_limit_row(peak, design.limits) for peak in worst(design.peaks).values()]
    if machine.noise > 0:
        many = f"{design.windows} window{'s' * (design.windows > 1)}"
        told = f"at {f[weakest]:g} Hz after {many}; σ = {machine.noise:g}"
        rows.append(Choice("95 % bound", f"{100 * bound.max():.3g} % of |G|", told))
    rows.append(Choice("recording", f"{design.recording_s:.4g} s", _recording_why(design)))
    rows.append(Choice("bring in", f"over {design.ramp_s:.4g} s", "the peaks above are those of the periodic state"))
    rows.append(Choice("hop", f"{design.hop} samples", "a divisor of the window near a twentieth"))
    return tuple(rows)


def _recording_why(design: Design) -> str:
    if design.machine.stroke_s is not None:
        return f"{max(design.windows, _STROKES_MIN)} strokes: each passes every place once"
    if design.windows > _WINDOWS_MIN:
        return f"{design.windows} windows, averaged, and one before the first is whole"
    return f"{_WINDOWS_MIN} windows to learn sigma from, and one before the first is whole"


def _limit_row(peak: Peak, limits: Bearable) -> Choice:
    low, high = limits.of(peak.quantity)
    unit = UNITS[peak.quantity]
    borne = f"limits {low:g} … {high:g}" if peak.quantity == "travel" else f"limit {high:g}"
    limited = np.isfinite(high) or np.isfinite(low)
    size = f"{peak.low:.4g} … {peak.high:.4g}" if peak.quantity == "travel" else f"{peak.size:.3g}"
    alone = (
        f"{peak.own[0]:.4g} … {peak.own[1]:.4g}"
        if peak.quantity == "travel"
        else f"{max(peak.own[1], -peak.own[0]):.3g}"
    )
    where = f", {peak.place}" if peak.place else ""
    return Choice(
        f"peak {peak.quantity}",
        f"{size} {unit}",
        f"{borne if limited else 'no limit'}; the motion alone {alone}{where}",
    )
