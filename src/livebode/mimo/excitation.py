"""Excitations of several inputs that separate them: a sequence of experiments, each with periodic multisines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import Lines, UsageError
from livebode.excitation import Phases, each, multisine


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


def _amplitudes(amplitude: ArrayLike, inputs: int, lines: int) -> Floats:
    """Shape (inputs, lines); one for all, one for each input, or one for each input and line."""
    given = np.asarray(amplitude, dtype=np.float64)
    given = given[:, np.newaxis] if given.shape == (inputs,) else given
    if given.shape not in ((), (inputs, 1), (inputs, lines)) or not np.all(np.isfinite(given)):
        raise UsageError(
            "wrong-shape",
            f"amplitude has shape {np.shape(amplitude)} for {inputs} inputs and {lines} lines, or is not finite",
            "give one number, one for each input, or one for each input and line",
            argument="amplitude",
            shape=list(np.shape(amplitude)),
        )
    return np.broadcast_to(given, (inputs, lines))


def _samples(lines: Lines, spectra: Complex, dwell: int) -> Floats:
    full = np.zeros((*spectra.shape[:2], lines.window // 2 + 1), dtype=np.complex128)
    full[:, :, list(lines.bins)] = spectra * lines.window / 2j
    periods = np.fft.irfft(full, lines.window, axis=2)  # (experiments, inputs, N)
    return np.concatenate([np.tile(period, dwell) for period in periods], axis=1)
