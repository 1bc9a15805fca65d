"""Wish: what a person wants to know of a machine, before anything is chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from livebode.core import UsageError
from livebode.design.mains import MAINS_HZ
from livebode.excitation import Phases, check_order
from livebode.excitation.chirp import Sweep

Kind = Literal["multisine", "odd", "prbs", "chirp", "stepped"]
Shape = Literal["flat", "equal snr"]

_WHOSE = {"order": "prbs", "held_ticks": "prbs", "sweep": "chirp", "periods": "stepped"}
_RESOLUTION_MIN_HZ = 1e-6
_STEP_MIN = 1e-12
_MAINS_MIN_HZ = 1.0
_ACCURACY_MIN, _AMPLITUDE_MIN, _AMPLITUDE_MAX = 1e-6, 1e-9, 1e9  # beyond them is a slip of the pen


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
        self._check_numbers()
        self._check_amplitude()
        self._check_whose()
        self._check_grid()
        self._check_mains()

    def _check_mains(self) -> None:
        if not all(np.isfinite(mains) and mains >= _MAINS_MIN_HZ for mains in self.mains_hz):
            raise UsageError(
                "out-of-range",
                f"mains_hz={list(self.mains_hz)} is not a list of frequencies above 1 Hz",
                "write for example [50, 60]",
                argument="mains_hz",
                value=list(self.mains_hz),
            )

    def _check_whose(self) -> None:
        for name, kind in _WHOSE.items():
            if getattr(self, name) is not None and self.kind != kind:
                raise UsageError(
                    "conflict",
                    f"{name} belongs to kind {kind!r}, and kind is {self.kind!r}",
                    "leave it out",
                    argument=name,
                    kind=self.kind,
                )
        if self.phases is not None and self.kind not in ("multisine", "odd"):
            raise UsageError(
                "conflict",
                f"phases belong to several lines at once, and kind is {self.kind!r}",
                "leave them out",
                argument="phases",
                kind=self.kind,
            )
        if self.lines is not None and self.kind not in ("multisine", "stepped"):
            raise UsageError(
                "conflict",
                f"{self.kind!r} has its own lines",
                "give band_hz instead of lines, or take a multisine",
                argument="lines",
                kind=self.kind,
            )
        if self.shape != "flat" and self.kind not in ("multisine", "odd", "stepped"):
            raise UsageError(
                "conflict",
                f"the lines of {self.kind!r} cannot be shaped",
                "leave out shape, or take a multisine",
                argument="shape",
                kind=self.kind,
            )
        if self.listed and self.shape != "flat":
            raise UsageError(
                "conflict",
                f"amplitude_n_m lists amplitudes, which shape = {self.shape!r} would set",
                "leave one out",
                argument="shape",
                shape=self.shape,
            )
        if self.listed and self.kind in ("prbs", "chirp"):
            raise UsageError(
                "conflict",
                f"amplitude_n_m lists {len(self.listed)} amplitudes, but {self.kind!r} has one",
                "give one amplitude",
                argument="amplitude_n_m",
                kind=self.kind,
            )

    def _check_grid(self) -> None:
        if self.band_hz is not None and np.shape(self.band_hz) != (2,):
            raise UsageError(
                "wrong-shape",
                f"band_hz={self.band_hz} is not a band",
                "give two frequencies in Hz, such as [20, 140]",
                argument="band_hz",
            )
        if self.order is not None:
            check_order(self.order)
        if self.lines is None and self.band_hz is None:
            raise UsageError(
                "missing",
                "neither band_hz nor lines is given",
                "give the band to measure, such as [20, 140] Hz",
                argument="band_hz",
            )
        if self.kind == "prbs" and self.window is not None:
            raise UsageError(
                "conflict",
                f"a PRBS has 2^order - 1 bits, not a window of {self.window}",
                "give order or resolution_hz instead",
                argument="window",
                kind=self.kind,
            )
        apart = [name for name in ("lines", "resolution_hz", "window", "order") if getattr(self, name) is not None]
        if self.lines is not None:
            apart = [name for name in ("lines", "band_hz", "resolution_hz") if getattr(self, name) is not None]
        if not apart:
            other = "order" if self.kind == "prbs" else "window"
            raise UsageError(
                "missing",
                f"neither resolution_hz nor {other} is given",
                "give the distance of the lines as resolution_hz",
                argument="resolution_hz",
            )
        if len(apart) > 1:
            raise UsageError(
                "conflict",
                f"{apart[0]} and {apart[1]} both determine the lines",
                "leave one out",
                argument=apart[1],
                arguments=apart[:2],
            )

    @property
    def listed(self) -> list[float]:
        """The amplitudes that are given one for each line; empty where they are not."""
        given = self.amplitude_n_m
        return [] if given is None or np.ndim(given) == 0 else np.asarray(given, dtype=float).tolist()

    def _check_numbers(self) -> None:
        for name in ("resolution_hz", "accuracy", "crest_factor_max", "resolution_n_m"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise UsageError(
                    "out-of-range",
                    f"{name}={value} is not a finite number above 0",
                    "correct it",
                    argument=name,
                    value=value,
                )
        if self.resolution_hz is not None and self.resolution_hz < _RESOLUTION_MIN_HZ:
            raise UsageError(
                "out-of-range",
                f"resolution_hz={self.resolution_hz} is below {_RESOLUTION_MIN_HZ:g}",
                "choose a coarser one",
                argument="resolution_hz",
                value=self.resolution_hz,
                low=_RESOLUTION_MIN_HZ,
            )
        if self.resolution_n_m is not None and self.resolution_n_m < _STEP_MIN:
            raise UsageError(
                "out-of-range",
                f"resolution_n_m={self.resolution_n_m} is below {_STEP_MIN:g}",
                "leave it out for no rounding",
                argument="resolution_n_m",
                value=self.resolution_n_m,
                low=_STEP_MIN,
            )
        if not _ACCURACY_MIN <= self.accuracy <= 1:
            raise UsageError(
                "out-of-range",
                f"accuracy={self.accuracy} is not from {_ACCURACY_MIN:g} to 1",
                "give it as a fraction of |G|, such as 0.05 for 5 %",
                argument="accuracy",
                value=self.accuracy,
                low=_ACCURACY_MIN,
                high=1,
            )
        if self.crest_factor_max is not None and self.crest_factor_max < 1:
            raise UsageError(
                "out-of-range",
                f"crest_factor_max={self.crest_factor_max} is below 1, the crest factor of a PRBS",
                "allow more",
                argument="crest_factor_max",
                value=self.crest_factor_max,
                low=1,
            )
        for name in ("window", "held_ticks", "periods"):
            value = getattr(self, name)
            if value is not None and value < 1:
                raise UsageError(
                    "out-of-range",
                    f"{name}={value} is below 1",
                    "give a whole number above 0",
                    argument=name,
                    value=value,
                    low=1,
                )
        if self.seed < 0:
            raise UsageError(
                "out-of-range",
                f"seed={self.seed} is below 0",
                "give a whole number of at least 0",
                argument="seed",
                value=self.seed,
                low=0,
            )

    def _check_amplitude(self) -> None:
        given = np.atleast_1d(np.asarray(1.0 if self.amplitude_n_m is None else self.amplitude_n_m, dtype=np.float64))
        if not np.all(np.isfinite(given)) or np.any(given < 0) or not given.any():
            raise UsageError(
                "out-of-range",
                f"amplitude_n_m={self.amplitude_n_m} is not finite and above 0",
                "leave it out to have it chosen",
                argument="amplitude_n_m",
                value=given.tolist(),
            )
        if not _AMPLITUDE_MIN <= given.max() <= _AMPLITUDE_MAX:
            raise UsageError(
                "out-of-range",
                f"amplitude_n_m={self.amplitude_n_m} is not from {_AMPLITUDE_MIN:g} to {_AMPLITUDE_MAX:g} N m",
                "leave it out to have it chosen",
                argument="amplitude_n_m",
                value=given.tolist(),
                low=_AMPLITUDE_MIN,
                high=_AMPLITUDE_MAX,
            )
