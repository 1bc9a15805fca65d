"""Excitations of several inputs that separate them: a sequence of experiments, each with periodic multisines."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import Lines, MatrixLoop, UsageError
from livebode.dataclass import dataclass
from livebode.excitation._multisine import Phases, each, multisine

Plant = Callable[[Floats], Complex]
"""Response matrix (lines, outputs, inputs) at frequencies in Hz."""


@dataclass(frozen=True, eq=False)
class MatrixPrediction:
    """What an excitation does to a machine in its loop, in the periodic state.

    Attributes
    ----------
    sigma
        Of each entry from one repetition of the experiments, shape (lines, outputs, inputs): E|Ĝ − G|² = sigma².
    condition
        Condition number of the inputs at each line, each scaled to the same power over all lines, shape (lines,).
    input_peak, output_peak
        Largest magnitude of each plant input and output over all experiments, without their transients.
    """

    sigma: Floats
    condition: Floats
    input_peak: Floats
    output_peak: Floats


@dataclass(frozen=True, eq=False)
class MatrixExcitation:
    """One repetition of the experiments for several inputs.

    Attributes
    ----------
    lines
        Lines of the measurement; each experiment has the period `lines.window`.
    kind
        "orthogonal", "interleaved" or "successive".
    dwell, settle
        Periods of an experiment, and those at its begin that the tracker does not use.
    spectra
        Complex amplitude of each line, the sine's phase being its angle, shape (experiments, inputs, lines).
    samples
        Shape (inputs, experiments·dwell·window).

    Examples
    --------
    >>> lines = Lines.parse("20:140:20", rate_hz=4000, window=200)
    >>> excitation = MatrixExcitation.orthogonal(lines, 2, amplitude=[0.5, 0.2])
    >>> excitation.samples.shape, excitation.spectra.shape
    ((2, 800), (2, 2, 7))
    """

    lines: Lines
    kind: str
    dwell: int
    settle: int
    spectra: Complex
    samples: Floats

    @classmethod
    def orthogonal(
        cls,
        lines: Lines,
        inputs: int,
        amplitude: ArrayLike = 1.0,
        phases: ArrayLike | Phases = "schroeder",
        *,
        dwell: int = 2,
        settle: int = 1,
        seed: int = 0,
    ) -> MatrixExcitation:
        """All inputs at all lines in every experiment, with phases that rotate by −2πpj/n for input j of experiment p.

        The spectra of the inputs are then orthogonal over the n experiments, so that at the same amplitude each entry
        has 1/n of the variance of `successive` (Dobrowiecki, Schoukens, Guillaume, IEEE Trans. Instrum. Meas. 55(5),
        2006). All axes move at once.

        Raises
        ------
        UsageError
            If a number is out of range, or amplitudes or phases do not fit the lines or the inputs.
        """
        turns = np.outer(np.arange(inputs), np.arange(inputs)) / max(inputs, 1)
        pattern = np.exp(-2j * np.pi * turns)[:, :, np.newaxis] * np.ones(len(lines))
        return cls._of("orthogonal", lines, pattern, amplitude, phases, (dwell, settle), seed)

    @classmethod
    def interleaved(
        cls,
        lines: Lines,
        inputs: int,
        amplitude: ArrayLike = 1.0,
        phases: ArrayLike | Phases = "schroeder",
        *,
        dwell: int = 2,
        settle: int = 1,
        seed: int = 0,
    ) -> MatrixExcitation:
        """All inputs at once, each at every n-th line (zippered), and at the next line in the next experiment.

        In one experiment no line has two inputs. Over n experiments each input has every line.

        Raises
        ------
        UsageError
            As `orthogonal`.
        """
        numbers = np.add.outer(np.arange(inputs), np.arange(len(lines)))  # (experiments, lines)
        pattern = (numbers[:, np.newaxis] % inputs == np.arange(inputs)[:, np.newaxis]).astype(np.complex128)
        return cls._of("interleaved", lines, pattern, amplitude, phases, (dwell, settle), seed)

    @classmethod
    def successive(
        cls,
        lines: Lines,
        inputs: int,
        amplitude: ArrayLike = 1.0,
        phases: ArrayLike | Phases = "schroeder",
        *,
        dwell: int = 2,
        settle: int = 1,
        seed: int = 0,
    ) -> MatrixExcitation:
        """One input after the other, each with all lines.

        Raises
        ------
        UsageError
            As `orthogonal`.
        """
        pattern = np.repeat(np.eye(inputs, dtype=np.complex128)[:, :, np.newaxis], len(lines), axis=2)
        return cls._of("successive", lines, pattern, amplitude, phases, (dwell, settle), seed)

    @classmethod
    def _of(
        cls,
        kind: str,
        lines: Lines,
        pattern: Complex,
        amplitude: ArrayLike,
        phases: ArrayLike | Phases,
        periods: tuple[int, int],
        seed: int,
    ) -> MatrixExcitation:
        inputs, (dwell, settle) = pattern.shape[1], periods
        for name, value, low in (("inputs", inputs, 1), ("settle", settle, 0), ("dwell", dwell, settle + 1)):
            if value < low:
                raise UsageError(
                    "out-of-range",
                    f"{name}={value} is below {low}",
                    "take that or more",
                    argument=name,
                    value=value,
                    low=low,
                )
        unit = multisine(lines, 1.0, phases, seed=seed)
        size = _amplitudes(amplitude, inputs, len(lines))
        # A_k·sin(kθ + φ) has the DFT −j·A_k·e^(jφ)·N/2.
        phasors = np.fft.rfft(unit)[list(lines.bins)] * 2j / lines.window
        spectra = pattern * size * phasors
        return cls(lines, kind, dwell, settle, spectra, _samples(lines, spectra, dwell))

    def scaled(self, factors: ArrayLike) -> MatrixExcitation:
        """Each input times a factor, shape (inputs,)."""
        factor = each(factors, self.samples.shape[0], "factors")[:, np.newaxis]
        spectra, samples = self.spectra * factor, self.samples * factor
        return MatrixExcitation(self.lines, self.kind, self.dwell, self.settle, spectra, samples)

    def predict(self, plant: Plant, noise: ArrayLike, loop: MatrixLoop | None = None) -> MatrixPrediction:
        """Sigma of each entry of the joint (or indirect) estimate, and the peaks of all axes at once.

        Cov G = (U·U*)⁻¹ ⊗ N·diag(noise²) with U the spectra of the inputs over the experiments, to first order in noise
        over signal. It is the Cramér–Rao bound of white noise at the outputs, and of k repetitions it is 1/k of it.

        Parameters
        ----------
        plant
            Response matrix of frequencies in Hz, shape (lines, outputs, inputs).
        noise
            Standard deviation of white noise on each output, in its unit.
        loop
            The feedback; None: open loop.

        Raises
        ------
        UsageError
            If there is not one noise for each output, or the excitation does not separate the inputs.

        Examples
        --------
        >>> from livebode import Lines
        >>> lines = Lines.parse("20:140:20", rate_hz=4000, window=200)
        >>> plant = lambda f: np.tile([[2.0, 1.0], [0.0, 3.0]], (len(f), 1, 1))
        >>> together = MatrixExcitation.orthogonal(lines, 2).predict(plant, 0.1)
        >>> after = MatrixExcitation.successive(lines, 2).predict(plant, 0.1)
        >>> float((after.sigma / together.sigma).mean().round(3))
        1.414
        """
        f, window = self.lines.frequency_hz, self.lines.window
        response = np.asarray(plant(f), dtype=np.complex128)
        inputs = _inputs(self, response, loop)  # (lines, inputs, experiments)
        deviation = each(noise, response.shape[1], "noise")
        scale = np.sqrt(np.mean(np.abs(inputs) ** 2, axis=(0, 2)))
        size = np.linalg.svd(inputs / np.where(scale > 0, scale, 1)[:, None], compute_uv=False)
        if size.shape[1] < inputs.shape[1] or not (size[:, -1] > 1e-9 * size[:, 0]).all():
            raise UsageError(
                "out-of-range",
                "the excitation does not separate the inputs: they move together in all experiments",
                "take as many different experiments as inputs",
                argument="excitation",
            )
        gram = np.linalg.inv(inputs @ np.swapaxes(inputs, 1, 2).conj())
        # Noise of standard deviation σ has the power N·σ² in a bin, and an amplitude A the spectrum A·N/2.
        spread = np.einsum("kii->ki", gram).real * 4 / window
        sigma = deviation[:, None] * np.sqrt(spread)[:, None, :]
        peaks = [_peak(self, spectrum) for spectrum in (inputs, response @ inputs)]
        return MatrixPrediction(sigma, size[:, 0] / size[:, -1], peaks[0], peaks[1])

    def within_limits(
        self,
        plant: Plant,
        *,
        input_max: ArrayLike = np.inf,
        output_max: ArrayLike = np.inf,
        loop: MatrixLoop | None = None,
    ) -> MatrixExcitation:
        """The excitation times the largest common factor that keeps every input and every output within its limit.

        The limits apply to the magnitude, in the periodic state: leave room for the transients between experiments
        and for the motion itself.

        Parameters
        ----------
        plant, loop
            Response matrix and feedback, as of `predict`.
        input_max, output_max
            One limit, or one for each input and output; infinite: none.

        Raises
        ------
        UsageError
            If no limit is finite, or one is not above 0.

        Examples
        --------
        >>> from livebode import Lines
        >>> lines = Lines.parse("20:140:20", rate_hz=4000, window=200)
        >>> plant = lambda f: np.tile([[2.0, 1.0], [0.0, 3.0]], (len(f), 1, 1))
        >>> limited = MatrixExcitation.orthogonal(lines, 2).within_limits(plant, input_max=1.5, output_max=[5.0, 3.0])
        >>> limited.predict(plant, 0.1).output_peak.round(3)
        array([3., 3.])
        """
        unit = self.predict(plant, 1.0, loop)
        factors = []
        for name, limit, peak in (
            ("input_max", input_max, unit.input_peak),
            ("output_max", output_max, unit.output_peak),
        ):
            most = np.broadcast_to(np.asarray(limit, dtype=np.float64), peak.shape)
            if not (most > 0).all():
                raise UsageError(
                    "out-of-range",
                    f"{name}={limit!r} is not above 0",
                    "leave it out for no limit",
                    argument=name,
                    value=str(limit),
                )
            factors.append(float((most / peak).min()))
        if not np.isfinite(factor := min(factors)):
            raise UsageError("missing", "no limit is finite", "give input_max or output_max", argument="input_max")
        return self.scaled(factor)


def _amplitudes(amplitude: ArrayLike, inputs: int, lines: int) -> Floats:
    """Shape (inputs, lines); one for all, one for each input, or one for each input and line."""
    amplitudes = np.asarray(amplitude, dtype=np.float64)
    amplitudes = amplitudes[:, np.newaxis] if amplitudes.shape == (inputs,) else amplitudes
    if amplitudes.shape not in ((), (inputs, 1), (inputs, lines)) or not np.all(np.isfinite(amplitudes)):
        raise UsageError(
            "wrong-shape",
            f"amplitude has shape {np.shape(amplitude)} for {inputs} inputs and {lines} lines, or is not finite",
            "give one number, one for each input, or one for each input and line",
            argument="amplitude",
            shape=list(np.shape(amplitude)),
        )
    return np.broadcast_to(amplitudes, (inputs, lines))


def _samples(lines: Lines, spectra: Complex, dwell: int) -> Floats:
    full = np.zeros((*spectra.shape[:2], lines.window // 2 + 1), dtype=np.complex128)
    full[:, :, list(lines.bins)] = spectra * lines.window / 2j
    periods = np.fft.irfft(full, lines.window, axis=2)  # (experiments, inputs, N)
    return np.concatenate([np.tile(period, dwell) for period in periods], axis=1)


def _inputs(excitation: MatrixExcitation, response: Complex, loop: MatrixLoop | None) -> Complex:
    """U = (1 + F·G)⁻¹·E·W, shape (lines, inputs, experiments)."""
    reference = excitation.spectra.transpose(2, 1, 0)
    if loop is None:
        return reference
    f = excitation.lines.frequency_hz
    open_loop = loop.feedback_at(f) @ response
    reached = loop.entry_at(f, response.shape[2]) @ reference
    return np.asarray(np.linalg.solve(np.eye(response.shape[2]) + open_loop, reached))


def _peak(excitation: MatrixExcitation, spectrum: Complex) -> Floats:
    """Largest magnitude of each signal over all experiments, shape (signals,)."""
    window = excitation.lines.window
    full = np.zeros((*spectrum.shape[1:], window // 2 + 1), dtype=np.complex128)
    full[:, :, list(excitation.lines.bins)] = np.moveaxis(spectrum, 0, 2) * window / 2j
    return np.asarray(np.abs(np.fft.irfft(full, window, axis=2)).max(axis=(1, 2)))
