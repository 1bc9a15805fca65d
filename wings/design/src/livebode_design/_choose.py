"""From a specification, a machine and its limits to an experiment, with the reasons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, inf
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Floats
from livebode.core import DesignError, Lines, UsageError, counted, meets_mains, rounded_down
from livebode.estimation import default_hop
from livebode.excitation import Phases, Waveform, chirp, multisine, prbs, stepped_sine
from livebode_design._peaks import Peak, peaks, worst
from livebode_design.accuracy import accuracy_of, encoder_words
from livebode_design.design import Choice, Design
from livebode_design.grid import LineChoice, grid
from livebode_design.limits import MachineLimits, beyond, check_known, room
from livebode_design.machine import UNITS, Machine, Quantity
from livebode_design.reversal import reversal
from livebode_design.spec import ExperimentSpec

_LISTED_MAX = 4  # amplitudes
_LONG_S = 3600.0
_PER_LOOP = 2000  # frequencies at which the loop is computed
_BELOW = 0.1  # |L|: 20 dB below one


def explained(design: Design, choice: LineChoice, amplitude_why: str, recording_why: str) -> tuple[Choice, ...]:
    """The table: chosen values and reasons."""
    waveform, lines, machine = design.waveform, design.waveform.lines, design.machine
    f, window_s = lines.frequency_hz, lines.window / lines.rate_hz
    spacing = f"{np.diff(f).min():g} Hz apart or more" if len(f) > 1 else "alone"
    if len(f) > 1 and np.ptp(np.diff(lines.bins)) == 0:
        spacing = f"{f[1] - f[0]:g} Hz apart"
    bound = design.accuracy.reached(design.windows)
    weakest = int(np.argmax(bound))
    rows = [
        Choice("lines", f"{len(f)}, {f[0]:g} … {f[-1]:g} Hz, {spacing}", choice.lines_why),
        Choice("mains", _listed_hz(design.spec.mains_hz), _mains_words(lines, design.spec.mains_hz, choice.mains)),
        Choice("window", f"{lines.window} samples, {1000 * window_s:.4g} ms", choice.window_why),
        Choice("amplitude", _amplitude(design), amplitude_why),
        Choice(
            "peak, rms", f"{waveform.peak:.4g}, {waveform.rms:.4g} N m", f"crest factor {waveform.crest_factor:.3f}"
        ),
    ]
    rows += [_limit_row(peak, design.limits) for peak in worst(design.peaks).values()]
    if (turned := reversal(waveform, machine)) is not None:
        rows.append(
            Choice("reversal", *turned.words(None if design.spec.listed else float(np.max(design.amplitude_n_m))))
        )
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


# Of the room that the limits leave: reserve for errors of the prediction.
_RESERVE = 0.1
_WITHOUT_NOISE = 0.1  # of the room, where the required amplitude is not known
# From rest the position drifts further than in the periodic state; with this ramp, by 3 % (studies/design.py).
_RAMP_S = 0.5
_STROKES_MIN = 2  # forward and return
_TRIES = 100  # to find an amplitude that passes when rounded to the drive's steps
_REACHED = 1e-9  # share of a crest factor that is rounding
_WINDOWS_MIN = 10  # sigma is estimated from the scatter between periods, which needs several


def choose(spec: ExperimentSpec, machine: Machine, limits: MachineLimits | None = None) -> Design:
    """The experiment for a specification: lines and window by the resolution, amplitude by accuracy and limits.

    Raises
    ------
    LivebodeError
        If a limit would be exceeded (with the largest amplitude that passes), the grid has no such lines, a crest
        factor is not reached, or the excitation vanishes in the drive's steps.
    """
    limits = limits or MachineLimits()
    check_known(machine, limits)
    choice = grid(spec, machine.rate_hz)
    unit = _unit_waveform(spec, choice, machine)
    of_unit = peaks(unit, machine)  # rejected where it has power outside of the known band of the machine
    factor, why = _factor(spec, unit, of_unit, machine, limits)
    waveform = _played(spec, unit, factor)
    predicted = peaks(waveform, machine)
    share, first = room(predicted, limits)
    if share < 1 and first is not None:
        passing = _passing(spec, unit, factor, share, machine, limits)
        raise beyond(first, limits, share, None if spec.listed else factor, passing)
    accuracy = accuracy_of(waveform, machine)
    windows = accuracy.windows(spec.accuracy)
    ramp_s = ceil(_RAMP_S * machine.rate_hz / waveform.lines.window) * waveform.lines.window / machine.rate_hz
    waveform = replace(waveform, about={**waveform.about, "ramp_s": ramp_s})
    recording_s, recording_why = _recording(waveform, machine, windows)
    if recording_s > _LONG_S and windows > 1:
        in_time = max(1, int(windows * _LONG_S / recording_s))
        recording_why += f"; an hour is enough for {100 * accuracy.reached(in_time).max():.2g} %"
    design = Design(
        spec=spec,
        machine=machine,
        waveform=waveform,
        amplitude_n_m=spec.listed or factor,
        limits=limits,
        peaks=predicted,
        accuracy=accuracy,
        windows=windows,
        recording_s=recording_s,
        hop=default_hop(waveform.lines.window),
        choices=(),
    )
    return replace(design, choices=explained(design, choice, why, recording_why))


def _played(spec: ExperimentSpec, unit: Waveform, factor: float) -> Waveform:
    """The waveform as the drive plays it."""
    waveform = replace(unit.scaled(factor), about={**unit.about, "amplitude_n_m": spec.listed or factor})
    if spec.resolution_n_m is None:
        return waveform
    waveform = waveform.quantised(spec.resolution_n_m)
    if spec.crest_factor_max is not None and waveform.crest_factor > spec.crest_factor_max * (1 + _REACHED):
        raise DesignError(
            "crest-factor-not-reached",
            f"rounding to steps of {spec.resolution_n_m:g} N m gives a crest factor "
            f"of {waveform.crest_factor:.4f}, above {spec.crest_factor_max:g}",
            f"allow {waveform.crest_factor + 5e-4:.3f}, or take finer steps",
            crest_factor=waveform.crest_factor,
            crest_factor_max=spec.crest_factor_max,
        )
    return waveform


def _passing(
    spec: ExperimentSpec, unit: Waveform, factor: float, share: float, machine: Machine, limits: MachineLimits
) -> float:
    """A factor near the largest whose excitation is within the limits, in four digits; 0 where there is none.

    `share` is the room at the factor that is not. Rounding to the drive's steps is not linear: a factor predicted from
    the peaks at another one may fail.
    """
    for _ in range(_TRIES):
        if share <= 0:
            break
        factor = rounded_down(factor * min(share, 1 - 1e-3))
        try:
            share, _ = room(peaks(_played(spec, unit, factor), machine), limits)
        except DesignError:  # too small for the steps
            break
        if share >= 1:
            return factor
    return 0.0


def _factor(
    spec: ExperimentSpec, unit: Waveform, of_unit: tuple[Peak, ...], machine: Machine, limits: MachineLimits
) -> tuple[float, str]:
    """Factor of the unit waveform, and the reason."""
    if spec.amplitude_n_m is not None:
        return (1.0 if spec.listed else float(np.asarray(spec.amplitude_n_m))), "as given"
    largest, first = room(of_unit, limits)
    if first is not None and largest <= 0:
        raise beyond(first, limits, largest, None, 0.0)
    needed = accuracy_of(unit, machine).factor_for(spec.accuracy)
    allowed = largest * (1 - _RESERVE)
    if needed == 0:
        if largest == inf:
            raise DesignError(
                "amplitude-undetermined",
                "neither noise nor limits are known, so no amplitude can be chosen",
                "specify the amplitude, the noise, or a limit",
                argument="amplitude_n_m",
            )
        return largest * _WITHOUT_NOISE, "a tenth of the room within the limits, because the noise is not known"
    if needed <= allowed:
        rounded = "" if spec.resolution_n_m is None else ", before rounding"
        return needed, f"the smallest for {100 * spec.accuracy:g} % at every line in one window{rounded}"
    assert first is not None
    return allowed, f"the largest within the {first.quantity} limit, less {100 * _RESERVE:g} %"


def _recording(waveform: Waveform, machine: Machine, windows: int) -> tuple[float, str]:
    """Recording time, and the reason."""
    if machine.stroke_s is not None:
        strokes = max(windows, _STROKES_MIN)
        return strokes * machine.stroke_s, f"{strokes} strokes: each passes every place once"
    many = max(windows, _WINDOWS_MIN)
    why = "averaged" if windows > _WINDOWS_MIN else "to estimate sigma"
    seconds = (many + 1) * waveform.lines.window / waveform.lines.rate_hz
    return seconds, f"{many} windows, {why}, and one before the first is whole"


def _unit_waveform(spec: ExperimentSpec, choice: LineChoice, machine: Machine) -> Waveform:
    """The excitation with an amplitude of 1 N m (of a list: with those), before limits and accuracy are applied."""
    lines = choice.lines
    about: dict[str, Any] = {"kind": spec.kind, "seed": spec.seed}
    if spec.kind == "prbs":
        about |= {"order": choice.order, "rate_divider": choice.rate_divider}
        samples = prbs(choice.order, rate_divider=choice.rate_divider)
    elif spec.kind == "chirp":
        assert spec.band_hz is not None
        sweep = spec.sweep or "linear"
        about |= {"sweep": sweep, "band_hz": list(spec.band_hz)}
        samples = chirp(*spec.band_hz, lines.rate_hz, lines.window, sweep=sweep)
    else:
        each = _amplitudes(spec, choice.base or lines, machine)
        about |= {"shape": "as listed" if spec.listed else spec.shape}
        if choice.base is not None:
            about |= {"periods": choice.periods, "step_samples": choice.base.window}
            samples = stepped_sine(choice.base, each, periods=choice.periods)
        else:
            phases: Phases = spec.phases or "low crest"
            about |= {"phases": phases}
            samples = multisine(lines, each, phases, seed=spec.seed)
    # A mean moves a loop at its start, far more than the lines do, without information; a PRBS and a chirp have one.
    made = Waveform(lines, samples - np.mean(samples), about)
    if spec.crest_factor_max is not None and made.crest_factor > spec.crest_factor_max * (1 + _REACHED):
        raise DesignError(
            "crest-factor-not-reached",
            f"a crest factor of {spec.crest_factor_max:g} is not reached: the lowest found is {made.crest_factor:.4f}",
            f"allow {made.crest_factor + 5e-4:.3f}, or take {_lower(spec)}",
            argument="crest_factor_max",
            crest_factor=made.crest_factor,
            crest_factor_max=spec.crest_factor_max,
        )
    return made


def _lower(spec: ExperimentSpec) -> str:
    searched = spec.phases in (None, "low crest")
    return "a PRBS" if searched else "phases = 'low crest'"


def _amplitudes(spec: ExperimentSpec, lines: Lines, machine: Machine) -> Floats:
    """Amplitude of each line, shape (lines,): as listed, else of rms 1."""
    if spec.listed:
        if len(spec.listed) != len(lines):
            raise UsageError(
                "wrong-shape",
                f"amplitude_n_m lists {len(spec.listed)} amplitudes for {len(lines)} lines",
                "give one for each line",
                argument="amplitude_n_m",
                amplitudes=len(spec.listed),
                lines=len(lines),
            )
        return np.array(spec.listed)
    if spec.shape == "flat":
        return np.ones(len(lines))
    f = lines.frequency_hz
    # For a moving machine, the worst case is the place of the smallest response, relative to the required accuracy.
    heard = [np.abs(machine.torque(p, f) * p.plant.response(f)) for p in machine.places]
    return equal_snr(np.min(heard, axis=0))


def equal_snr(response: ArrayLike, noise: ArrayLike = 1.0) -> Floats:
    """Amplitudes of the lines for the same signal-to-noise ratio at the output, shape (lines,), of rms 1.

    A_k ∝ noise_k/|Y/W|_k. The relative error of a line, sigma/|G|, is then the same for all.

    Parameters
    ----------
    response
        Y/W at the lines, from the excitation to the measured output, shape (lines,); of a machine whose response
        changes, the smallest magnitude at each line.
    noise
        Standard deviation of the output's noise, one for white noise or one for each line, in any unit.

    Raises
    ------
    UsageError
        If a response is zero or not finite: no amplitude reaches the ratio at such a line.

    Examples
    --------
    >>> equal_snr([1.0, 0.5]) * np.sqrt(2.5)
    array([1., 2.])
    """
    size = np.abs(np.asarray(response, dtype=np.complex128))
    if not size.size or not np.all(np.isfinite(size) & (size > 0)):
        line = int(np.argmin(np.where(np.isfinite(size), size, 0.0))) if size.size else 0
        raise UsageError(
            "not-finite",
            f"the response at line {line} is zero or not finite",
            "leave out that line",
            argument="response",
            line=line,
        )
    required = np.asarray(noise, dtype=np.float64) / size
    return np.asarray(required / np.sqrt(np.mean(required**2)))
