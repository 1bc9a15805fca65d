"""ExperimentSpec: the specification of an experiment, before anything is chosen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Literal, get_args

import numpy as np
from annotated_types import Ge, Le, Len

from livebode.core import MAINS_HZ, UsageError
from livebode.dataclass import dataclass
from livebode.excitation import ORDER_MAX, ORDER_MIN, Phases, Sweep, check_order

KIND_OF_KEY = {"order": "prbs", "rate_divider": "prbs", "sweep": "chirp", "periods": "stepped"}
RESOLUTION_MIN_HZ = 1e-6
STEP_MIN = 1e-12
MAINS_MIN_HZ = 1.0
ACCURACY_MIN, AMPLITUDE_MIN, AMPLITUDE_MAX = 1e-6, 1e-9, 1e9  # values outside are typing errors
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
        _check(self)

    @property
    def listed(self) -> list[float]:
        """The amplitudes if they are given one for each line; otherwise empty."""
        given = self.amplitude_n_m
        return [] if given is None or np.ndim(given) == 0 else np.asarray(given, dtype=float).tolist()


def _check(spec: ExperimentSpec) -> None:
    """Raise UsageError for a value that is missing, out of range, of another kind, or given twice."""
    _check_numbers(spec)
    _check_amplitude(spec)
    for error in (*_of_another_kind(spec), *_amplitudes_twice(spec)):
        raise error
    _check_band(spec)
    _check_distance(spec)
    if not all(np.isfinite(mains) and mains >= MAINS_MIN_HZ for mains in spec.mains_hz):
        raise _out_of_range(
            "mains_hz", list(spec.mains_hz), "a list of frequencies above 1 Hz", "write for example [50, 60]"
        )


def _out_of_range(name: str, value: object, expected: str, remedy: str, **facts: float) -> UsageError:
    return UsageError("out-of-range", f"{name}={value} is not {expected}", remedy, argument=name, value=value, **facts)


def _conflict(spec: ExperimentSpec, name: str, message: str, remedy: str) -> UsageError:
    return UsageError("conflict", message, remedy, argument=name, kind=spec.kind)


def _check_numbers(spec: ExperimentSpec) -> None:
    for name in ("resolution_hz", "accuracy", "crest_factor_max", "resolution_n_m"):
        value = getattr(spec, name)
        if value is not None and not (np.isfinite(value) and value > 0):
            raise _out_of_range(name, value, "a finite number above 0", "choose a number above 0")
    for name, low, remedy in (
        ("resolution_hz", RESOLUTION_MIN_HZ, "choose a coarser one"),
        ("resolution_n_m", STEP_MIN, "leave it out for no rounding"),
        ("crest_factor_max", 1, "allow more: a PRBS has 1"),
        ("window", 1, "give a whole number above 0"),
        ("rate_divider", 1, "give a whole number above 0"),
        ("periods", 1, "give a whole number above 0"),
        ("seed", 0, "give a whole number of at least 0"),
    ):
        value = getattr(spec, name)
        if value is not None and value < low:
            raise _out_of_range(name, value, f"at least {low:g}", remedy, low=low)
    if not ACCURACY_MIN <= spec.accuracy <= 1:
        remedy = "give it as a fraction of |G|, such as 0.05 for 5 %"
        raise _out_of_range("accuracy", spec.accuracy, f"from {ACCURACY_MIN:g} to 1", remedy, low=ACCURACY_MIN, high=1)


def _check_amplitude(spec: ExperimentSpec) -> None:
    given = np.atleast_1d(np.asarray(1.0 if spec.amplitude_n_m is None else spec.amplitude_n_m, dtype=np.float64))
    low, high, remedy = AMPLITUDE_MIN, AMPLITUDE_MAX, "leave it out to have it chosen"
    whole = np.all(np.isfinite(given)) and not np.any(given < 0) and given.any()
    if not (whole and low <= given.max() <= high):
        raise _out_of_range(
            "amplitude_n_m", spec.amplitude_n_m, f"finite and from {low:g} to {high:g} N m", remedy, low=low, high=high
        )


def _of_another_kind(spec: ExperimentSpec) -> Iterator[UsageError]:
    kind = spec.kind
    for name, whose in KIND_OF_KEY.items():
        if getattr(spec, name) is not None and kind != whose:
            yield _conflict(spec, name, f"{name} belongs to kind {whose!r}, and kind is {kind!r}", "leave it out")
    if spec.phases is not None and kind not in ("multisine", "odd"):
        message = f"phases belong to several lines at once, and kind is {kind!r}"
        yield _conflict(spec, "phases", message, "leave them out")
    if spec.lines is not None and kind not in ("multisine", "stepped"):
        remedy = "give band_hz instead of lines, or take a multisine"
        yield _conflict(spec, "lines", f"{kind!r} has its own lines", remedy)
    if spec.shape != "flat" and kind not in ("multisine", "odd", "stepped"):
        message, remedy = f"the lines of {kind!r} cannot be shaped", "leave out shape, or take a multisine"
        yield _conflict(spec, "shape", message, remedy)


def _amplitudes_twice(spec: ExperimentSpec) -> Iterator[UsageError]:
    if spec.listed and spec.shape != "flat":
        message = f"amplitude_n_m lists amplitudes, which shape = {spec.shape!r} would set"
        yield _conflict(spec, "shape", message, "leave one out")
    if spec.listed and spec.kind in ("prbs", "chirp"):
        message = f"amplitude_n_m lists {len(spec.listed)} amplitudes, but {spec.kind!r} has one"
        yield _conflict(spec, "amplitude_n_m", message, "give one amplitude")


def _check_band(spec: ExperimentSpec) -> None:
    if spec.band_hz is not None and np.shape(spec.band_hz) != (2,):
        remedy = "give two frequencies in Hz, such as [20, 140]"
        raise UsageError("wrong-shape", f"band_hz={spec.band_hz} is not a band", remedy, argument="band_hz")
    if spec.order is not None:
        check_order(spec.order)
    if spec.lines is None and spec.band_hz is None:
        remedy = "give the band to measure, such as [20, 140] Hz"
        raise UsageError("missing", "neither band_hz nor lines is given", remedy, argument="band_hz")


def _check_distance(spec: ExperimentSpec) -> None:
    """Check that exactly one setting determines the distance of the lines."""
    if spec.kind == "prbs" and spec.window is not None:
        message = f"a PRBS has 2^order - 1 bits, not a window of {spec.window}"
        raise _conflict(spec, "window", message, "give order or resolution_hz instead")
    names = ("resolution_hz", "window", "order") if spec.lines is None else ("lines", "band_hz", "resolution_hz")
    given = [name for name in names if getattr(spec, name) is not None]
    if not given:
        other = "order" if spec.kind == "prbs" else "window"
        message, remedy = f"neither resolution_hz nor {other} is given", "give the distance of the lines, resolution_hz"
        raise UsageError("missing", message, remedy, argument="resolution_hz")
    if len(given) > 1:
        raise _conflict(spec, given[1], f"{given[0]} and {given[1]} both determine the lines", "leave one out")
