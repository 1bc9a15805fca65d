"""Wish: what a person wants to know of a machine, before anything is chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from livebode.core import UsageError
from livebode.design.mains import MAINS_HZ
from livebode.design.wish_checks import check
from livebode.excitation import Phases
from livebode.excitation.chirp import Sweep

Kind = Literal["multisine", "odd", "prbs", "chirp", "stepped"]
Shape = Literal["flat", "equal snr"]


@dataclass(frozen=True, kw_only=True)
class Wish:
    """An experiment as it is asked for; what is None is chosen.

    Parameters
    ----------
    band_hz, resolution_hz
        From where to where, and how far apart the lines may be; or `lines` instead.
    lines, window
        Lines as in `Lines.parse`, and the period in samples.
    kind
        "odd", which is chosen for a band: odd bins, one in four of them left quiet at random, to tell distortion from
        noise; "multisine", which is chosen for `lines`; "prbs", "chirp", "stepped": one line after the other.
    phases
        Of lines that are excited together: "low crest", which is chosen, "schroeder" or "random".
    shape
        Amplitudes of the lines: "flat", or for an "equal snr" at the output of the machine.
    amplitude_n_m
        Of each line of a multisine (of a shaped one: their rms), of the chirp, of the steps or of the PRBS; a list has
        one for each line. None: as small as the accuracy allows, and within the limits.
    accuracy
        Wanted 95 % bound of each line as a share of |G|, 1e-6 … 1.
    crest_factor_max
        A crest factor that must be reached; None asks for none.
    resolution_n_m
        Step of the drive, to round to.
    order, held_ticks
        Of the PRBS: length of its register, instead of a resolution, and ticks that a bit stands.
    sweep
        Of the chirp: "linear", which is chosen, or "logarithmic".
    periods
        Windows that each step of a stepped sine takes; 4 are chosen.
    seed
        Of all that is random: the same seed, the same excitation.
    mains_hz
        Mains whose harmonics the lines of a band avoid, by half a bin, where the grid allows; empty: none.

    Raises
    ------
    UsageError
        If something is missing, cannot be, is of another kind, or is said twice.
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
                    f"{name}={word!r} is not known",
                    f"choose {', '.join(map(repr, filter(None, known)))}",
                    argument=name,
                    value=word,
                    allowed=[w for w in known if w],
                )
        check(self)

    @property
    def listed(self) -> list[float]:
        """The amplitudes that are given one for each line; empty where they are not."""
        given = self.amplitude_n_m
        return [] if given is None or np.ndim(given) == 0 else np.asarray(given, dtype=float).tolist()
