"""Choice of the lines and the grid."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import ceil, floor, gcd, lcm, log2

import numpy as np

from livebode.core import WINDOW_MAX, GridError, Lines, check_window, counted, meets_mains
from livebode.dataclass import dataclass
from livebode.estimation import default_hop
from livebode.excitation import ORDER_MAX, ORDER_MIN, check_band, chirp_lines, odd_bins, odd_lines, stepped_lines
from livebode_design.spec import ExperimentSpec

_PERIODS = 4  # of each line of a stepped sine: the first of them is its transient
_QUIET_BETWEEN = 2  # bins from line to line, so that one between them shows the noise
_GROUP = 4  # odd bins in a group of which one is not excited
_BITS_PER_PERIOD = 2.5  # of the band's upper end: a PRBS has lost 2.4 dB there, and its first zero is well above
_HOP_NEAR = 1.25  # times a twentieth of the window, or that part of it
_LONGER_MAX = 1.05  # than the resolution requires, to find a window that a hop divides
_LINES_MAX = 5000  # with more lines, the share of each within the limits is too small
_WORTH_FACTORS = 1000  # a longer window, due to lines typed with many digits, is not intended (times the rate)


@dataclass(frozen=True)
class LineChoice:
    """Lines with their window, the reason for them, and the parameters of a PRBS."""

    lines: Lines
    window_why: str
    lines_why: str
    order: int = 0
    rate_divider: int = 1
    base: Lines | None = None  # of a stepped sine: the grid of one step
    periods: int = 0  # of each step
    mains: tuple[int, ...] = ()  # bins of the band that are not used because of the mains


def grid(spec: ExperimentSpec, rate_hz: float) -> LineChoice:
    """The lines and the window of a specification.

    Raises
    ------
    GridError
        If the band is not below the Nyquist frequency, the lines are closer than any window resolves or more than
        5,000, or given lines are off the grid of a given window; the message has the nearest choice.
    """
    choice = _found(spec, rate_hz)
    if len(choice.lines) > _LINES_MAX:
        raise _too_many(spec, choice.lines, rate_hz)
    return choice


def _too_many(spec: ExperimentSpec, lines: Lines, rate_hz: float) -> GridError:
    """The error with the order, or the resolution, that gives few enough lines."""
    f, many = lines.frequency_hz, len(lines)
    facts: dict[str, float] = {}
    if spec.order is not None:
        order = spec.order - ceil(log2(many / _LINES_MAX))
        facts["order_max"], fewer = order, f"take order {order}"
    else:  # the period of a PRBS is rounded up to a power of two
        finest_hz = ceil(1000 * (2 if spec.kind == "prbs" else 1) * (f[-1] - f[0]) / (_LINES_MAX - 1)) / 1000
        # The window may be longer than the resolution requires, which gives more lines.
        while spec.lines is None and len(_found(_coarser(spec, finest_hz), rate_hz).lines) > _LINES_MAX:
            finest_hz = round(finest_hz + 0.001, 3)
        facts["resolution_hz_min"], fewer = finest_hz, f"take lines {finest_hz:g} Hz or more apart"
    return GridError(
        "too-many-lines",
        f"{many} lines from {f[0]:g} to {f[-1]:g} Hz are more than {_LINES_MAX}",
        f"{fewer}, or narrow the band",
        lines=many,
        lines_max=_LINES_MAX,
        **facts,
    )


def _coarser(spec: ExperimentSpec, resolution_hz: float) -> ExperimentSpec:
    return replace(spec, resolution_hz=resolution_hz, window=None)


def _found(spec: ExperimentSpec, rate_hz: float) -> LineChoice:
    if spec.lines is not None:
        return _stepped(spec, _of_text(spec, spec.lines, rate_hz))
    assert spec.band_hz is not None
    low, high = spec.band_hz
    check_band(low, high, rate_hz)
    if spec.kind == "prbs":
        return _prbs(spec, low, high, rate_hz)
    if spec.window is not None:
        check_window(spec.window, rate_hz)
    apart = 1 if spec.kind in ("chirp", "stepped") else _QUIET_BETWEEN
    window, why = (spec.window, "as given") if spec.window else _window(spec.resolution_hz or 0.0, apart, rate_hz)
    if spec.kind == "chirp":
        return LineChoice(chirp_lines(low, high, rate_hz, window), why, "every bin of the band")
    if spec.kind == "stepped":
        first, last = ceil(low * window / rate_hz - 1e-9), floor(high * window / rate_hz + 1e-9)
        bins = [k for k in range(max(first, 1), last + 1) if 2 * k < window]
        if not bins:
            raise _no_line(low, high, 1, window, rate_hz)
        bins, mains = _without_mains(spec, bins, rate_hz / window)
        return _stepped(spec, LineChoice(Lines.of_bins(bins, window, rate_hz), why, "the band's bins", mains=mains))
    return _odd(spec, low, high, window, rate_hz, why)


def _odd(spec: ExperimentSpec, low: float, high: float, window: int, rate_hz: float, why: str) -> LineChoice:
    """Odd bins: with even bins only, the excitation would repeat after half the window."""
    all_odd = odd_bins(low, high, rate_hz, window).tolist()
    if not all_odd:
        raise _no_line(low, high, _QUIET_BETWEEN, window, rate_hz)
    bins, mains = _without_mains(spec, all_odd, rate_hz / window)
    if spec.kind == "odd" and len(bins) >= _GROUP:
        lines = odd_lines(low, high, rate_hz, window, group=_GROUP, seed=spec.seed, without=mains)
        words = (
            "odd bins, one in four of them not excited, at random: noise and distortion show there and at the even ones"
        )
        return LineChoice(lines, why, words, mains=mains)
    words = "odd bins; the even ones between show noise and even distortion"
    return LineChoice(Lines.of_bins(bins, window, rate_hz), why, words, mains=mains)


def _without_mains(spec: ExperimentSpec, bins: list[int], resolution_hz: float) -> tuple[list[int], tuple[int, ...]]:
    """The bins away from the mains, and the excluded ones; all bins where more than half would be excluded."""
    met = meets_mains(bins, resolution_hz, spec.mains_hz)
    left = [k for k, near in zip(bins, met) if not near]
    return (left, tuple(k for k, near in zip(bins, met) if near)) if 2 * len(left) >= len(bins) else (bins, ())


def _no_line(low: float, high: float, apart: int, window: int, rate_hz: float) -> GridError:
    """Why the band has none of these lines (every bin, or the odd ones), and a band that has."""
    bin_hz, odd = rate_hz / window, apart - 1
    below = apart * floor((low / bin_hz - odd) / apart) + odd
    near = [k * bin_hz for k in (below, below + apart) if 0 < 2 * k < window]
    nearest = f" (the nearest are {' and '.join(f'{f:g}' for f in near)} Hz)" if near else ""
    finer = f", or take a window of {ceil(apart * rate_hz / (high - low))} samples" if high > low else ""
    which = "odd line" if odd else "line"
    return GridError(
        "band-without-line",
        f"no {which} of the {bin_hz:g} Hz grid is in {low:g} … {high:g} Hz{nearest}",
        f"widen the band{finer}",
        argument="band_hz",
        low_hz=low,
        high_hz=high,
        nearest_hz=near,
    )


def _stepped(spec: ExperimentSpec, choice: LineChoice) -> LineChoice:
    if spec.kind != "stepped":
        return choice
    steps, periods = len(choice.lines), spec.periods or _PERIODS
    whole = stepped_lines(choice.lines, periods=periods)
    why = f"{counted(steps, 'step')} of {counted(periods, 'period')} of {choice.lines.window} samples"
    return LineChoice(whole, why, choice.lines_why, base=choice.lines, periods=periods)


def _window(resolution_hz: float, apart: int, rate_hz: float) -> tuple[int, str]:
    """The shortest window that resolves it, or one a little longer that a hop near a twentieth of it divides."""
    asked = apart * rate_hz / resolution_hz
    if asked > WINDOW_MAX:
        raise GridError(
            "window-too-long",
            f"lines {resolution_hz:g} Hz apart need a window of {asked:.0f} samples, more than {WINDOW_MAX}",
            f"take {apart * rate_hz / WINDOW_MAX:.3g} Hz or more at {rate_hz:g} Hz",
            argument="resolution_hz",
            resolution_hz=resolution_hz,
            resolution_hz_min=apart * rate_hz / WINDOW_MAX,
            window_max=WINDOW_MAX,
        )
    if asked < 2 * apart + 1 - 1e-9:
        raise GridError(
            "above-nyquist",
            f"lines {resolution_hz:g} Hz apart do not fit below the Nyquist frequency {rate_hz / 2:g} Hz",
            f"take {apart * rate_hz / (2 * apart + 1):.4g} Hz or less",
            argument="resolution_hz",
            resolution_hz=resolution_hz,
            resolution_hz_max=apart * rate_hz / (2 * apart + 1),
        )
    shortest = ceil(asked * (1 - 1e-9))
    why = f"{apart} × {rate_hz:g} Hz / {resolution_hz:g} Hz"
    for window in range(shortest, int(shortest * _LONGER_MAX) + 1):
        hop = default_hop(window)
        if window % hop == 0 and 1 / _HOP_NEAR <= 20 * hop / window <= _HOP_NEAR:
            return window, why if window == shortest else f"{why}, and longer so that a hop divides it"
    return shortest, why


def _of_text(spec: ExperimentSpec, text: str, rate_hz: float) -> LineChoice:
    if spec.window is not None:
        return LineChoice(Lines.parse(text, rate_hz, spec.window), "as given", "as given")
    if "k=" in text:
        raise GridError(
            "window-missing",
            f"lines {text!r} count in bins, which need a window",
            "specify the window",
            argument="window",
            lines=text,
        )
    required = Lines.parse(text, rate_hz, _smallest_window(text, rate_hz))
    return LineChoice(required, "the shortest on whose grid the lines are, two bins apart or more", "as given")


def _smallest_window(text: str, rate_hz: float) -> int:
    """The shortest window with all lines on its grid, none next to another."""
    required = [Fraction(f) for item in text.split(",") for f in _numbers(item)]
    unit = lcm(*((f / Fraction(rate_hz)).limit_denominator(10**9).denominator for f in required)) if required else 1
    if not required or unit > _WORTH_FACTORS * rate_hz or unit * _QUIET_BETWEEN > WINDOW_MAX:
        # Lines.parse reports what cannot be read, or which line is off this grid, with the nearest ones.
        return max(3, round(2 * rate_hz))
    bins = sorted({int(f * unit / Fraction(rate_hz)) for f in required})
    apart = min(np.diff(bins), default=_QUIET_BETWEEN)
    return max(3, unit * (_QUIET_BETWEEN if apart < _QUIET_BETWEEN else 1))


def _numbers(item: str) -> list[str]:
    """Start and step of a range, or a single frequency; empty for what is not a number."""
    parts = [part.strip() for part in item.split(":")]
    try:
        [Fraction(part) for part in parts]
    except (ValueError, ZeroDivisionError):
        return []
    return parts if len(parts) != 3 else [parts[0], parts[2]]


def _prbs(spec: ExperimentSpec, low: float, high: float, rate_hz: float) -> LineChoice:
    held = spec.rate_divider or max(1, int(rate_hz / (_BITS_PER_PERIOD * high)))
    order = spec.order
    if order is None:
        bits = rate_hz / (spec.resolution_hz or 1.0) / held
        order = max(ORDER_MIN, ceil(np.log2(bits + 1) - 1e-9))
        if order > ORDER_MAX:
            finest = rate_hz / held / (2**ORDER_MAX - 1)
            raise GridError(
                "window-too-long",
                f"lines {spec.resolution_hz:g} Hz apart need a PRBS of order {order}, above {ORDER_MAX}",
                f"take {finest:.3g} Hz or more",
                argument="resolution_hz",
                resolution_hz=spec.resolution_hz,
                order=order,
                order_max=ORDER_MAX,
                resolution_hz_min=finest,
            )
    window = (2**order - 1) * held
    if window > WINDOW_MAX:
        raise GridError(
            "window-too-long",
            f"2^{order} - 1 bits of {counted(held, 'tick')} are {window} samples, more than {WINDOW_MAX}",
            "take a lower order or fewer ticks",
            window=window,
            window_max=WINDOW_MAX,
            order=order,
        )
    first, last = max(1, ceil(low * window / rate_hz - 1e-9)), floor(high * window / rate_hz + 1e-9)
    bins = [k for k in range(first, last + 1) if 2 * k < window and k % (window // gcd(held, window)) != 0]
    if not bins:
        near = max(ceil(log2(rate_hz / held / (high - low) + 1)) if high > low else ORDER_MAX + 1, order + 1)
        fits = near <= ORDER_MAX and (2**near - 1) * held <= WINDOW_MAX
        raise GridError(
            "band-without-line",
            f"a PRBS of order {order} with {counted(held, 'tick')} a bit has no line in {low:g} … {high:g} Hz",
            f"take order {near}" if fits else "widen the band",
            argument="band_hz",
            low_hz=low,
            high_hz=high,
            order=order,
        )
    why = f"2^{order} − 1 bits of {counted(held, 'tick')}"
    return LineChoice(
        Lines.of_bins(bins, window, rate_hz), why, "every bin of the band", order=order, rate_divider=held
    )
