"""ExperimentSpec: the specification of an experiment, before anything is chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from livebode.core import UsageError
from livebode.excitation import Phases
from livebode.excitation.chirp import Sweep
from livebode.experiment_design.mains import MAINS_HZ
from livebode.experiment_design.spec_checks import check

Kind = Literal["multisine", "odd", "prbs", "chirp", "stepped"]
Shape = Literal["flat", "equal snr"]


@dataclass(frozen=True, kw_only=True)
class ExperimentSpec:
    """Specification of an experiment; values that are None are chosen automatically.

    Parameters
    ----------
    band_hz, resolution_hz
        Band, and largest distance of the lines; or `lines` instead.
    lines, window
        Lines as in `Lines.parse`, and the period in samples.
    kind
        "odd", the default for a band: odd bins, one in four of them not excited at random, to separate distortion from
        noise; "multisine", the default for `lines`; "prbs", "chirp", "stepped": one line after the other.
    phases
        Of lines that are excited together: "low crest" (default), "schroeder" or "random".
    shape
        Amplitudes of the lines: "flat", or for an "equal snr" at the output of the machine.
    amplitude_n_m
        Of each line of a multisine (of a shaped one: their rms), of the chirp, of the steps or of the PRBS; a list has
        one for each line. None: the smallest for the accuracy, within the limits.
    accuracy
        Required 95 % bound of each line as a share of |G|, 1e-6 … 1.
    crest_factor_max
        A crest factor that must be reached; None: no requirement.
    resolution_n_m
        Step of the drive, for rounding.
    order, held_ticks
        Of the PRBS: length of its register, instead of a resolution, and ticks per bit.
    sweep
        Of the chirp: "linear" (default) or "logarithmic".
    periods
        Windows of each step of a stepped sine; default: 4.
    seed
        Of all random choices: the same seed gives the same excitation.
    mains_hz
        Mains whose harmonics the lines of a band avoid, by half a bin, where the grid allows; empty: none.

    Raises
    ------
    UsageError
        If a value is missing, invalid, of another kind, or specified twice.
    """

    band_hz: tuple[float, float] | None = None
    resolution_hz: float | None = None
    lines: str | None = None
    window: int | None = None
    kind: Kind | None = None
    phases: Phases | None = None
    shape: Shape = "flat"
    amplitude_n_m: float | Sequence[float] | None = None
    accuracy: float = 0.05
    crest_factor_max: float | None = None
    resolution_n_m: float | None = None
    order: int | None = None
    held_ticks: int | None = None
    sweep: Sweep | None = None
    periods: int | None = None
    seed: int = 0
    mains_hz: Sequence[float] = MAINS_HZ

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
