"""Converts a specification and its grid to a Waveform of amplitude one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Floats
from livebode.core import DesignError, Lines, UsageError
from livebode.excitation import Phases, Waveform, chirp, multisine, prbs, stepped_sine
from livebode_design.grid import LineChoice
from livebode_design.machine import Machine
from livebode_design.spec import ExperimentSpec

REACHED = 1e-9


def unit_waveform(spec: ExperimentSpec, found: LineChoice, machine: Machine) -> Waveform:
    """The excitation with an amplitude of 1 N m (of a list: with those), before limits and accuracy are applied."""
    lines = found.lines
    about: dict[str, Any] = {"kind": spec.kind, "seed": spec.seed}
    if spec.kind == "prbs":
        about |= {"order": found.order, "rate_divider": found.rate_divider}
        samples = prbs(found.order, rate_divider=found.rate_divider)
    elif spec.kind == "chirp":
        assert spec.band_hz is not None
        sweep = spec.sweep or "linear"
        about |= {"sweep": sweep, "band_hz": list(spec.band_hz)}
        samples = chirp(*spec.band_hz, lines.rate_hz, lines.window, sweep=sweep)
    else:
        each = amplitudes(spec, found.base or lines, machine)
        about |= {"shape": "as listed" if spec.listed else spec.shape}
        if found.base is not None:
            about |= {"periods": found.periods, "step_samples": found.base.window}
            samples = stepped_sine(found.base, each, periods=found.periods)
        else:
            phases: Phases = spec.phases or "low crest"
            about |= {"phases": phases}
            samples = multisine(lines, each, phases, seed=spec.seed)
    # A mean moves a loop at its start, far more than the lines do, without information; a PRBS and a chirp have one.
    made = Waveform(lines, samples - np.mean(samples), about)
    if spec.crest_factor_max is not None and made.crest_factor > spec.crest_factor_max * (1 + REACHED):
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


def amplitudes(spec: ExperimentSpec, lines: Lines, machine: Machine) -> Floats:
    """Of each line, shape (lines,): as listed, else of rms 1."""
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
