"""Lines: excited frequencies on the exact grid of a sliding DFT."""

from __future__ import annotations

from fractions import Fraction
from math import ceil, floor, gcd, lcm
from sys import float_info

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.core.errors import GridError, UsageError
from livebode.dataclass import dataclass

# A line that a person typed counts as on the grid when it is this close to a bin, in bins: the window then contains a
# whole number of periods to a millionth, and the leakage is below every other error.
ON_GRID_BINS = 1e-6
_LINES_MAX = 100_000
_DIGITS_MAX, _SHOWN = 40, 120
CLOCK_ERROR = 2e-4
"""Relative difference up to which two rates are one: that of two quartz clocks, or of a rate estimated from stamps."""
_BINS_APART_MAX, _BINS_APART = 0.25, 1e-3  # of the spacing of bins; `same_frequencies` gives the reason
WINDOW_MAX = 1 << 24
"""Longest window, samples: that of the kernel; 70 minutes at 4 kHz."""


@dataclass(frozen=True)
class Lines:
    """Frequencies k·rate/N with whole k: the lines of a sliding DFT over N samples without leakage.

    Nevaranta 2016, eq. (17): a line is on the grid when k = N·Ts·f is a whole number.

    Parameters
    ----------
    bins
        The excited lines as bin numbers k, ascending, 0 < k < N/2.
    window
        N, samples.
    rate_hz
        Samples per second.
    quiet
        Detection lines: bins without excitation, from which the noise is estimated.

    Raises
    ------
    GridError
        If a bin is not between 0 and N/2, is duplicated, or is both excited and a detection line.

    Examples
    --------
    >>> lines = Lines.parse("20:140:20", rate_hz=4000, window=400)
    >>> lines.bins
    (2, 4, 6, 8, 10, 12, 14)
    >>> lines.frequency_hz
    array([ 20.,  40.,  60.,  80., 100., 120., 140.])
    """

    bins: tuple[int, ...]
    window: int
    rate_hz: float
    quiet: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        check_window(self.window, self.rate_hz)
        for name in ("bins", "quiet"):
            object.__setattr__(self, name, tuple(sorted(int(k) for k in getattr(self, name))))
        every = self.bins + self.quiet
        if not self.bins:
            raise GridError("no-line", "there is no line", "specify at least one")
        if len(set(every)) != len(every):
            twice = next(k for k in every if every.count(k) > 1)
            raise GridError(
                "line-duplicated",
                f"bin {twice} ({twice * self.resolution_hz:g} Hz) is duplicated",
                "name it once",
                bin=twice,
                frequency_hz=twice * self.resolution_hz,
            )
        for k in every:
            if not 0 < 2 * k < self.window:
                raise GridError(
                    "above-nyquist",
                    f"bin {k} ({k * self.resolution_hz:g} Hz) is not between 0 and the Nyquist frequency "
                    f"{self.rate_hz / 2:g} Hz",
                    "choose lines between them",
                    bin=k,
                    frequency_hz=k * self.resolution_hz,
                    nyquist_hz=self.rate_hz / 2,
                )

    @classmethod
    def parse(cls, text: str, rate_hz: float, window: int, *, rounded: bool = False) -> Lines:
        """Lines from text: frequencies in Hz, ``start:stop:step`` inclusive, joined by commas.

        ``k=`` before an item counts in bins instead of Hz, for windows whose lines have no short decimal
        (``k=1:300`` with a PRBS of 2047). The other bins between the first and the last line are detection lines. With
        `rounded`, each line is moved to the nearest bin, for an excitation that does not repeat.

        Raises
        ------
        GridError
            If a line is off the grid (the remedy has the nearest lines and the windows that would fit) or not
            below the Nyquist frequency.
        UsageError
            If the text cannot be read.

        Examples
        --------
        >>> Lines.parse("25, 40:80:20", rate_hz=4000, window=800).frequency_hz
        array([25., 40., 60., 80.])
        >>> Lines.parse("25", rate_hz=4000, window=400)
        Traceback (most recent call last):
        ...
        livebode.GridError: the line 25 Hz is not on the 10 Hz grid of window=400 at 4000 Hz; the \
nearest lines are 20 and 30 Hz, and windows of 320 or 480 samples would fit
        """
        if not isinstance(text, str):
            raise UsageError(
                "unreadable",
                f"the lines {text!r} are not text",
                "write frequencies in Hz as '20:140:20' or '35, 40', or give bins to Lines",
                argument="text",
            )
        check_window(window, rate_hz)
        required = [f for item in text.split(",") for f in _frequencies(item.strip(), text, rate_hz, window)]
        resolution_hz = Fraction(rate_hz) / window
        bins = [round(f / resolution_hz) for f in required]
        for f, k in zip(required, bins):
            if not 0 < f < Fraction(rate_hz) / 2:
                raise GridError(
                    "above-nyquist",
                    f"the line {float(f):g} Hz is not between 0 and the Nyquist frequency {rate_hz / 2:g} Hz",
                    "choose lines between them",
                    frequency_hz=float(f),
                    nyquist_hz=rate_hz / 2,
                )
            if abs(f / resolution_hz - k) > ON_GRID_BINS and not rounded:
                raise _off_grid(f, required, rate_hz, window)
        if rounded:
            bins = [k for k in dict.fromkeys(bins) if 0 < 2 * k < window]
        return cls.of_bins(bins, window, rate_hz)

    @classmethod
    def of_bins(cls, bins: list[int], window: int, rate_hz: float) -> Lines:
        """Lines at these bins; all other bins between the first and the last are detection lines."""
        named = set(bins)
        quiet = tuple(k for k in range(min(bins, default=0), max(bins, default=0)) if k not in named)
        return cls(tuple(bins), window, rate_hz, quiet)

    def __len__(self) -> int:
        return len(self.bins)

    def take(self, positions: NDArray[np.intp]) -> Lines:
        """The lines at these positions, with the detection lines between the first and the last of them.

        >>> Lines.parse("20:140:40", rate_hz=4000, window=400).take(np.array([0, 1])).frequency_hz
        array([20., 60.])
        """
        bins = tuple(self.bins[i] for i in positions)
        quiet = tuple(k for k in self.quiet if min(bins) < k < max(bins))
        return Lines(bins, self.window, self.rate_hz, quiet)

    def alike(self, other: Lines) -> bool:
        """Whether the other has the same lines of the same window, at the same rate but for the error of a clock.

        >>> Lines((2, 4), 400, 1000.10884).alike(Lines((2, 4), 400, 1000.10883))
        True
        """
        same = (self.bins, self.window) == (other.bins, other.window)
        return same and bool(same_frequencies(self.frequency_hz, other.frequency_hz, self.resolution_hz).all())

    @property
    def resolution_hz(self) -> float:
        """Distance of neighbouring bins, rate/N."""
        return self.rate_hz / self.window

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """Frequency of each excited line, shape (lines,), ascending."""
        return np.asarray(self.bins) * self.rate_hz / self.window

    @property
    def text(self) -> str:
        """The lines as `parse` reads them: in Hz where that is short, else in bins.

        >>> Lines((2, 4, 6, 9), window=400, rate_hz=4000.0).text
        '20:60:20, 90'
        >>> Lines((1, 2, 3), window=2047, rate_hz=4000.0).text
        'k=1:3:1'
        """
        runs = _runs(list(self.bins))
        in_hz = [[f"{k * self.rate_hz / self.window:.6g}" for k in run] for run in runs]
        values = ((float(f), k * self.rate_hz / self.window) for fs, run in zip(in_hz, runs) for f, k in zip(fs, run))
        if all(shown == exact for shown, exact in values):
            return ", ".join(":".join(fs) for fs in in_hz)
        return ", ".join(f"k={':'.join(map(str, run))}" for run in runs)

    @property
    def z(self) -> NDArray[np.complex128]:
        """e^(jωTs) at each line, shape (lines,)."""
        return np.exp(2j * np.pi * np.asarray(self.bins) / self.window)


