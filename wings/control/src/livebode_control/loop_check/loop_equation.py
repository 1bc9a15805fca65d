"""The equation of a loop, u = E·w − F·y, tested on the recorded signals at the lines, without a model of the plant."""

from __future__ import annotations

from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import Block, Lines, Loop, SignalError, needing
from livebode.dataclass import dataclass
from livebode_control.loop_check.loop_images import HeldSamples, held_paths

WINDOWS_MIN = 8
_OVERLAP = 1 / 6  # correlation of white noise in two Hann windows that overlap by half
_ROUNDING = 1e-6  # of the parts of the equation: samples as float32, the position as an integral of the velocity
_WEAK = 3.0  # an output below this many sigma gives no controller at that line


@dataclass(frozen=True, eq=False)
class LoopSignals:
    """Spectra of input, excitation and output at lines, over the excitation: means with their covariance.

    Windows are Hann windows of two periods, a period apart: the end of one window is not the start of the next, so that
    a controller with memory answers in each window also what was before it. The Hann window removes this almost wholly.

    Attributes
    ----------
    lines
        Where.
    mean
        U, W and Y times conj(W)/rms(W), shape (lines, 3): the unit of the signals.
    covariance
        Of the mean, shape (lines, 3, 3), Hermitian.
    dof
        Complex degrees of freedom of the covariance.
    step
        Standard deviation of the mean of U by the steps in which u is recorded; averaging does not reduce it.
    output
        Samples of the output, from which the images of a slower controller are computed, (samples,).
    instrument
        conj(W)/rms(W) of each window, (windows, lines).
    """

    lines: Lines
    mean: Complex
    covariance: Complex
    dof: float
    step: float
    output: Floats
    instrument: Complex
    _spectra: Complex
    _starts: NDArray[np.intp]
    _with_images: dict[tuple[tuple[HeldSamples, ...], int], tuple[Complex, Complex]] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        block: Block,
        lines: Lines,
        *,
        input: str,
        excitation: str,
        output: str,
        starts: NDArray[np.intp] | None = None,
    ) -> LoopSignals:
        """The spectra of consecutive samples that are all finite.

        With `starts` the windows begin there instead of at each period; of several experiments in a row, windows that
        contain the change from one to the next would have an error that averaging does not reduce.

        Raises
        ------
        SignalError
            If there are fewer than 9 periods, or the excitation is zero at all lines.
        """
        period = lines.window
        if starts is None:
            starts = period * np.arange(len(block) // period - 1)
            cause, remedy = f"fewer than {WINDOWS_MIN + 1} periods of {period}", "record longer"
        else:
            cause = f"too few: {len(starts)} windows of two settled periods, and {WINDOWS_MIN} are needed"
            remedy = "record more repetitions, or longer experiments"
        count = len(starts)
        if count < WINDOWS_MIN:
            raise SignalError(
                "too-short",
                f"{len(block)} samples in a row without a gap are {cause}",
                remedy,
                samples=len(block),
                limit=(WINDOWS_MIN + 1) * period,
            )
        signals = np.stack([block[name] for name in (input, excitation, output)])
        signals = signals - signals.mean(axis=1, keepdims=True)
        spectra = _spectra(signals, lines, starts)
        power = np.mean(np.abs(spectra[:, 1]) ** 2, axis=0)
        if not power.any():
            raise SignalError(
                "no-excitation",
                f"the excitation {excitation!r} is zero at all lines",
                "record while the excitation is played",
                channel=excitation,
            )
        excited = power > 1e-12 * power.max()
        lines, spectra = lines.take(np.flatnonzero(excited)), spectra[..., excited]
        instrument = np.conj(spectra[:, 1]) / np.sqrt(power[excited])
        about = spectra * instrument[:, np.newaxis]
        dof = (count - 1) / (1 + 2 * _OVERLAP**2)
        step = _step(signals[0]) / np.sqrt(12 * period)
        return cls(lines, *_moments(about), dof, step, signals[2], instrument, about, starts)

    def judge(self, loop: Loop, phase: int = 0) -> LoopResidual:
        """The equation of this loop; UsageError if its feedback is missing.

        Controllers at lower rates than the recording read the output at the ticks `phase`, `phase` + their divider, ….
        """
        f = self.lines.frequency_hz
        tick = np.exp(2j * np.pi * f / self.lines.rate_hz)
        advanced = [tick ** loop.advance_ticks(role) for role in ("input", "excitation", "output")]
        weights = [np.ones(f.shape), -loop.entry_at(f), loop.feedback_at(f)]
        mean, covariance = self.mean, self.covariance
        if paths := held_paths(loop.feedback):
            mean, covariance = self._moments_with(tuple(path.samples for path in paths), phase)
            weights += [path.response(f) for path in paths]
            advanced += [advanced[2]] * len(paths)
        weighting = np.stack(weights, axis=1) * np.stack(advanced, axis=1)
        parts = weighting * mean
        variance = np.einsum("li,lij,lj->l", weighting, covariance, np.conj(weighting)).real
        variance = np.maximum(variance, 0) + self.step**2 + _ROUNDING**2 * np.sum(np.abs(parts) ** 2, axis=1)
        output_variance = covariance[:, 2, 2].real * np.abs(weighting[:, 2]) ** 2
        known = np.abs(parts[:, 2]) > _WEAK * np.sqrt(output_variance)
        return LoopResidual(f, parts.sum(axis=1), variance, self.dof, parts[:, 2], np.abs(parts).max(axis=1), known)

    def _moments_with(self, samples: tuple[HeldSamples, ...], phase: int) -> tuple[Complex, Complex]:
        """Mean and covariance of the three signals and of the images of slower controllers."""
        if (samples, phase) not in self._with_images:
            images = np.stack([sample.images(self.output, self.lines.rate_hz, phase) for sample in samples])
            about = _spectra(images, self.lines, self._starts) * self.instrument[:, np.newaxis]
            self._with_images[samples, phase] = _moments(np.concatenate([self._spectra, about], axis=1))
        return self._with_images[samples, phase]


def _spectra(signals: Floats, lines: Lines, starts: NDArray[np.intp]) -> Complex:
    """Spectra of windows of two periods, (windows, signals, lines)."""
    length = 2 * lines.window
    hann = 1 - np.cos(2 * np.pi * np.arange(length) / length)
    bins = 2 * np.array(lines.bins)
    windows = np.stack([signals[:, start : start + length] for start in starts])
    return np.asarray(np.fft.rfft(windows * hann)[..., bins] / hann.sum())


def _moments(about: Complex) -> tuple[Complex, Complex]:
    """Mean over windows, (lines, signals), and its covariance, (lines, signals, signals)."""
    count = len(about)
    mean = about.mean(axis=0)
    away = about - mean
    scatter = np.einsum("kil,kjl->lij", away, np.conj(away)) / (count - 1)
    covariance = scatter * (1 + 2 * _OVERLAP * (count - 1) / count) / (count - 2 * _OVERLAP)
    return mean.T, covariance


@dataclass(frozen=True, eq=False)
class LoopResidual:
    """What remains of u − E·w + F·y, and its variance.

    Attributes
    ----------
    frequency_hz
        The lines, (lines,).
    value, variance
        Of the remainder, (lines,).
    dof
        Complex degrees of freedom of the variance.
    feedback
        F·y of the description, (lines,).
    largest
        The largest of |u|, |E·w| and |F·y|, (lines,).
    known
        Where y is large enough to give the controller, (lines,).
    """

    frequency_hz: Floats
    value: Complex
    variance: Floats
    dof: float
    feedback: Complex
    largest: Floats
    known: NDArray[np.bool_]

    @property
    def ratio(self) -> Complex:
        """The controller as measured over the controller as described, (E·w − u)/(F·y), (lines,); NaN if not known."""
        with np.errstate(all="ignore"):
            return np.where(self.known, 1 - self.value / self.feedback, complex(np.nan, np.nan))

    @property
    def ratio_sigma(self) -> Floats:
        """Standard deviation of `ratio`, (lines,)."""
        with np.errstate(all="ignore"):
            return np.where(self.known, np.sqrt(self.variance) / np.abs(self.feedback), np.nan)

    @property
    def misfit(self) -> float:
        """Twice the negative logarithm of the product of the lines' p values.

        |value|²/variance follows F(2, 2d), whose p value is (1 + x/d)^−d. By Fisher's method the sum follows χ² with
        two degrees of freedom for each line.
        """
        away = np.abs(self.value) ** 2 / self.variance
        return float(2 * self.dof * np.sum(np.log1p(away / self.dof)))

    @property
    def deviance(self) -> float:
        """Minus twice the logarithm of the likelihood, but for a constant.

        Of a normal remainder whose variance is known by its estimate only: (variance + |value|²/d)^−(d + 1).
        """
        return float(2 * (self.dof + 1) * np.sum(np.log(self.variance + np.abs(self.value) ** 2 / self.dof)))

    @property
    def share(self) -> float:
        """Rms over the lines of what noise does not explain of the remainder, over that of the largest signal."""
        more = np.sum(np.abs(self.value) ** 2 - self.variance)
        return float(np.sqrt(max(more, 0.0) / np.sum(self.largest**2)))

    def p(self, fitted: int = 0) -> float:
        """Probability of a misfit as large as this one, of a true description of which `fitted` numbers were fitted."""
        with needing("SciPy", "analysis", "a check of the loop's description"):
            from scipy.special import gammaincc
        return float(gammaincc(self.value.size - fitted / 2, self.misfit / 2))


def _step(samples: Floats) -> float:
    """The step in which a signal is recorded; 0 of one that does not have few values."""
    values = np.unique(samples)
    if values.size < 2 or values.size > samples.size / 2:
        return 0.0
    return float(np.diff(values).min())
