"""Levels of even and odd distortion from one realisation of odd lines: the fast method."""

from __future__ import annotations

from math import gcd
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import INTERVAL_FACTOR, Lines, Stage, StatefulBase, f_quantile, meets_mains
from livebode.dataclass import dataclass
from livebode.estimation.detection import Interpolation
from livebode.estimation.products import power
from livebode.estimation.spectra import after
from livebode.estimation.tracker_settings import Settings
from livebode.language import Message

Bins = NDArray[np.int64]

KINDS = ("even", "odd")
CHANCE = 1e-3
"""Probability that noise alone is taken for a distortion."""
_BINS_MIN = 2
_ROUNDING = 1e-24  # of the output's power at a line
_ON_BIN = 0.1  # bins: hum this close to a bin repeats with the excitation
_EXCITED = 1e-12  # of the mean power: a line with less has no response
_SAME_EXCITATION, _SAME_INPUT = 1e-4, 1e-2  # of the power at the lines: a bin with more is not a detection line


def detection_bins(lines: Lines) -> tuple[Bins, Bins]:
    """Bins between odd lines at which even, and at which odd distortion appears; empty if the lines are not odd.

    Even products of odd multiples of a frequency are even multiples of it, odd products are odd ones. Multiples of the
    mains are left out.
    """
    bins = np.asarray(lines.bins)
    unit = gcd(*lines.bins)
    nothing = np.zeros(0, dtype=np.int64)
    if np.any(bins // unit % 2 == 0):
        return nothing, nothing
    inside = np.arange(bins[0], bins[-1] + 1, unit)
    inside = inside[~np.isin(inside, bins) & ~meets_mains(inside, lines.resolution_hz, near_bins=_ON_BIN)]
    even = inside // unit % 2 == 0
    return inside[even], inside[~even]


@dataclass(frozen=True, eq=False)
class Level:
    """Distortion of one kind at its detection lines, relative to the output at a line.

    Attributes
    ----------
    db
        Rms amplitude at a detection line without the noise's share; NaN if it is not `significant`.
    bound_db
        Lowest and highest value that the noise leaves possible, with 95 %; of a level that is not significant NaN and
        the smallest value that would be detected.
    noise_db
        Rms amplitude of the noise in the mean over all periods.
    bins
        Number of detection lines.
    significant
        Whether noise alone reaches this power with a probability below `CHANCE`.
    """

    db: float
    bound_db: tuple[float, float]
    noise_db: float
    bins: int
    significant: bool

    @property
    def words(self) -> Message:
        """The level for a message."""
        if self.significant:
            return Message("{level_db:.1f} dB", level_db=self.db)
        return Message("below {level_db:.1f} dB", level_db=self.bound_db[1])

    def plain(self) -> dict[str, Any]:
        low, high = (None if np.isnan(bound) else bound for bound in self.bound_db)
        db = None if np.isnan(self.db) else self.db
        return {"db": db, "low_db": low, "high_db": high, "noise_db": self.noise_db, "detection_lines": self.bins}


class DistortionLevels(StatefulBase):
    """Even and odd distortion of the output from the periods of one realisation of an odd excitation.

    With odd lines, even distortion appears at the even bins, and odd distortion at the odd bins without excitation,
    each as the part of Y − Ĝ·U that repeats; the scatter between periods is the noise (fast method of R. Pintelon,
    J. Schoukens, System Identification, 2nd ed., Wiley 2012, section 4.3). Ĝ·U removes what feedback returns, to
    first order. Ĝ is interpolated between the lines, and an error of it counts in proportion to U at the bin.

    Periods of equal phase form a stretch with one mean; the powers of stretches are averaged.

    The levels are those of this realisation. With other random phases they differ, by 1 to 3 dB for a square or a cube
    and ten to fifty detection lines.

    Parameters
    ----------
    settings
        Lines, signals and estimator.

    Attributes
    ----------
    bins
        The detection lines, even ones first; empty where the lines show neither kind.
    """

    _stage = Stage("distortion-levels", 1)
    _STATE = ("_mean", "_spread", "_now", "_stretches", "_periods", "_power", "_scatter", "_output")

    def __init__(self, settings: Settings) -> None:
        lines = settings.lines
        even, odd = detection_bins(lines)
        self._kinds = {"even": slice(0, even.size), "odd": slice(even.size, even.size + odd.size)}
        self.bins = np.concatenate([even, odd])
        self._resolution_hz, self._scale = lines.resolution_hz, 2 / lines.window
        bins = np.asarray(lines.bins)
        self._interpolation = Interpolation(bins, self.bins)
        self._at, self._lines, self._beside = np.concatenate([bins, self.bins]), len(bins), slice(len(bins), None)
        differenced, advanced = np.array(settings.differenced_roles), np.array(settings.advanced_ticks)
        rows = list(settings.signals)
        self._after = after(self._at, lines.window, differenced, advanced)[rows]
        self._places = np.ix_(np.asarray(rows), self._at)
        self._excited = _SAME_EXCITATION if settings.method.reference == "excitation" else _SAME_INPUT
        self._begin()
        self._stretches = self._periods = 0
        self._power, self._scatter, self._output = (
            np.zeros(self.bins.size),
            np.zeros(self.bins.size),
            np.zeros(len(bins)),
        )

    def _begin(self) -> None:
        """Begin a stretch: number of its periods, means of the three signals, and moments of the first two."""
        self._now, self._mean = 0, np.zeros((3, self._at.size), dtype=np.complex128)
        self._spread = np.zeros((3, self._at.size), dtype=np.complex128)  # Σ|δY|², Σ|δU|², ΣδY·conj(δU)

    def process(self, spectra: Complex) -> None:
        """Process the spectra of a complete period, all bins of all signals: shape (signals, bins)."""
        if not self.bins.size:
            return
        apart = spectra[self._places] * self._after - self._mean
        self._now += 1
        self._mean += apart / self._now
        two = apart[[0, 1, 0]] * apart[[0, 1, 1]].conj()
        self._spread += two * (1 - 1 / self._now)

    def end_stretch(self) -> None:
        """The next period may have another phase."""
        if not self._now:
            return
        self._power, self._scatter, self._output = self._sums()
        self._stretches, self._periods = self._stretches + 1, self._periods + self._now
        self._begin()

    def add(self, before: DistortionLevels) -> None:
        """Include the stretches of an earlier recording."""
        before.end_stretch()
        self._power, self._scatter = self._power + before._power, self._scatter + before._scatter
        self._output = self._output + before._output
        self._stretches, self._periods = self._stretches + before._stretches, self._periods + before._periods

    def _sums(self) -> tuple[Floats, Floats, Floats]:
        """The sums over all stretches, including the present one."""
        if not self._now:
            return self._power, self._scatter, self._output
        output, denominator, reference = self._mean
        excitation = power(reference)
        of_line = excitation[: self._lines]
        with np.errstate(all="ignore"):
            ratio = output[: self._lines] / np.where(of_line > _EXCITED * of_line.mean(), denominator[: self._lines], 0)
            model = self._interpolation.at(ratio)
        model = np.where(np.isfinite(model), model, np.nan)
        residual = output[self._beside] - model * denominator[self._beside]
        excited = excitation[self._beside] > self._excited * of_line.mean()
        of_output, of_input, shared = self._spread[:, self._beside]
        scatter = of_output.real - 2 * (model.conj() * shared).real + power(model) * of_input.real
        return (
            self._power + np.where(excited, np.nan, self._now * power(residual)),
            self._scatter + np.maximum(scatter, 0.0),
            self._output + self._now * power(output[: self._lines]),
        )

    def levels(self) -> dict[str, Level | None]:
        """Each kind's level, None where too few detection lines show it; empty with fewer than two periods."""
        periods, stretches = self._periods + self._now, self._stretches + (self._now > 0)
        if periods <= stretches or not self.bins.size:
            return {}
        total, scatter, output = self._sums()
        of_line = float(output.mean()) / periods
        noise = scatter / (periods - stretches)
        return {
            kind: _level(total[members], noise[members], of_line, periods, stretches)
            for kind, members in self._kinds.items()
        }

    def plain(self) -> dict[str, Any]:
        """For a record: the levels, and the amplitudes at the detection lines; empty where none is known."""
        levels = self.levels()
        if not any(levels.values()):
            return {}
        periods, stretches = self._periods + self._now, self._stretches + (self._now > 0)
        total, scatter, _ = self._sums()
        noise = scatter / (periods - stretches) / periods
        amplitudes = self._scale * np.sqrt(np.array([total / periods, noise]))
        amplitude, of_noise = ([None if np.isnan(a) else float(a) for a in row] for row in amplitudes)
        return {
            "periods": periods,
            **{kind: level and level.plain() for kind, level in levels.items()},
            "frequency_hz": (self.bins * self._resolution_hz).tolist(),
            "amplitude": amplitude,
            "noise": of_noise,
        }

    def sentence(self) -> str:
        """Message on a significant distortion; empty without one."""
        levels = self.levels()
        if not any(level is not None and level.significant for level in levels.values()):
            return ""
        words = {kind: Message("not measurable") if level is None else level.words for kind, level in levels.items()}
        noise_db = max(level.noise_db for level in levels.values() if level is not None)
        return Message(
            "distortion at the detection lines, relative to the output at a line: even {even}, odd {odd}; noise "
            "of the mean over {periods} periods {noise_db:.1f} dB",
            even=words["even"],
            odd=words["odd"],
            periods=self._periods + self._now,
            noise_db=noise_db,
        )


def _level(sums: Floats, noise: Floats, of_line: float, periods: int, stretches: int) -> Level | None:
    """From the sum over stretches of periods times power of the mean, and the variance of one period, (bins,)."""
    known = np.isfinite(sums)
    count = int(np.count_nonzero(known))
    if count < _BINS_MIN or of_line <= 0:
        return None
    total, by_chance = float(sums[known].mean()), stretches * float(noise[known].mean())
    limit = f_quantile(CHANCE, 2 * count * stretches, 2 * count * (periods - stretches))
    significant = bool(total > limit * by_chance and total > _ROUNDING * of_line * periods)
    excess, of_one = max(total - by_chance, 0.0), by_chance / stretches
    low, middle, high = np.nan, np.nan, excess + (limit - 1) * by_chance
    if significant:
        of_mean = 2 * excess * of_one + stretches * of_one**2 * (1 + stretches / (periods - stretches))
        half = INTERVAL_FACTOR * float(np.sqrt(of_mean / count))
        low, middle, high = max(excess - half, 0.0), excess, excess + half
    db = [_db(value / periods / of_line) for value in (middle, low, high, by_chance)]
    return Level(db[0], (db[1], db[2]), db[3], count, significant)


def _db(ratio: float) -> float:
    """10·log10, at least −400; NaN stays NaN."""
    return float(10 * np.log10(np.fmax(ratio, 1e-40))) if not np.isnan(ratio) else ratio
