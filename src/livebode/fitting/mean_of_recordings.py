"""The mean of several recordings of one machine: noise within them apart from the scatter between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats
from livebode.core import Response, Responses, SignalError, f_exceeded, sum_exceeded
from livebode.dataclass import dataclass
from livebode.fitting.mean import RunningMean

BY_CHANCE = 0.01
"""Probability that recordings which differ by noise alone are reported as different, all lines together."""
_BESIDE = 10  # lines on each side over which the ratio of two recordings is averaged
_ROUNDING = 1e-9  # of a response
_RECORDINGS_MIN = 2


@dataclass(frozen=True, eq=False)
class RecordingScatter:
    """How several recordings scatter about their mean; shapes (lines,).

    Attributes
    ----------
    recordings
        Number of recordings.
    noise
        Standard deviation of the mean by the noise within the recordings; NaN where it is not known.
    total
        The same by the scatter of the recordings about their mean, which contains the noise.
    distortion
        Standard deviation of the response in one recording beyond its noise: of realisations the stochastic nonlinear
        distortion; 0 where the noise explains the scatter, NaN where the noise is not known.
    distortion_db, noise_db
        Rms of the output by `distortion`, and by the noise of the mean, relative to the output at a line; −inf for
        none, NaN if not known.
    chance
        Probability that noise alone lets the recordings differ as much; NaN if the noise is not known.
    """

    recordings: int
    noise: Floats
    total: Floats
    distortion: Floats
    distortion_db: float
    noise_db: float
    chance: float

    @property
    def differs(self) -> bool:
        """Whether the recordings differ by more than their noise."""
        return bool(self.chance < BY_CHANCE)


@dataclass(frozen=True, eq=False)
class _Each:
    """The means of the recordings; shapes (recordings, lines), NaN where a line is not valid."""

    value: Complex
    weight: Complex
    variance: Floats
    dof: Floats
    repeated: Floats
    varied: Floats

    @property
    def used(self) -> Flags:
        return np.asarray(np.isfinite(self.value))

    @property
    def count(self) -> NDArray[np.int64]:
        return np.asarray(self.used.sum(axis=0))


class RecordingsMean:
    """`mean_response` of several recordings, which follow each other in the numbers of the samples.

    Each recording has its own mean Ĝᵢ = Nᵢ/Dᵢ with the variance vᵢ of its noise, from the scatter within it. Then

        Ĝ = Σ gᵢ·Ĝᵢ / Σ gᵢ,    gᵢ = Dᵢ / |D̄ᵢ| / (v̄ᵢ + τ²),

    a ratio of averages over the recordings, in which each is projected on its reference (R. Pintelon, J. Schoukens,
    System Identification, 2nd ed., Wiley 2012, section 4.3). The weights are inverse variances: v̄ᵢ and |D̄ᵢ| are known
    from up to 21 neighbouring lines, so that the scatter of single variances does not enter, and equal recordings have
    equal weights. τ² is the variance between recordings beyond noise by the moment estimate of R. DerSimonian and
    N. Laird (Control. Clin. Trials 7, 1986), averaged over the same lines. The variance of the mean is

        noise² = Σ |gᵢ|²·vᵢ / |Σ gᵢ|²,    total² = Σ |gᵢ|·|Ĝᵢ − Ĝ|² / ((M − 1)·Σ |gᵢ|).

    For recordings of equal noise these are the noise and total variances of the robust method, and τ² = M·(total² −
    noise²) is the variance of the stochastic nonlinear distortion.

    Sigma is from the noise if noise explains the differences: Σ|Ĝᵢ − Ĝ|²/vᵢ follows F at each line, and the lines are
    combined as in `DriftTest`. The share 1 − p of τ² is then added to vᵢ, with p the probability by chance. If p is
    below 1 %, τ² is in the weights, and sigma is the larger one of total and noise with M − 1 degrees of freedom: 2
    recordings then give wide bounds. Differences that are hardly detected are not completely in sigma.

    Errors that repeat: of realisations (other phases) the mean is the best linear approximation, and the distortion is
    in `total`. Of recordings with the same excitation, the distortion of each line is added without reduction. A drift
    within the recordings is added in both cases.

    Parameters
    ----------
    starts
        Number of the first sample of each recording, ascending.
    realisations
        Whether the excitations of the recordings have different phases.
    """

    averages = False

    def __init__(self, starts: Sequence[int], *, realisations: bool) -> None:
        self._starts, self.realisations = np.asarray(starts, dtype=np.int64), realisations
        self._means = [RunningMean() for _ in starts]

    @property
    def rows(self) -> int:
        """Number of responses used."""
        return sum(mean.rows for mean in self._means)

    def add(self, part: Responses) -> None:
        """Process the next responses."""
        of = np.searchsorted(self._starts, part.first, side="right") - 1
        for i, mean in enumerate(self._means):
            rows = np.flatnonzero(of == i)
            if rows.size:
                mean.add(part[rows])

    def response(self) -> Responses:
        """The present mean; SignalError if fewer than two recordings have a valid line in common."""
        return self.result()[0]

    def result(self) -> tuple[Responses, RecordingScatter]:
        """The present mean, and how the recordings scatter about it; SignalError as `response`."""
        ones, each = self._each()
        with np.errstate(invalid="ignore", divide="ignore"):
            excess, chance = _excess(each)
            weights = _weights(each, excess * (chance < BY_CHANCE))
            value = np.nansum(weights * each.value, axis=0) / np.nansum(weights, axis=0)
            between = self._between(each, weights, value, chance)
            sigma, dof = _sigma(each, weights, between, excess)
            repeated, varied = (_mean_of(np.abs(weights), part) for part in (each.repeated, each.varied))
        valid = each.count >= _RECORDINGS_MIN
        newest = ones[-1]
        response = replace(
            newest,
            value=np.where(valid, value, complex(np.nan, np.nan)),
            sigma=np.where(valid, np.sqrt(sigma**2 + repeated), np.nan),
            dof=dof,
            coherence=_over(ones, "coherence"),
            valid=valid,
            first=ones[0].first,
            time_s=float(np.mean([response.time_s for response in ones])),
            schedule=float(np.mean([response.schedule for response in ones])),
            input_coherence=_over(ones, "input_coherence"),
            weight=np.full(len(valid), complex(np.nan, np.nan)),
            distortion=self._distortion(ones, valid),
            variation=np.where(valid, np.sqrt(varied), np.nan),
        )
        return Responses.of(response), between

    def _each(self) -> tuple[list[Response], _Each]:
        responses, weights, repeated, varied = [], [], [], []
        for mean in self._means:
            try:
                response, weight = mean.without_distortion()
            except SignalError:
                continue
            responses.append(response)
            weights.append(np.where(np.isfinite(weight), weight, 1.0))
            spread = np.nan_to_num(mean.drift.result().variation(response.sigma))
            distortion = np.where(np.isfinite(response.distortion) & (not self.realisations), response.distortion, 0.0)
            repeated.append(spread**2 + distortion**2)
            varied.append(spread**2)
        valid = np.array([response.valid for response in responses])
        if not responses or np.all(valid.sum(axis=0) < _RECORDINGS_MIN):
            raise SignalError(
                "no-valid-response",
                "no line is valid in two of the recordings",
                "see the run's events for the reason at each line, or track each recording in a run of its own",
            )
        value = np.where(valid, np.array([response.value for response in responses]), complex(np.nan, np.nan))
        sigma = np.where(valid, np.array([response.sigma for response in responses]), np.nan)
        rounding = (_ROUNDING * np.abs(value)) ** 2
        dof = np.array([response.dof for response in responses])[:, np.newaxis]
        return responses, _Each(
            value, np.array(weights), sigma**2 + rounding, dof, np.array(repeated), np.array(varied)
        )

    def _between(self, each: _Each, weights: Complex, value: Complex, chance: float) -> RecordingScatter:
        size, count = np.abs(weights), each.count
        noise = np.nansum(size**2 * each.variance, axis=0) / np.abs(np.nansum(weights, axis=0)) ** 2
        noise[np.isnan(np.where(each.used, each.variance, 0.0)).any(axis=0)] = np.nan
        apart = np.nansum(size * np.abs(each.value - value) ** 2, axis=0)
        total = apart / (count - 1) / np.nansum(size, axis=0)
        distortion = _beyond_noise(each)[0]
        output = _mean(np.abs(each.weight) ** 2)
        whole = _mean(np.abs(value) ** 2 * output)
        distortion_db, noise_db = (
            float(10 * np.log10(np.maximum(_mean(part * output), 0.0) / whole)) for part in (distortion, noise)
        )
        alone = count < _RECORDINGS_MIN
        noise, total, distortion = (
            np.where(alone, np.nan, np.sqrt(np.maximum(part, 0.0))) for part in (noise, total, distortion)
        )
        return RecordingScatter(len(each.value), noise, total, distortion, distortion_db, noise_db, chance)

    def _distortion(self, ones: Sequence[Response], valid: Flags) -> Floats:
        if self.realisations:
            return np.full(valid.shape, np.nan)
        return np.where(valid, np.sqrt(_over(ones, "distortion", 2)), np.nan)


def _mean(values: Floats) -> Floats:
    """Mean over the recordings, or over all, of what is known; NaN if nothing is."""
    return _mean_of(np.ones(values.shape), values)


def _over(responses: Sequence[Response], name: str, power: int = 1) -> Floats:
    """Mean over the recordings in which it is known, (lines,)."""
    values = np.array([getattr(response, name) for response in responses]) ** power
    return _mean(values)


def _mean_of(weights: Floats, values: Floats) -> Floats:
    known = np.isfinite(values) & np.isfinite(weights)
    with np.errstate(invalid="ignore"):
        return np.asarray(
            np.sum(weights * values, axis=0, where=known) / np.sum(weights, axis=0, where=known, initial=0.0)
        )


def _relative(values: Floats) -> Floats:
    """Each recording's values over their mean, averaged over neighbouring lines: (recordings, lines)."""
    ratio = values / _mean(values)
    return np.array([_smooth(row) for row in ratio])


