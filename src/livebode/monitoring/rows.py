"""Rows: what windows that do not overlap say, whether responses or fitted parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebode.nouns import Parameters, Responses

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rows:
    """One row for every window length, (rows, columns) for values.

    `variance` is what a row says of itself, E|error|²; `step` what the schedule moved since the row before; `ok` is
    False where a row is not to be judged.
    """

    value: NDArray[np.complex128]
    variance: Floats
    schedule: Floats
    step: Floats
    time_s: Floats
    sample: NDArray[np.int64]
    ok: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.sample)

    def some(self, chosen: NDArray[np.bool_]) -> Rows:
        """Some of the rows."""
        return Rows(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))

    @classmethod
    def join(cls, parts: Sequence[Rows]) -> Rows:
        """Parts in order as one; at least one."""
        return cls(*(np.concatenate([getattr(p, name) for p in parts]) for name in cls.__dataclass_fields__))


class Apart:
    """Takes one row for each window from a stream of responses or parameters: the first in each period.

    Of responses further apart than a window it takes each.
    """

    def __init__(self, window: int, hop: int) -> None:
        self._window, self._place, self._apart = window, hop % window, max(window, hop)
        self._sample, self._schedule = -2 * self._apart, np.nan  # no row stands so far behind it

    def of_responses(self, responses: Responses) -> Rows:
        """Rows of complex values at the lines."""
        use = self._chosen(responses.sample)
        ok = np.all(responses.valid[use] & np.isfinite(responses.sigma[use]), axis=1)
        return self._rows(
            responses.value[use], responses.sigma[use] ** 2, responses.schedule[use], responses.time_s[use],
            responses.sample[use], ok,
        )  # fmt: skip

    def of_parameters(self, parameters: Parameters) -> Rows:
        """Rows of parameters."""
        use = self._chosen(parameters.sample)
        variance = np.einsum("rii->ri", parameters.covariance[use])
        return self._rows(
            parameters.value[use].astype(np.complex128), variance, parameters.schedule[use], parameters.time_s[use],
            parameters.sample[use], parameters.ok[use],
        )  # fmt: skip

    def _chosen(self, sample: NDArray[np.int64]) -> NDArray[np.intp]:
        return np.flatnonzero((sample + 1) % self._window == self._place)

    def _rows(
        self, value: NDArray[np.complex128], variance: Floats, schedule: Floats, time_s: Floats,
        sample: NDArray[np.int64], ok: NDArray[np.bool_],
    ) -> Rows:  # fmt: skip
        before = np.concatenate([[self._schedule], schedule])
        follows = np.diff(np.concatenate([[self._sample], sample])) == self._apart
        if len(sample):
            self._sample, self._schedule = int(sample[-1]), float(schedule[-1])
        step = np.diff(before)
        known = (follows & np.isfinite(step)) | ~np.isfinite(schedule)
        return Rows(value, variance, schedule, np.where(follows, step, np.nan), time_s, sample, ok & known)

    def state(self) -> dict[str, NDArray[np.generic]]:
        return {"sample": np.array(self._sample), "schedule": np.array(self._schedule)}

    def load(self, state: dict[str, NDArray[np.generic]]) -> None:
        self._sample, self._schedule = int(state["sample"]), float(state["schedule"])
