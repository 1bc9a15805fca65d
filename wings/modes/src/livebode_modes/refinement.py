"""Modes of a window with the values and bounds of the maximum of the likelihood, instead of those of the subspace."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode_modes.likelihood import Likelihood, Maximum
from livebode_modes.spectrum import Spectrum, taper
from livebode_modes.stabilisation import DAMPING_MAX, Mode

EVIDENCE_MIN = 25.0
"""Least evidence of a mode: twice the logarithm of the ratio of the likelihoods with and without it. Noise exceeds it
with a probability of 5e-5 at a given frequency."""
_STARTS = 1.0, 3.0  # times the damping of the subspace, which is low where it splits a mode
_START_LIMITS = 3e-4, 0.15
_REGIONS, _SAME_REGION = 3, 0.4  # the region is chosen again if the logarithm of the damping changes by more
_DECAY = 0.25  # of the sigma that a random force permits


class Refinement:
    """Fits the modes that the subspace found in a window.

    The subspace shows which modes there may be. The fit of the spectrum around each has less variance, and no bias by
    the rigid motion below the band or by a damping that lets the correlations decay within a few lags.

    Parameters
    ----------
    rate_hz
        Reduced rate.
    limits_hz
        Between them the filters pass the outputs.
    gain
        Squared gain of the filters at the bins of a window, 0 … N/2.
    y
        Outputs in each hop of the window, (hops, outputs, samples).
    present
        Which hops are complete, (hops,).
    lines_hz
        Frequencies of harmonics, which are left out.
    """

    def __init__(
        self,
        rate_hz: float,
        limits_hz: tuple[float, float],
        gain: Floats,
        y: Floats,
        present: NDArray[np.bool_],
        lines_hz: Sequence[float],
    ) -> None:
        self._rate_hz, self._limits_hz, self._gain, self._lines_hz = rate_hz, limits_hz, gain, lines_hz
        self._samples, self._taper = np.concatenate(list(y), axis=1), taper(present, y.shape[2])

    def modes(self, stable: Sequence[Mode], possible: Sequence[Mode]) -> list[Mode]:
        """The modes that the spectrum confirms, by frequency.

        Parameters
        ----------
        stable, possible
            Poles of the subspace that models of several orders repeat; other ones, which may be modes beside those.
        """
        decays = [mode for mode in stable if self._is_decay(mode)]
        found = self._confirmed(_without(stable, decays))
        for mode in possible:
            if self._adds(mode, [*found, *decays]):
                found = self._confirmed([*found, mode])
        return sorted([*found, *decays], key=lambda mode: mode.frequency_hz)

    def _adds(self, mode: Mode, others: list[Mode]) -> bool:
        """Whether the spectrum shows a further mode that is separate from the others."""
        if not all(_separate(mode, other) for other in others):
            return False
        fitted, evidence = self._fitted(mode, others)
        return evidence >= EVIDENCE_MIN and all(_separate(fitted, other) for other in others)

    def _confirmed(self, modes: list[Mode]) -> list[Mode]:
        """The modes at the maximum, without those that the spectrum does not show beside the others."""
        while modes:
            fitted, evidence = zip(*(self._fitted(mode, _without(modes, [mode])) for mode in modes))
            doubtful = [i for i in range(len(modes)) if evidence[i] < EVIDENCE_MIN]
            doubtful = doubtful or [i for i, mode in enumerate(fitted) if not _apart(mode, fitted)]
            if not doubtful:
                return list(fitted)
            del modes[min(doubtful, key=lambda i: evidence[i])]
        return modes

    def _is_decay(self, mode: Mode) -> bool:
        """Whether the hops repeat the pole better than they could under a random force: a free decay.

        The variance of a damping ratio under a random force is at least ζ/ωT.
        """
        cycles = 2 * np.pi * mode.frequency_hz * self._samples.shape[1] / self._rate_hz
        return bool(mode.covariance[1, 1] < _DECAY**2 * max(mode.damping, 0.0) / cycles)

    def _fitted(self, mode: Mode, others: list[Mode]) -> tuple[Mode, float]:
        """The mode at the maximum beside others, and its evidence."""
        spectrum = Spectrum(_direction(mode) @ self._samples, self._taper, self._rate_hz, self._gain)
        best, evidence = mode, -np.inf
        for _ in range(_REGIONS):
            region, inside = self._region(spectrum, best, others)
            f = np.array([*(other.frequency_hz for other in inside), best.frequency_hz])
            z = np.clip([*(other.damping for other in inside), best.damping], *_START_LIMITS)
            likelihood = Likelihood(spectrum, region, self._lines_hz)
            found, without = _highest(likelihood, f, z), likelihood.maximum(f[:-1], z[:-1])
            if found is None or without is None or found.damping[-1] > DAMPING_MAX:
                break
            best, evidence = _valued(mode, found), 2 * (found.log_likelihood - without.log_likelihood)
            if abs(np.log(best.damping / z[-1])) < _SAME_REGION:
                break
        return best, evidence

    def _region(self, spectrum: Spectrum, mode: Mode, others: list[Mode]) -> tuple[slice, list[Mode]]:
        """The bins around a mode, and the others with skirts in them: whose bins are nearer than half as many."""
        around = spectrum.region(mode.frequency_hz, max(mode.damping, 0.0), self._limits_hz)
        low, high, inside = around.start, around.stop, list[Mode]()
        for other in others:
            of_other = spectrum.region(other.frequency_hz, other.damping, self._limits_hz)
            near = (of_other.stop - of_other.start) // 2
            if of_other.start - near < around.stop and around.start < of_other.stop + near:
                low, high = min(low, of_other.start), max(high, of_other.stop)
                inside.append(other)
        return slice(low, high), inside


def _highest(likelihood: Likelihood, f: Floats, z: Floats) -> Maximum | None:
    """The highest maximum for several dampings of the last mode at the start."""
    starts = [np.append(z[:-1], min(factor * z[-1], _START_LIMITS[1])) for factor in _STARTS]
    found = [each for each in (likelihood.maximum(f, start) for start in starts) if each is not None and each.converged]
    return max(found, key=lambda each: each.log_likelihood) if found else None


def _valued(mode: Mode, found: Maximum) -> Mode:
    f, z = float(found.frequency_hz[-1]), float(found.damping[-1])
    return replace(mode, frequency_hz=f, damping=z, covariance=found.covariance[-1])


def _without(modes: Sequence[Mode], left_out: Sequence[Mode]) -> list[Mode]:
    return [mode for mode in modes if all(mode is not other for other in left_out)]


def _apart(mode: Mode, modes: Sequence[Mode]) -> bool:
    return all(_separate(mode, other) for other in _without(modes, [mode]))


def _separate(mode: Mode, other: Mode) -> bool:
    """Whether two modes are further apart than half their half-power widths together."""
    width_hz = mode.damping * mode.frequency_hz + other.damping * other.frequency_hz
    return abs(mode.frequency_hz - other.frequency_hz) > width_hz


def _direction(mode: Mode) -> Floats:
    """Weights of the outputs that add up the mode."""
    shape = mode.shape * np.exp(-0.5j * np.angle(np.sum(mode.shape**2)))
    return np.asarray(shape.real / np.linalg.norm(shape.real))
