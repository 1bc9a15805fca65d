"""ExperimentSpec: the specification of an experiment, before anything is chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, get_args

import numpy as np
from annotated_types import Ge, Le, Len

from livebode.core import MAINS_HZ, UsageError
from livebode.excitation import ORDER_MAX, ORDER_MIN, Phases, Sweep
from livebode_design.spec_checks import (
    ACCURACY_MIN,
    AMPLITUDE_MAX,
    AMPLITUDE_MIN,
    MAINS_MIN_HZ,
    RESOLUTION_MIN_HZ,
    STEP_MIN,
    check,
)

Kind = Literal["multisine", "odd", "prbs", "chirp", "stepped"]
Shape = Literal["flat", "equal snr"]
_Count = Annotated[int, Ge(1)]
_Amplitude = Annotated[float, Ge(AMPLITUDE_MIN), Le(AMPLITUDE_MAX)]
_OfALine = Annotated[float, Ge(0), Le(AMPLITUDE_MAX)]


@dataclass(frozen=True, kw_only=True)
class ExperimentSpec:
    """Specification of an experiment; values that are omitted are chosen automatically.

    Parameters
    ----------
    band_hz
        Lowest and highest frequency of the lines, Hz.
    resolution_hz
        Largest distance of the lines, Hz; up to 5,000 lines.
    lines
        Instead of a band: the lines as a text in Hz, as in `livebode run`: "20:140:20".
    window
        Instead of a resolution: the period in samples.
    kind
        "odd": odd bins of a band, one in four of them not excited at random, to separate distortion from noise.
        "multisine": all odd bins of a band, or the given lines. "prbs": shift register. "chirp": all bins of the band.
        "stepped": one line after the other. Default: "odd"
        for a band, "multisine" for lines.
    phases
        Phases of lines that are excited together. Default: "low crest".
    shape
        Amplitudes of the lines. "equal snr": proportional to 1/|Y/W|, so that every line becomes equally accurate.
    amplitude_n_m
        Amplitude of each line of a multisine (of a shaped one: their rms), of the chirp, of the steps or of the PRBS,
        N m; a list has one for each line. Default: the smallest for the accuracy, within the limits.
    accuracy
        Required 95 % bound of each line as a share of |G|.
    crest_factor_max
        A crest factor that must be reached. Default: no requirement.
    resolution_n_m
        Step of the drive, N m: samples are rounded to it. Default: no rounding.
    order
        Length of the register of a PRBS, instead of a resolution.
    rate_divider
        Ticks for which each bit of a PRBS is held. Default: chosen for the band.
    sweep
        Sweep of a chirp. Default: "linear".
    periods
        Windows of each step of a stepped sine. Default: 4.
    seed
        Seed of all random choices: the same seed gives the same excitation.
    mains_hz
        Mains whose harmonics the lines of a band avoid by half a bin, Hz, unless more than half of the lines would be
        lost; empty: none.

    Raises
    ------
    UsageError
        If a value is missing, invalid, of another kind, or specified twice.
    """

    band_hz: tuple[float, float] | None = None
    resolution_hz: Annotated[float, Ge(RESOLUTION_MIN_HZ)] | None = None
    lines: str | None = None
    window: _Count | None = None
    kind: Kind | None = None
    phases: Phases | None = None
    shape: Shape = "flat"
    amplitude_n_m: _Amplitude | Annotated[Sequence[_OfALine], Len(1)] | None = None
    accuracy: Annotated[float, Ge(ACCURACY_MIN), Le(1)] = 0.05
    crest_factor_max: Annotated[float, Ge(1)] | None = None
    resolution_n_m: Annotated[float, Ge(STEP_MIN)] | None = None
    order: Annotated[int, Ge(ORDER_MIN), Le(ORDER_MAX)] | None = None
    rate_divider: _Count | None = None
    sweep: Sweep | None = None
    periods: _Count | None = None
    seed: Annotated[int, Ge(0)] = 0
    mains_hz: Sequence[Annotated[float, Ge(MAINS_MIN_HZ)]] = MAINS_HZ

    def __post_init__(self) -> None:
        if self.kind is None:
            object.__setattr__(self, "kind", "odd" if self.lines is None else "multisine")
        for name, known in (
            ("kind", get_args(Kind)),
            ("phases", (None, *get_args(Phases))),
            ("shape", get_args(Shape)),
            ("sweep", (None, *get_args(Sweep))),
        ):
            if (word := getattr(self, name)) not in known:
                raise UsageError(
                    "not-one-of",
                    f"{name}={word!r} is not supported",
                    f"choose {', '.join(map(repr, filter(None, known)))}",
                    argument=name,
                    value=word,
                    allowed=[w for w in known if w],
                )
        check(self)

    @property
    def listed(self) -> list[float]:
        """The amplitudes if they are given one for each line; otherwise empty."""
        given = self.amplitude_n_m
        return [] if given is None or np.ndim(given) == 0 else np.asarray(given, dtype=float).tolist()
