"""Spectra: the sums of its signals at the lines, sent by a drive that runs the kernel itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from livebode.core._block import Block, Channel
from livebode.core.errors import GridError, UsageError
from livebode.core.lines import WINDOW_MAX, Lines
from livebode.dataclass import dataclass

NOT_WHOLE, SPIKE, LEFT_OUT = 1, 2, 4
"""Bits of a window's state: it contains a start, a gap or a non-finite sample; a spike; samples that a run leaves out.

A drive sends the first two."""


@dataclass(frozen=True)
class SpectraLayout:
    """The signals, window and bins of the spectra that a drive sends.

    Parameters
    ----------
    signals
        Channels whose spectra are sent.
    values
        Channels whose value at the window's centre is sent (position), as the scheduling signal of the responses.
    window
        N, samples.
    hop
        Samples from one spectrum to the next: a divisor of the window, or a multiple, so that each spectrum has one
        a whole number of periods before it.
    lines
        The excited lines as bins, ascending.
    quiet
        Bins without excitation that are also sent, ascending: for the noise, and the neighbours of a Hann window.
    subtracted
        A constant for each signal that the drive subtracts before the DFT, in the signal's unit. It has no effect at
        the lines, but saves digits of float32.
    differenced
        Whether each signal is differenced before the DFT, x(n) − x(n − 1); the spectra are divided by 1 − z⁻¹ here.

    Raises
    ------
    UsageError
        If names repeat, or there is no signal.
    GridError
        If there is no line, a bin is not between 0 and N/2 or out of order, or the hop neither divides the window nor
        is a multiple of it.

    Examples
    --------
    >>> layout = SpectraLayout((Channel("w", "N m"), Channel("y")), (), window=400, hop=20, lines=(2, 4))
    >>> layout.bins, layout.subtracted
    ((2, 4), (0.0, 0.0))
    """

    signals: tuple[Channel, ...]
    values: tuple[Channel, ...]
    window: int
    hop: int
    lines: tuple[int, ...]
    quiet: tuple[int, ...] = ()
    subtracted: tuple[float, ...] = ()
    differenced: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        if not self.signals:
            raise UsageError("missing", "the spectra have no signal", "name at least one", argument="signals")
        for named in (self.signals, self.values, self.channels):
            if len({channel.name for channel in named}) != len(named):
                raise UsageError(
                    "duplicate",
                    "two channels of the spectra have the same name",
                    "give each its own name, and one unit",
                    argument="signals",
                )
        object.__setattr__(self, "subtracted", self.subtracted or (0.0,) * len(self.signals))
        object.__setattr__(self, "differenced", self.differenced or (False,) * len(self.signals))
        if not len(self.subtracted) == len(self.differenced) == len(self.signals):
            raise UsageError(
                "wrong-shape",
                f"{len(self.signals)} signals, but {len(self.subtracted)} subtracted constants and "
                f"{len(self.differenced)} differencing flags",
                "specify one of each for each signal",
                argument="subtracted",
            )
        if not np.all(np.isfinite(self.subtracted)):
            raise UsageError(
                "not-finite",
                f"a subtracted constant is not finite: {self.subtracted}",
                "give finite numbers",
                argument="subtracted",
                value=list(self.subtracted),
            )
        if not 3 <= self.window <= WINDOW_MAX:
            raise GridError(
                "window-out-of-range",
                f"window={self.window} is not a whole number of samples from 3 to {WINDOW_MAX}",
                "choose a window in this range",
                window=self.window,
                window_max=WINDOW_MAX,
            )
        if not 1 <= self.hop <= WINDOW_MAX or (self.window % self.hop and self.hop % self.window):
            raise GridError(
                "hop-off",
                f"hop={self.hop} neither divides the window of {self.window} samples nor is a multiple of it, so no "
                "two spectra are a whole number of periods apart",
                "choose one that does",
                hop=self.hop,
                window=self.window,
            )
        self._check_bins()

    def _check_bins(self) -> None:
        if not self.lines:
            raise GridError("no-line", "the spectra have no line", "specify at least one")
        for bins in (self.lines, self.quiet):
            if any(b <= a for a, b in pairwise(bins)):
                raise GridError(
                    "bins-unordered",
                    "bins of spectra are not ascending",
                    "put them in order, each once",
                    bins=list(bins),
                )
        if twice := set(self.lines) & set(self.quiet):
            raise GridError(
                "line-duplicated",
                f"bin {min(twice)} is both a line and a detection line",
                "name it once",
                bin=min(twice),
            )
        for k in self.bins:
            if not 0 < 2 * k < self.window:
                raise GridError(
                    "above-nyquist",
                    f"bin {k} is not between 0 and half the window of {self.window}",
                    "choose bins between them",
                    bin=k,
                    window=self.window,
                )

    @cached_property
    def bins(self) -> tuple[int, ...]:
        """All bins in the order of the sums: the lines, then the detection lines."""
        return self.lines + self.quiet

    @cached_property
    def channels(self) -> tuple[Channel, ...]:
        """Signals and values; a channel that is both appears once."""
        return tuple(dict.fromkeys(self.signals + self.values))

    def at(self, rate_hz: float) -> Lines:
        """The lines of a drive with this many samples per second, with the detection lines between them."""
        quiet = tuple(k for k in self.quiet if self.lines[0] < k < self.lines[-1])
        return Lines(self.lines, self.window, rate_hz, quiet)

    def columns(self, bins: Sequence[int], why: str) -> NDArray[np.intp]:
        """Positions of these bins in the sums; GridError for one that is not sent, with `why` it is needed."""
        place = {k: i for i, k in enumerate(self.bins)}
        for k in bins:
            if k not in place:
                raise GridError(
                    "bin-not-sent", f"{why} bin {k}, which the drive does not send", "let it send that one too", bin=k
                )
        return np.array([place[k] for k in bins], dtype=np.intp)


@dataclass(frozen=True, eq=False)
class Spectra(Block):
    """Consecutive spectra from a drive, each for the `hop` samples that end with its window's newest one.

    As a Block it has a column for each spectrum: the value of a value channel, the RMS at the lines of other signals.
    Numbers and times are those of samples, so that `stop` is the newest sample's number plus one.

    Parameters
    ----------
    layout
        Signals, window and bins.
    sums
        Σ x(n)·e^(−j2πkn/N) over the window with n the drive's own sample number (the kernel's fixed phase), complex128,
        shape (signals, spectra, bins).
    state
        Bits NOT_WHOLE and SPIKE of each window, shape (spectra,).
    place
        Position of the first spectrum in its period: (the drive's number of its newest sample + 1) mod N.
    """

    layout: SpectraLayout = field(kw_only=True)
    sums: NDArray[np.complex128] = field(kw_only=True)
    state: NDArray[np.uint32] = field(kw_only=True)
    place: int = field(kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        shape = (len(self.layout.signals), self.data.shape[1], len(self.layout.bins))
        if self.sums.shape != shape or self.state.shape != shape[1:2]:
            raise UsageError(
                "wrong-shape",
                f"sums of shape {self.sums.shape} and states of shape {self.state.shape} for {shape[1]} spectra",
                f"give {shape} and {shape[1:2]}",
                argument="sums",
                shape=list(self.sums.shape),
            )

    def __len__(self) -> int:
        return len(self.state)

    @property
    def stop(self) -> int:
        return self.start + len(self) * self.layout.hop

    @property
    def sample(self) -> NDArray[np.int64]:
        """Number of each window's newest sample, shape (spectra,)."""
        return self.start - 1 + self.layout.hop * np.arange(1, len(self) + 1)

    @property
    def time_s(self) -> NDArray[np.float64]:
        """Time of each window's newest sample, shape (spectra,), seconds."""
        return np.asarray(self.origin_s + self.sample / self.rate_hz)

    def cut(self, first: int, last: int) -> Spectra:
        """Spectra at positions first … last − 1, without a copy; all of them are this object itself."""
        first, last, _ = slice(first, last).indices(len(self))
        if (first, last) == (0, len(self)):
            return self
        skipped = first * self.layout.hop
        return replace(
            self,
            data=self.data[:, first:last],
            sums=self.sums[:, first:last],
            state=self.state[first:last],
            start=self.start + skipped,
            place=(self.place + skipped) % self.layout.window,
            gap=self.gap and first == 0,
        )


def rms(sums: NDArray[np.complex128], layout: SpectraLayout) -> NDArray[np.float64]:
    """Root mean square of the signals at the lines, shape (signals, spectra), from sums of that layout."""
    excited = sums[..., : len(layout.lines)]
    with np.errstate(over="ignore", invalid="ignore"):  # of non-finite numbers
        return np.asarray(np.sqrt(2 * (excited.real**2 + excited.imag**2).sum(axis=-1)) / layout.window)