def _smooth(row: Floats) -> Floats:
    """Mean over the known values at up to 10 lines on each side, (lines,)."""
    known = np.isfinite(row)
    kernel = np.ones(2 * _BESIDE + 1)
    sums = np.convolve(np.where(known, row, 0.0), kernel)[_BESIDE : _BESIDE + row.size]
    return np.asarray(sums / np.convolve(known * 1.0, kernel)[_BESIDE : _BESIDE + row.size])


def _noise(each: _Each) -> Floats:
    """Variances of the noise, smooth over the lines; equal where the noise of a recording is not known."""
    variance = np.where(each.used, each.variance, np.nan)
    unknown = (each.used & ~np.isfinite(each.variance)).any(axis=0)
    smooth = _relative(variance) * _mean(variance)
    return np.where(each.used, np.where(unknown, 1.0, smooth), np.nan)


def _beyond_noise(each: _Each) -> tuple[Floats, Floats, Floats]:
    """Variance between recordings beyond noise, Σ|Ĝᵢ − Ĝ|²/vᵢ, and what noise alone gives for it, (lines,)."""
    weights = 1 / _noise(each)
    total = np.nansum(weights, axis=0)
    mean = np.nansum(weights * each.value, axis=0) / total
    scatter = np.nansum(weights * np.abs(each.value - mean) ** 2, axis=0)
    # NaN where the noise of a recording is not known.
    own = np.where(each.used, each.variance, 0.0)
    by_noise = np.sum(np.where(each.used, weights, 0.0) * own, axis=0)
    by_noise = by_noise - np.sum(np.where(each.used, weights, 0.0) ** 2 * own, axis=0) / total
    spread = total - np.nansum(weights**2, axis=0) / total
    return (scatter - by_noise) / spread, scatter, by_noise