def same_rate(one_hz: float, other_hz: float) -> bool:
    """Whether two rates differ by no more than clocks do."""
    return abs(one_hz / other_hz - 1) <= CLOCK_ERROR


def same_frequencies(
    one_hz: NDArray[np.float64], other_hz: NDArray[np.float64], spacing_hz: float
) -> NDArray[np.bool_]:
    """Which pairs of frequencies are one line, by elements; `spacing_hz` is the distance of bins.

    They differ by no more than clocks do, and by at most a quarter of the spacing, less than a window resolves; or by a
    thousandth of the spacing.

    >>> same_frequencies(np.array([8.0008, 20.0]), np.array([8.0007, 20.01]), 0.2).tolist()
    [True, False]
    """
    apart = np.abs(one_hz - other_hz)
    limit = np.maximum(_BINS_APART * spacing_hz, CLOCK_ERROR * np.abs(other_hz))
    return np.asarray(apart <= np.minimum(limit, _BINS_APART_MAX * spacing_hz))


def check_window(window: int, rate_hz: float) -> None:
    """Raise GridError or UsageError for values that give no grid."""
    if isinstance(window, bool) or not isinstance(window, (int, np.integer)) or not 3 <= window <= WINDOW_MAX:
        raise GridError(
            "window-out-of-range",
            f"{window=} is not a whole number of samples from 3 to {WINDOW_MAX}",
            "choose a window in this range",
            window=window,
            window_max=WINDOW_MAX,
        )
    if not (isinstance(rate_hz, (int, float, np.number)) and 0 < rate_hz <= float_info.max):
        raise UsageError(
            "out-of-range",
            f"{rate_hz=} is not a positive number of samples per second",
            "specify the rate",
            argument="rate_hz",
            value=rate_hz,
        )


