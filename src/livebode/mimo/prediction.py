"""Accuracy and peaks of an experiment on several inputs, predicted before it is played."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import UsageError
from livebode.excitation import each
from livebode.mimo.excitation import MatrixExcitation
from livebode.mimo.loop import MatrixLoop

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


def predict(
    excitation: MatrixExcitation, plant: Plant, noise: ArrayLike, loop: MatrixLoop | None = None
) -> MatrixPrediction:
    """Sigma of each entry of the joint (or indirect) estimate, and the peaks of all axes at once.

    Cov G = (U·U*)⁻¹ ⊗ N·diag(noise²) with U the spectra of the inputs over the experiments, to first order in noise
    over signal. It is the Cramér–Rao bound of white noise at the outputs, and of k repetitions it is 1/k of it.

    Parameters
    ----------
    excitation
        The experiments.
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
    >>> together = predict(MatrixExcitation.orthogonal(lines, 2), plant, 0.1)
    >>> after = predict(MatrixExcitation.successive(lines, 2), plant, 0.1)
    >>> float((after.sigma / together.sigma).mean().round(3))
    1.414
    """
    f, window = excitation.lines.frequency_hz, excitation.lines.window
    response = np.asarray(plant(f), dtype=np.complex128)
    inputs = _inputs(excitation, response, loop)  # (lines, inputs, experiments)
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
    peaks = [_peak(excitation, spectrum) for spectrum in (inputs, response @ inputs)]
    return MatrixPrediction(sigma, size[:, 0] / size[:, -1], peaks[0], peaks[1])


def within_limits(
    excitation: MatrixExcitation,
    plant: Plant,
    *,
    input_max: ArrayLike = np.inf,
    output_max: ArrayLike = np.inf,
    loop: MatrixLoop | None = None,
) -> MatrixExcitation:
    """The excitation times the largest common factor that keeps every input and every output within its limit.

    The limits apply to the magnitude, in the periodic state: leave room for the transients between experiments and for
    the motion itself.

    Parameters
    ----------
    excitation, plant, loop
        As of `predict`.
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
    >>> limited = within_limits(MatrixExcitation.orthogonal(lines, 2), plant, input_max=1.5, output_max=[5.0, 3.0])
    >>> predict(limited, plant, 0.1).output_peak.round(3)
    array([3., 3.])
    """
    found = predict(excitation, plant, 1.0, loop)
    factors = []
    for name, limit, peak in (
        ("input_max", input_max, found.input_peak),
        ("output_max", output_max, found.output_peak),
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
    return excitation.scaled(factor)


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
