"""The table that explains a design: chosen values and reasons."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from livebode.core import Lines, counted, meets_mains
from livebode_design._peaks import Peak, worst
from livebode_design.accuracy import encoder_words
from livebode_design.design import Choice, Design
from livebode_design.grid import LineChoice
from livebode_design.limits import MachineLimits
from livebode_design.machine import UNITS, Machine, Quantity

_LISTED_MAX = 4  # amplitudes
_LONG_S = 3600.0
_PER_LOOP = 2000  # frequencies at which the loop is computed
_BELOW = 0.1  # |L|: 20 dB below one


def explained(design: Design, found: LineChoice, amplitude_why: str, recording_why: str) -> tuple[Choice, ...]:
    """The table: chosen values and reasons."""
    waveform, lines, machine = design.waveform, design.waveform.lines, design.machine
    f, window_s = lines.frequency_hz, lines.window / lines.rate_hz
    spacing = f"{np.diff(f).min():g} Hz apart or more" if len(f) > 1 else "alone"
    if len(f) > 1 and np.ptp(np.diff(lines.bins)) == 0:
        spacing = f"{f[1] - f[0]:g} Hz apart"
    bound = design.accuracy.reached(design.windows)
    weakest = int(np.argmax(bound))
    rows = [
        Choice("lines", f"{len(f)}, {f[0]:g} … {f[-1]:g} Hz, {spacing}", found.lines_why),
        Choice("mains", _listed_hz(design.spec.mains_hz), _mains_words(lines, design.spec.mains_hz, found.mains)),
        Choice("window", f"{lines.window} samples, {1000 * window_s:.4g} ms", found.window_why),
        Choice("amplitude", _amplitude(design), amplitude_why),
        Choice(
            "peak, rms", f"{waveform.peak:.4g}, {waveform.rms:.4g} N m", f"crest factor {waveform.crest_factor:.3f}"
        ),
    ]
    rows += [_limit_row(peak, design.limits) for peak in worst(design.peaks).values()]
    if machine.loop.feedback is not None:
        rows.insert(1, _for_tuning(machine, float(f[-1])))
    if machine.noise > 0:
        reason = f"at {f[weakest]:g} Hz after {counted(design.windows, 'window')}; σ = {machine.noise:g}"
        rows.append(Choice("95 % bound", f"{100 * bound.max():.3g} % of |G|", reason))
    if (counts := design.encoder_counts) is not None:
        rows.append(Choice("encoder", *encoder_words(counts, f, moves=machine.stroke_s is not None)))
    rows.append(Choice("recording", _duration(design.recording_s), recording_why))
    rows.append(Choice("ramp up", f"over {design.ramp_s:.4g} s", "the peaks above are those of the periodic state"))
    even = lines.window % design.hop == 0
    hop_why = "a divisor of the window near a twentieth" if even else "a twentieth; no divisor of the window is near it"
    rows.append(Choice("hop", f"{design.hop} samples", hop_why))
    return tuple(rows)


def _for_tuning(machine: Machine, highest_hz: float) -> Choice:
    """Whether the lines reach to where the described loop is 20 dB below one at every place."""
    low, high = machine.band_hz or (machine.rate_hz / 2e4, machine.rate_hz / 2)
    f = np.geomspace(low, high, _PER_LOOP)
    feedback = machine.loop.feedback_at(f)
    size = np.max([np.abs(place.plant.response(f) * feedback) for place in machine.places], axis=0)
    loud = np.flatnonzero(size[:-1] >= _BELOW)
    last = float(f[loud[-1] + 1] if loud.size else f[0])
    why = "|L| of the described loop is 20 dB below one above it; `livebode tune` knows no mode above the lines"
    if last <= highest_hz:
        return Choice("for tuning", f"{highest_hz:g} Hz suffices", f"the lines reach {last:.4g} Hz: {why}")
    return Choice("for tuning", f"lines to {last:.4g} Hz", why)


def _listed_hz(frequencies: Sequence[float]) -> str:
    return ", ".join(f"{f:g}" for f in frequencies) + " Hz" if frequencies else "not avoided"


def _duration(seconds: float) -> str:
    if seconds < _LONG_S:
        return f"{seconds:.4g} s"
    days = seconds / 86400
    return f"{seconds:.4g} s, {f'{days:.3g} days' if days >= 1 else f'{seconds / 3600:.3g} h'}"


def _amplitude(design: Design) -> str:
    amplitude = design.amplitude_n_m
    if isinstance(amplitude, list):
        few = len(amplitude) <= _LISTED_MAX
        reason = ", ".join(f"{a:.4g}" for a in amplitude) if few else f"{min(amplitude):.4g} … {max(amplitude):.4g}"
        return f"{reason} N m"
    return f"{amplitude:.4g} N m" + ", rms of the lines" * (design.waveform.about.get("shape") == "equal snr")


def _limit_row(peak: Peak, limits: MachineLimits) -> Choice:
    """The peak with its limit, and the peak of the motion alone."""
    low, high = limits.of(peak.quantity)
    borne = "no limit"
    if limits.limited(peak.quantity):
        borne = f"limits {low:g} … {high:g}" if peak.quantity == "travel" else f"limit {high:g}"
    if peak.own is None:
        why = f"of the excitation; {borne}; the peak of the motion alone is not specified"
    else:
        why = f"{borne}; the motion alone {_size(peak.quantity, *peak.own)}"
    where = f", {peak.place}" if peak.place else ""
    return Choice(
        f"peak {peak.quantity}", f"{_size(peak.quantity, peak.low, peak.high)} {UNITS[peak.quantity]}", why + where
    )


def _size(quantity: Quantity, low: float, high: float) -> str:
    return f"{low:.4g} … {high:.4g}" if quantity == "travel" else f"{max(high, -low):.3g}"


def _mains_words(lines: Lines, mains_hz: Sequence[float], avoided: Sequence[int]) -> str:
    """Effect of the mains on the lines, for the table of a design; a warning where a line meets a harmonic."""
    left_out = ", ".join(f"{k * lines.resolution_hz:g}" for k in avoided)
    words = f"no line at {left_out} Hz" if avoided else ""
    met = lines.frequency_hz[meets_mains(lines.bins, lines.resolution_hz, mains_hz)]
    if met.size:
        shown = ", ".join(f"{f:g}" for f in met[:6]) + (" …" if met.size > 6 else "")
        return "; ".join(filter(None, (words, f"WARNING: hum adds to the lines at {shown} Hz; move them, or refine")))
    return words or "no line within half a bin of a harmonic"