def spacing_hz(text: str) -> Fraction | None:
    """The largest frequency of which all lines in a text are multiples; None if it counts in bins.

    >>> spacing_hz("20:140:40, 50")
    Fraction(10, 1)
    """
    if "k=" in text:
        return None
    required = [f for item in text.split(",") for f in _frequencies(item.strip(), text, 1.0, 1)]
    unit = lcm(*(f.denominator for f in required))
    return Fraction(gcd(*(int(f * unit) for f in required)), unit) or None


def _number(text: str) -> Fraction:
    """The exact value; ValueError for text that is not a number, or one too large or small to be computed."""
    exponent = text.lower().partition("e")[2]
    if len(text) > _DIGITS_MAX or abs(int(exponent or 0)) > _DIGITS_MAX:
        raise ValueError(text)
    return Fraction(text)


def _frequencies(item: str, text: str, rate_hz: float, window: int) -> list[Fraction]:
    unit = Fraction(rate_hz) / window if item.startswith("k=") else Fraction(1)
    try:
        parts = [_number(part.strip()) for part in item.removeprefix("k=").split(":")]
    except (ValueError, ZeroDivisionError):
        parts = []
    if len(parts) == 2 and item.startswith("k="):
        parts.append(Fraction(1))
    if len(parts) not in (1, 3):
        raise UsageError(
            "unreadable",
            f"{item[:_SHOWN]!r} in lines {text[:_SHOWN]!r} cannot be read",
            "write frequencies in Hz as 20:140:20 (start:stop:step, inclusive) or 35, joined by commas",
            argument="lines",
            value=item[:_SHOWN],
        )
    if len(parts) == 1:
        return [parts[0] * unit]
    start, stop, step = parts
    if step <= 0 or stop < start or step > stop:
        exchanged = stop > 0 and start <= step
        raise UsageError(
            "out-of-range",
            f"the range {item[:_SHOWN]!r} is not start:stop:step with start ≤ stop and 0 < step ≤ stop",
            f"did you mean {float(start):g}:{float(step):g}:{float(stop):g}?" if exchanged else "correct it",
            argument="lines",
            value=item[:_SHOWN],
        )
    count = floor((stop - start) / step) + 1
    if count > _LINES_MAX:
        raise UsageError(
            "too-many",
            f"the range {item[:_SHOWN]!r} has {count} lines, more than {_LINES_MAX}",
            "choose a larger step",
            argument="lines",
            count=count,
            limit=_LINES_MAX,
        )
    return [(start + i * step) * unit for i in range(count)]


def _runs(bins: list[int]) -> list[list[int]]:
    """Ranges of bins with a constant step, each as start, stop and step, or single bins."""
    runs: list[list[int]] = []
    start = 0
    while start < len(bins):
        step = bins[start + 1] - bins[start] if start + 1 < len(bins) else 0
        end = start + 1
        while end + 1 < len(bins) and bins[end + 1] - bins[end] == step:
            end += 1
        if end - start >= 2 and end < len(bins):
            runs.append([bins[start], bins[end], step])
            start = end + 1
        else:
            runs.append([bins[start]])
            start += 1
    return runs


