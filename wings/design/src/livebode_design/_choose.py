"""From a specification, a machine and its limits to an experiment, with the reasons."""

from __future__ import annotations

from dataclasses import replace
from math import ceil, inf

import numpy as np

from livebode.core import DesignError, rounded_down
from livebode.estimation import default_hop
from livebode.excitation import Waveform
from livebode_design._peaks import Peak, peaks
from livebode_design.accuracy import accuracy_of
from livebode_design.design import Design
from livebode_design.explain import explained
from livebode_design.grid import grid
from livebode_design.limits import MachineLimits, beyond, check_known, room
from livebode_design.machine import Machine
from livebode_design.make import REACHED, unit_waveform
from livebode_design.spec import ExperimentSpec

# Of the room that the limits leave: reserve for errors of the prediction.
_RESERVE = 0.1
_WITHOUT_NOISE = 0.1  # of the room, where the required amplitude is not known
# From rest the position drifts further than in the periodic state; with this ramp, by 3 % (studies/design.py).
_RAMP_S = 0.5
_STROKES_MIN = 2  # forward and return
_LONG_S = 3600.0
_TRIES = 100  # to find an amplitude that passes when rounded to the drive's steps
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
    found = grid(spec, machine.rate_hz)
    unit = unit_waveform(spec, found, machine)
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
    return replace(design, choices=explained(design, found, why, recording_why))


def _played(spec: ExperimentSpec, unit: Waveform, factor: float) -> Waveform:
    """The waveform as the drive plays it."""
    waveform = replace(unit.scaled(factor), about={**unit.about, "amplitude_n_m": spec.listed or factor})
    if spec.resolution_n_m is None:
        return waveform
    waveform = waveform.quantised(spec.resolution_n_m)
    if spec.crest_factor_max is not None and waveform.crest_factor > spec.crest_factor_max * (1 + REACHED):
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
