"""What a peer answers, and what it says about itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from studies.peers.recording import Recording


@dataclass(frozen=True, eq=False)
class Estimates:
    """Responses at some newest samples, each speaking for the moment `delay` samples before.

    An answer that is given for a whole stretch at once comes up to `waits` samples after its newest sample.
    `parameters` are Js, mL, Keff, bs, shape (rows, 4), of a peer that finds them itself; else they are fitted.
    """

    sample: np.ndarray
    delay: float
    value: np.ndarray  # (rows, lines)
    parameters: np.ndarray | None = None
    waits: float = 0.0

    def at(self, sample: np.ndarray) -> Estimates:
        """The rows of these newest samples."""
        row = np.searchsorted(self.sample, sample)
        if not np.array_equal(self.sample[row], sample):
            raise ValueError("a judged sample has no estimate")
        parameters = None if self.parameters is None else self.parameters[row]
        return replace(self, sample=sample, value=self.value[row], parameters=parameters)


@dataclass(frozen=True)
class Peer:
    """One row of the table. `estimate` sees the recorded Block of the Recording, never its truth."""

    name: str
    estimate: Callable[[Recording], Estimates]
    inputs: str
    language: str