def _off_grid(line: Fraction, required: list[Fraction], rate_hz: float, window: int) -> GridError:
    resolution = Fraction(rate_hz) / window
    position = line / resolution
    near = [k * resolution for k in (floor(position), ceil(position)) if 0 < 2 * k < window]
    nearest = (
        f"the nearest {'lines are' if len(near) > 1 else 'line is'} {' and '.join(f'{float(f):.6g}' for f in near)} Hz"
    )
    # A rate of many digits must not hide the window; a line near 0 must not become 0, which every window fits.
    shares = [(f / Fraction(rate_hz)).limit_denominator(10**6) or f / Fraction(rate_hz) for f in required]
    unit = lcm(*(share.denominator for share in shares))
    fitting: list[int] = []
    if unit <= 100 * window:  # a longer one is of no use
        fitting = sorted({unit * m for m in (floor(window / unit), ceil(window / unit)) if m > 0})
    which = "windows" if len(fitting) > 1 else "a window"
    windows = f", and {which} of {' or '.join(map(str, fitting))} samples would fit"
    return GridError(
        "line-off",
        f"the line {float(line):g} Hz is not on the {float(resolution):g} Hz grid of window={window} at {rate_hz:g} Hz",
        nearest + (windows if fitting else ", and no window of a useful length would fit them all"),
        frequency_hz=float(line),
        resolution_hz=float(resolution),
        window=window,
        rate_hz=rate_hz,
        nearest_hz=[float(f) for f in near],
        windows=fitting,
    )


_NAMED = 2  # nearest lines in a message


def position(lines: Lines, frequency_hz: ArrayLike) -> NDArray[np.intp]:
    """Positions of these frequencies among the lines, in the shape of `frequency_hz`; GridError for another one."""
    required = np.asarray(frequency_hz, dtype=np.float64)
    bins = required / lines.resolution_hz
    known = np.asarray(lines.bins)
    index = np.searchsorted(known, np.rint(bins)).clip(0, len(lines) - 1)
    off = ~(np.abs(known[index] - bins) < ON_GRID_BINS)
    if off.any():
        raise _not_measured(lines, float(required[off].flat[0]))
    return np.asarray(index)


def within(lines: Lines, span_hz: slice) -> NDArray[np.intp]:
    """Positions of the lines from `start` to `stop` in Hz, both included; None is an open end."""
    f = lines.frequency_hz
    room_hz = ON_GRID_BINS * lines.resolution_hz
    low, high = ends(span_hz, "frequency_hz")
    positions = np.flatnonzero((f >= low - room_hz) & (f <= high + room_hz))
    if not positions.size:
        raise GridError(
            "band-without-line",
            f"no measured line is between {low:g} and {high:g} Hz",
            f"choose a range that overlaps {f[0]:g} … {f[-1]:g} Hz",
            band_hz=[low, high],
            lines_hz=[float(f[0]), float(f[-1])],
        )
    return positions


def ends(span: slice, argument: str) -> tuple[float, float]:
    """Both ends of a slice by value; TypeError for anything else, UsageError for a slice with a step."""
    if not isinstance(span, slice):
        raise TypeError(f"{argument}={span!r} is not a slice(from, to)")
    if span.step is not None:
        raise UsageError(
            "out-of-range",
            f"{argument} is a slice with a step, {span.step!r}, and selects by value",
            "give slice(from, to)",
            argument=argument,
            value=str(span.step),
        )
    return -np.inf if span.start is None else float(span.start), np.inf if span.stop is None else float(span.stop)


def _not_measured(lines: Lines, frequency_hz: float) -> GridError:
    f = lines.frequency_hz
    nearest = sorted(f[np.argsort(np.abs(f - frequency_hz), kind="stable")[:_NAMED]].tolist())
    text = " and ".join(f"{line_hz:g}" for line_hz in nearest)
    return GridError(
        "line-off",
        f"{frequency_hz:g} Hz is not a measured line, and a measured response is not interpolated",
        f"choose a measured line; the nearest {'are' if len(nearest) > 1 else 'is'} {text} Hz",
        frequency_hz=frequency_hz,
        resolution_hz=lines.resolution_hz,
        nearest_hz=nearest,
    )
