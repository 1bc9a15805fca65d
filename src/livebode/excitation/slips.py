"""Phase jumps of a periodic excitation: samples that were dropped, or recorded twice, without a gap."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.dataclass import dataclass

_PERIODS_MIN = 6
_REMEMBERED = 16  # periods in the expected one: a drifting clock is followed and does not count as jumps
_TOGETHER = 128  # periods that are examined in one computation, as long as nothing is found
# Energy by which a jump changes a period, over the noise of a sample: exceeded by chance once in 1e4 periods.
_CLEAR = 16.0**2
_CONFIRMED = 2  # consecutive periods with the same jump
_ROUNDING = 1e-6  # of a period's energy
_UNCHANGED = 1e-12  # of a period's energy: a shift by a whole period of all its lines differs only by rounding
_EQUAL, _CHANGED = 1e-14, 1e-8  # of a period's energy: between equal periods, and by a shift that can be seen there
_STRANGE, _STRANGE_MAX = 4.0, 3  # times the noise, and periods in a row
_AGREES = (
    1 / 8
)  # of that energy: fit of the previous period with its own phase, and of the following ones with the new phase


@dataclass(frozen=True)
class Slip:
    """A jump of the phase.

    Attributes
    ----------
    sample
        Number of the first sample after it, as recorded.
    missing
        Samples that are missing before it; negative for samples recorded twice.
    """

    sample: int
    missing: int


def find_slips(x: Floats, period: int) -> tuple[Slip, ...]:
    """The phase jumps of a signal with this period, all finite; a jump by more than half a period counts backwards.

    Each period is shifted to the best agreement with the mean of the last 16. A shift is a jump if it explains more
    than half of the change that such a shift causes, far above the noise, in two consecutive periods, and if the
    previous period fits well without it: a spike, a transient or a slow drift of the phase is not a jump. Two jumps
    within three periods are found as one, at one place.

    Examples
    --------
    >>> x = np.resize(np.sin(2 * np.pi * np.arange(100) / 50) + np.sin(2 * np.pi * np.arange(100) / 10), 1000)
    >>> find_slips(np.delete(x, 420), 50)
    (Slip(sample=420, missing=1),)
    """
    count = x.size // period
    if count < _PERIODS_MIN:
        return ()
    blocks = x[: count * period].reshape(count, period)
    if np.array_equal(blocks[0], blocks[1]) and np.array_equal(blocks[2:], blocks[1:-1]):
        return ()  # a digital command: in equal periods no other shift agrees better by more than rounding
    return tuple(_Search(blocks - blocks.mean(axis=1, keepdims=True)).slips())


class _Search:
    def __init__(self, blocks: Floats) -> None:
        self._x, self._blocks, self._period = blocks.ravel(), blocks, blocks.shape[1]

    @cached_property
    def _energy(self) -> Floats:
        return _row_energies(self._blocks)

    @cached_property
    def _noise(self) -> float:
        """Energy of the noise of a period: jumps are in fewer than three of four pairs."""
        return float(np.quantile(_row_energies(self._blocks[1:], self._blocks[:-1]), 0.25)) / 2

    @cached_property
    def _spectra(self) -> Complex:
        return np.fft.rfft(self._blocks, axis=1)

    def slips(self) -> list[Slip]:
        slips: list[Slip] = []
        index, shift, strange, recent = 0, 0, 0, [self._blocks[0]]
        while (index := index + 1) < len(self._blocks):
            if not strange and (equal := self._equal(index, np.array(recent[-_REMEMBERED:]), shift)):
                newest = self._blocks[index + max(equal - _REMEMBERED, 0) : index + equal]
                recent, index = [*recent[-_REMEMBERED:], *np.roll(newest, shift, axis=1)], index + equal - 1
                continue
            if not strange and len(recent) >= _REMEMBERED:
                calm = self._calm(index, np.array(recent[-_REMEMBERED:]), shift)
                recent, index = [*recent[-_REMEMBERED:], *calm], index + len(calm)
                if index == len(self._blocks):
                    break
            expected = np.mean(recent[-_REMEMBERED:], axis=0)
            leap = self._leap(index, expected, shift)
            if leap:
                slips.append(Slip(self._place(index, expected, shift, shift + leap), leap))
                shift += leap
            here = np.roll(self._blocks[index], shift)
            # A period with a jump is a poor reference for the next ones; several in sequence show a changed signal.
            usual = _STRANGE * self._noise + _ROUNDING * self._energy[index]
            strange = strange + 1 if np.sum((here - expected) ** 2) > usual else 0
            if strange in (0, _STRANGE_MAX):
                recent.append(here)
                strange = 0
        return slips

    def _equal(self, index: int, recent: Floats, shift: int) -> int:
        """The number of next periods that equal the last ones so nearly that none can jump or be strange.

        A period and the expected one differ by the energy d = 4·_EQUAL at most. A shift that changes the period by the
        energy g agrees with it less by g/2 − √(d·g), which is far above rounding for g ≥ _CHANGED; one that changes
        nothing, as by half a window of two periods, is not a jump.
        """
        known = recent[-1]
        energy, next_one = np.dot(known, known), np.roll(known, -shift)
        near = np.concatenate([recent - known, self._blocks[index : index + 1] - next_one])
        if np.any(_row_energies(near) > _EQUAL * energy):
            return 0
        own = np.fft.irfft(np.abs(np.fft.rfft(known)) ** 2, self._period)[1:]
        changes = 2 * (energy - own)
        if np.any((changes > _UNCHANGED / 2 * energy) & (changes < _CHANGED * energy)):
            return 0
        rows = self._blocks[index : index + _TOGETHER]
        differ = _row_energies(rows, next_one) > _EQUAL * energy
        return int(np.argmax(differ)) if differ.any() else len(rows)

    def _calm(self, index: int, recent: Floats, shift: int) -> Floats:
        """The next periods, shifted, that have no jump and are not strange: the loop in `slips` for many at a time."""
        here = np.roll(self._blocks[index : index + _TOGETHER], shift, axis=1)
        known, expected = np.concatenate([recent, here[:-1]]), np.zeros_like(here)
        for behind in range(_REMEMBERED):  # in the order of a mean over the rows: the same bits
            expected += known[behind : behind + len(here)]
        expected /= _REMEMBERED
        spectra = self._spectra[index : index + _TOGETHER]
        template = np.fft.rfft(expected, axis=1)
        agreement = np.fft.irfft(template * spectra.conj(), self._period, axis=1)
        energy = self._energy[index : index + _TOGETHER]
        unusual = np.sum((here - expected) ** 2, axis=1) > _STRANGE * self._noise + _ROUNDING * energy
        leaps = (np.argmax(agreement, axis=1) - shift) % self._period
        moved = np.flatnonzero(leaps)
        if moved.size:
            # Where another shift changes nothing, as by half a window of two periods, noise alone decides for it.
            own = np.fft.irfft(np.abs(template[moved]) ** 2, self._period, axis=1)
            changes = 2 * (own[:, 0] - own[np.arange(moved.size), leaps[moved]])
            unusual[moved] |= changes > self._least(energy[moved]) / 2  # half: far above the rounding of `_leap`
        return here[: int(np.argmax(unusual))] if unusual.any() else here

    def _least(self, energy: Floats) -> Floats:
        """The change by a shift that is clear, in periods of this energy."""
        return np.asarray(np.maximum(_CLEAR * self._noise / self._period, _UNCHANGED * energy))

    def _leap(self, index: int, expected: Floats, shift: int) -> int:
        """Phase jump in samples in this period or the previous one; 0 without a jump."""
        if index + _CONFIRMED > len(self._blocks):
            return 0
        template = np.fft.rfft(expected)
        own = np.fft.irfft(np.abs(template) ** 2, self._period)
        leap = 0
        for m in range(index, index + _CONFIRMED):
            agreement = np.fft.irfft(template * self._spectra[m].conj(), self._period)
            best = int(np.argmax(agreement))
            here = _folded(best - shift, self._period)
            energy = 2 * (own[0] - own[here % self._period])
            gain = 2 * (agreement[best] - agreement[shift % self._period])
            residual = self._energy[m] + own[0] - 2 * agreement[best]
            fits = residual <= self._noise * 2 + _AGREES * energy
            clear = gain > energy / 2 and energy > self._least(self._energy[m])
            if not here or not fits or not clear or (leap and here != leap):
                return 0
            leap = here
        return leap if self._fitted(index, expected, shift, float(energy)) else 0

    def _fitted(self, index: int, expected: Floats, shift: int, energy: float) -> bool:
        """Whether one of the two previous periods still fits the old phase: the jump may be in the nearer one."""
        before = [np.roll(self._blocks[m], shift) for m in range(max(index - 2, 0), index)]
        rests = [float(np.sum((block - expected) ** 2)) for block in before]
        return min(rests) <= self._noise * 2 + _AGREES * energy

    def _place(self, index: int, expected: Floats, shift: int, leapt: int) -> int:
        """The first sample after the jump: the least residual of the old phase before and the new phase after."""
        first, last = max(index - 1, 0) * self._period, (index + 1) * self._period
        n, part = np.arange(first, last), self._x[first:last]
        old = (part - expected[(n + shift) % self._period]) ** 2
        new = (part - expected[(n + leapt) % self._period]) ** 2
        return int(first + np.argmin(np.concatenate(([0.0], np.cumsum(old - new)))))


def _row_energies(blocks: Floats, minus: Floats | float = 0.0) -> Floats:
    """The sum of squares of each row, less others or one; some rows at a time, to need little memory."""
    energies = np.empty(len(blocks))
    minus = np.broadcast_to(minus, blocks.shape)
    for first in range(0, len(blocks), _TOGETHER):
        rows = slice(first, first + _TOGETHER)
        energies[rows] = np.sum((blocks[rows] - minus[rows]) ** 2, axis=1)
    return energies


def _folded(shift: int, period: int) -> int:
    shift %= period
    return shift - period if shift > period // 2 else shift


def realigned(x: Floats, slips: Sequence[Slip]) -> Floats:
    """The signal with NaN for missing samples, and without repeated ones, on one grid of periods."""
    parts, done = [], 0
    for slip in slips:
        parts += [x[done : slip.sample], np.full(max(slip.missing, 0), np.nan)]
        done = slip.sample + max(-slip.missing, 0)
    return np.concatenate([*parts, x[done:]])
