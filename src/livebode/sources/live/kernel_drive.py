"""What the firmware of a drive does that runs the kernel and sends spectra (docs/how-to/live.md)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from livebode.core import NOT_WHOLE, Block, SpectraLayout
from livebode.estimation import Centre, check_instruction_set
from livebode.kernel import SlidingDFT, own_hop
from livebode.sources.live.spectra_batch import SpectraBatch


class KernelDrive:
    """Turns samples, from number 0 on and without gaps, into spectra: for a sender in Python, and to try a layout.

    Parameters
    ----------
    layout
        Signals, bins, window and hop of the spectra.
    dtype
        Number type of the kernel, `float32` or `float64`.

    Raises
    ------
    UsageError
        If the environment names an instruction set that the kernel does not have.
    """

    def __init__(self, layout: SpectraLayout, dtype: str = "float32") -> None:
        self._layout, self._dtype = layout, np.dtype(dtype)
        check_instruction_set()
        hop = own_hop(layout.window, layout.hop)
        self._dft = SlidingDFT(layout.window, list(layout.bins), channels=len(layout.signals), dtype=dtype, hop=hop)
        self._centres = [Centre(layout.window) for _ in layout.values]
        self._next, self._last_bad = 0, -1
        self._before: NDArray[np.float64] | None = None
        self._missing: NDArray[np.intp] = np.empty(0, dtype=np.intp)

    def spectra(self, blocks: Iterable[Block], epoch: int = 0) -> Iterator[SpectraBatch]:
        """Spectra of these samples, a batch for each Block that completes some; `epoch` is the sender's start."""
        for block in blocks:
            if (batch := self._push(block, epoch)) is not None:
                yield batch

    def _push(self, block: Block, epoch: int) -> SpectraBatch | None:
        layout, first = self._layout, self._next
        position = np.arange(-(first + 1) % layout.hop, len(block), layout.hop)
        sums = self._dft.process(self._prepared(block), hop=layout.hop, phase="fixed")
        values = [centre.at(block[c.name], position) for centre, c in zip(self._centres, layout.values)]
        bad = np.full(len(block), self._last_bad)
        bad[self._missing] = first + self._missing
        bad = np.maximum.accumulate(bad)
        self._next, self._last_bad = first + len(block), int(bad[-1])
        if not position.size:
            return None
        newest = first + position
        return SpectraBatch(
            int(newest[0]) + 1 - layout.hop,
            np.asarray(sums, dtype=np.complex128),
            np.array(values).reshape(len(layout.values), position.size),
            np.where(newest - bad[position] < layout.window, NOT_WHOLE, 0).astype(np.uint32),
            layout,
            block.rate_hz,
            epoch,
        )

    def _prepared(self, block: Block) -> NDArray[np.float64]:
        """What goes into the kernel: less its constant, differenced, 0 for what is not finite."""
        layout = self._layout
        x = np.array([block[signal.name] for signal in layout.signals])
        differenced = np.array(layout.differenced)
        if differenced.any():
            before = x[:, 0] if self._before is None else self._before
            steps = np.diff(x, axis=1, prepend=before[:, np.newaxis])
            # The first sample has no predecessor, so no window with it is whole.
            self._last_bad = max(self._last_bad, 0)
            self._before, x = x[:, -1], np.where(differenced[:, np.newaxis], steps, x)
        x = (x - np.array(layout.subtracted)[:, np.newaxis]).astype(self._dtype).astype(np.float64)
        self._missing = np.flatnonzero(~np.isfinite(x).all(axis=0))
        x[:, self._missing] = 0.0
        return np.asarray(x, dtype=np.float64)