def _excess(each: _Each) -> tuple[Floats, float]:
    """Variance between recordings beyond noise, smooth over the lines, and the probability of it by chance."""
    beyond, scatter, by_noise = _beyond_noise(each)
    judged = (each.count >= _RECORDINGS_MIN) & (by_noise > 0)
    noise = _mean(np.where(each.used, each.variance, np.nan))
    excess = np.maximum(_smooth(np.where(judged, beyond / noise, np.nan)), 0.0) * noise
    if not judged.any():
        return np.zeros(each.value.shape[1]), np.nan
    free = 2 * (each.count[judged] - 1)
    of_noise = 2 * np.sum(np.where(each.used[:, judged], each.dof, 0.0), axis=0)
    ratio = scatter[judged] / by_noise[judged]
    p = np.array([f_exceeded(*arguments) for arguments in zip(ratio, free, of_noise)])
    log_p = np.log(np.maximum(p, 1e-300))
    together = sum_exceeded(p.size, -log_p.sum())
    chance = min(1.0, 2 * min(together, float(p.min()) * p.size))
    return np.nan_to_num(excess), chance


def _weights(each: _Each, excess: Floats) -> Complex:
    size = np.sqrt(_relative(np.abs(np.where(each.used, each.weight, np.nan)) ** 2))
    return np.asarray(each.weight / _mean(np.abs(each.weight)) / size / (_noise(each) + excess))


def _sigma(each: _Each, weights: Complex, between: RecordingScatter, excess: Floats) -> tuple[Floats, float]:
    """Sigma of the mean (lines,) and its degrees of freedom."""
    several = each.count >= _RECORDINGS_MIN
    if between.differs or np.isnan(between.noise[several]).any():
        return np.fmax(between.total, between.noise), float(each.count[several].min() - 1)
    size = np.abs(weights) ** 2
    added = (1 - between.chance) * excess * np.nansum(size, axis=0)
    share = size * each.variance
    of_line = np.nansum(share, axis=0) ** 2 / np.nansum(share**2 / each.dof, axis=0)
    return np.sqrt(between.noise**2 + added / np.abs(np.nansum(weights, axis=0)) ** 2), float(of_line[several].min())
