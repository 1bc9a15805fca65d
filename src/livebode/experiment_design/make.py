"""Converts a specification and its grid to a Waveform of amplitude one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import DesignError, Lines, UsageError
from livebode.excitation import Phases, chirp, equal_snr, multisine, prbs, stepped_sine
from livebode.experiment_design.grid import Grid
from livebode.experiment_design.machine import Machine
from livebode.experiment_design.waveform import Waveform
from livebode.experiment_design.wish import Wish

Floats = NDArray[np.float64]

REACHED = 1e-9


def unit_waveform(wish: Wish, found: Grid, machine: Machine) -> Waveform:
    """The excitation with an amplitude of 1 N m (of a list: with those), before limits and accuracy are applied."""
    lines = found.lines
    about: dict[str, Any] = {"kind": wish.kind, "seed": wish.seed}
    if wish.kind == "prbs":
        about |= {"order": found.order, "held_ticks": found.held_ticks}
        samples = prbs(found.order, held_ticks=found.held_ticks)
    elif wish.kind == "chirp":
        assert wish.band_hz is not None
        sweep = wish.sweep or "linear"
        about |= {"sweep": sweep, "band_hz": list(wish.band_hz)}
        samples = chirp(*wish.band_hz, lines.rate_hz, lines.window, sweep=sweep)
    else:
        each = amplitudes(wish, found.base or lines, machine)
        about |= {"shape": "as listed" if wish.listed else wish.shape}
        if found.base is not None:
            about |= {"periods": found.periods, "step_samples": found.base.window}
            samples = stepped_sine(found.base, each, periods=found.periods)
        else:
            phases: Phases = wish.phases or "low crest"
            about |= {"phases": phases}
            samples = multisine(lines, each, phases, seed=wish.seed)
    # A mean moves a loop at its start, far more than the lines do, without information; a PRBS and a chirp have one.
    made = Waveform(lines, samples - np.mean(samples), about)
    if wish.crest_factor_max is not None and made.crest_factor > wish.crest_factor_max * (1 + REACHED):
        raise DesignError(
            "crest-factor-not-reached",
            f"a crest factor of {wish.crest_factor_max:g} is not reached: the lowest found is {made.crest_factor:.4f}",
            f"allow {made.crest_factor + 5e-4:.3f}, or take {_lower(wish)}",
            argument="crest_factor_max",
            crest_factor=made.crest_factor,
            crest_factor_max=wish.crest_factor_max,
        )
    return made


def _lower(wish: Wish) -> str:
    searched = wish.phases in (None, "low crest")
    return "a PRBS" if searched else "phases = 'low crest'"


def amplitudes(wish: Wish, lines: Lines, machine: Machine) -> Floats:
    """Of each line, shape (lines,): as listed, else of rms 1."""
    if wish.listed:
        if len(wish.listed) != len(lines):
            raise UsageError(
                "wrong-shape",
                f"amplitude_n_m lists {len(wish.listed)} amplitudes for {len(lines)} lines",
                "give one for each line",
                argument="amplitude_n_m",
                amplitudes=len(wish.listed),
                lines=len(lines),
            )
        return np.array(wish.listed)
    if wish.shape == "flat":
        return np.ones(len(lines))
    f = lines.frequency_hz
    # For a moving machine, the worst case is the place of the smallest response, relative to the required accuracy.
    heard = [np.abs(machine.torque(p, f) * p.plant.response(f)) for p in machine.places]
    return equal_snr(np.min(heard, axis=0))
