"""MatrixSpec: the required accuracy or the available time of an experiment on several inputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, get_args

import numpy as np
from annotated_types import Ge, Gt, Le, MinLen
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import CIRCLE_FACTOR, UsageError
from livebode.dataclass import dataclass

Kind = Literal["orthogonal", "interleaved", "successive"]
KINDS: tuple[Kind, ...] = get_args(Kind)
_Sigma = Annotated[float, Gt(0)]

ACCURACY = 0.05
"""Default of `MatrixSpec.accuracy`, where neither another requirement nor a time is given."""


@dataclass(frozen=True, kw_only=True)
class MatrixSpec:
    """What the experiments must reach: an accuracy in the shortest time, or the best one in a time.

    Parameters
    ----------
    lines
        Lines in Hz, such as "10:60:5, 80".
    window
        Samples of a period.
    kind
        "orthogonal", "interleaved" or "successive". Default: chosen.
    accuracy
        Required 95 % bound of each entry, as a share of the largest response of its output at that line. Default: 0.05
        if neither `sigma_max` nor `time_s` is given.
    sigma_max
        Required sigma of each entry in its unit: one number, or a row for each output with a value for each input.
    time_s
        Available time, seconds. Default: no limit.
    settle_periods
        Periods at the begin of each experiment that are not used. Default: chosen by the slowest mode.
    seed
        Random seed of the search for phases.

    Raises
    ------
    UsageError
        If a value is out of range, or accuracy and sigma_max are both given.
    """

    lines: Annotated[str, MinLen(1)]
    window: Annotated[int, Ge(2)]
    kind: Kind | None = None
    accuracy: Annotated[float, Ge(1e-6), Le(1)] | None = None
    sigma_max: _Sigma | Annotated[Sequence[Annotated[Sequence[_Sigma], MinLen(1)]], MinLen(1)] | None = None
    time_s: Annotated[float, Gt(0)] | None = None
    settle_periods: Annotated[int, Ge(1), Le(998)] | None = None
    seed: Annotated[int, Ge(0)] = 0

    def __post_init__(self) -> None:
        if self.kind not in (None, *KINDS):
            raise UsageError(
                "not-one-of",
                f"kind={self.kind!r} is not supported for several inputs",
                f"choose {', '.join(map(repr, KINDS))}, or leave it out",
                argument="kind",
                value=self.kind,
                allowed=list(KINDS),
            )
        if self.accuracy is not None and self.sigma_max is not None:
            raise UsageError(
                "conflict", "accuracy and sigma_max both require an accuracy", "leave one out", argument="sigma_max"
            )
        for name, low, high in (
            ("accuracy", 1e-6, 1.0),
            ("time_s", 1e-6, 1e9),
            ("settle_periods", 1, 998),
            ("window", 2, 2**31),
            ("seed", 0, 2**63),
        ):
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise UsageError(
                    "out-of-range",
                    f"{name}={value} is not from {low:g} to {high:g}",
                    "choose a value between them",
                    argument=name,
                    value=value,
                    low=low,
                    high=high,
                )

    @property
    def requires(self) -> bool:
        """Whether an accuracy must be reached; otherwise the time is used."""
        return self.accuracy is not None or self.sigma_max is not None or self.time_s is None

    def target(self, response: NDArray[np.complex128]) -> Floats:
        """Required sigma of each entry, shape (lines, outputs, inputs) of `response`.

        Where only the time is specified, it is that of a 95 % bound as large as the response.
        """
        if self.sigma_max is None:
            share = self.accuracy or (1.0 if self.time_s is not None else ACCURACY)
            largest = np.abs(response).max(axis=2, keepdims=True)
            return np.broadcast_to(share * largest / CIRCLE_FACTOR, response.shape)
        rows = [self.sigma_max] if isinstance(self.sigma_max, (int, float)) else list(self.sigma_max)
        lengths = {np.size(row) for row in rows}
        given = np.asarray(rows if len(lengths) == 1 else [], dtype=np.float64)
        if given.shape not in ((1,), response.shape[1:]) or not np.all(given > 0):
            raise UsageError(
                "wrong-shape",
                f"sigma_max={self.sigma_max!r} does not fit {response.shape[1]} outputs and {response.shape[2]} "
                "inputs, or is not above 0",
                "give one number, or a row for each output with a number for each input",
                argument="sigma_max",
            )
        return np.broadcast_to(given, response.shape)
