"""One model fitted to rows of measured values: weighted least squares in the parameters' own coordinates.

The fit in C solves the problem where its model has a description for it.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import RowArrays, UsageError, nearest_name
from livebode.dataclass import dataclass
from livebode.fitting.chains import Chain, Rigid, TwoMass, TwoMassGain
from livebode.fitting.least_squares import Minimum, minimise
from livebode.fitting.physical import EvaluationGrid, PhysicalModel
from livebode.kernel import RIGID, TWO_MASS, TWO_MASS_GAIN, FitModel

_KINDS: dict[type[PhysicalModel], int] = {Rigid: RIGID, TwoMass: TWO_MASS, TwoMassGain: TWO_MASS_GAIN}


def native_model(model: PhysicalModel, grid: EvaluationGrid, held: dict[str, float]) -> FitModel | None:
    """None for a model of the user or of three masses, a continuous response, or a free friction.

    A class derived from a model may have another transfer function, so it is not one of them.
    """
    kind = _KINDS.get(type(model))
    if kind is None or grid.hold != "zero-order" or any(name not in held for name in model.frictions):
        return None
    f = grid.frequency_hz
    if not (f.size and f.min() > 0 and f.max() <= grid.rate_hz / 2):
        return None
    return described(model, held)


def described(model: PhysicalModel, held: dict[str, float]) -> FitModel | None:
    """The model with these parameters fixed; None if C has none of its kind."""
    kind = _KINDS.get(type(model))
    if kind is None:
        return None
    columns = [(p.start, p.low, p.high, p.scale, held.get(p.name, np.nan)) for p in model.parameters]
    table: NDArray[np.float64] = np.ascontiguousarray(np.array(columns).T)
    if isinstance(model, Chain):
        ratio = getattr(model, "inertia_ratio", None) or 0.0
        return FitModel(kind, model.integrators, model.side == "load", model.lever, model.arm, ratio, table)
    position = getattr(model, "output", "velocity") == "position"
    return FitModel(kind, 1 + position, False, 1.0, 1.0, 0.0, table)


_STEP = 1e-7  # of a coordinate: near the root of the precision, where truncation and rounding are alike
_ENOUGH = 1e-4  # of chi²: a step of 1 % of sigma, after which the remaining error is far smaller
_AT_BOUND = 1e-6  # of a coordinate: a fit that ends this close was stopped by the bound


@dataclass(frozen=True, eq=False)
class MeasuredRows(RowArrays):
    """Values (rows, lines), their standard deviations E|e|² = sigma² (NaN: not known), and which are used."""

    value: Complex
    sigma: Floats
    use: NDArray[np.bool_]

    def repeated(self, times: int) -> MeasuredRows:
        return self[np.tile(np.arange(len(self)), times)]


class Solution(NamedTuple):
    """Values (rows, parameters), the model's response (rows, lines) and slopes (rows, lines, free) there or a hundredth
    of sigma beside, and whether each row converged."""

    values: Floats
    response: Complex
    slope: Complex
    settled: NDArray[np.bool_]


class Problem:
    """A model at some lines with some of its parameters free.

    Parameters
    ----------
    model, grid
        The model, and where it is evaluated.
    fixed
        Values at which parameters are fixed.
    free
        Names of parameters that are fitted although the model fixes them by default.

    Attributes
    ----------
    native
        The model as the kernel fits it; None where NumPy does.
    """

    def __init__(
        self,
        model: PhysicalModel,
        grid: EvaluationGrid,
        fixed: Mapping[str, float] | None = None,
        free: Sequence[str] = (),
    ) -> None:
        fixed = dict(fixed or {})
        for name in (*fixed, *free):
            if name not in model.names:
                raise UsageError(
                    "unknown-name",
                    f"the model {model.name!r} has no parameter {name!r}",
                    nearest_name(name, model.names, f"Parameters of {model.name!r}"),
                    argument="fixed" if name in fixed else "free",
                    value=name,
                    allowed=list(model.names),
                )
        self.model, self.grid = model, grid
        self.held = {p.name: p.held for p in model.parameters if p.held is not None and p.name not in free} | fixed
        self.free = np.array([name not in self.held for name in model.names])
        if not self.free.any():
            raise UsageError(
                "conflict",
                f"every parameter of {model.name!r} is fixed",
                "free at least one",
                argument="fixed",
                model=model.name,
            )
        chosen = [p for p, free_ in zip(model.parameters, self.free) if free_]
        for p in model.parameters:
            if (value := fixed.get(p.name)) not in (None, p.held) and not p.low <= value <= p.high:
                raise UsageError(
                    "out-of-range",
                    f"{p.name} = {value:g} is not between {p.low:g} and {p.high:g} {p.unit}",
                    "hold it at a value within these bounds",
                    argument="fixed",
                    parameter=p.name,
                    value=value,
                    low=p.low,
                    high=p.high,
                )
        self._log = np.array([p.logarithmic for p in chosen])
        self._scale = np.array([1.0 if p.logarithmic else p.scale for p in chosen])
        self._unsized = np.array([p.unsized for p in chosen])
        self._ends = tuple(np.array([getattr(p, end) for p in chosen]) for end in ("low", "high"))
        self.native = native_model(model, grid, self.held)

    def variant(
        self,
        model: PhysicalModel | None = None,
        free: Sequence[str] = (),
        held: Mapping[str, float] | None = None,
    ) -> Problem:
        """This problem with another model, some parameters freed, and some held."""
        model = model or self.model
        remaining = {name: value for name, value in self.held.items() if name not in free} | dict(held or {})
        return Problem(model, self.grid, remaining, [name for name in model.names if name not in remaining])

    @property
    def identity(self) -> tuple[object, ...]:
        """Equal for problems with the same model, grid and free parameters."""
        frequency_hz, *settings = self.grid
        held = tuple(sorted(self.held.items()))
        return type(self.model), repr(self.model), held, frequency_hz.tobytes(), *settings

    @property
    def size(self) -> int:
        """Number of free parameters."""
        return int(np.count_nonzero(self.free))

    def with_held(self, values: Floats) -> Floats:
        """Values (..., parameters) with the fixed ones at their values."""
        values = np.array(values, dtype=np.float64)
        for name, value in self.held.items():
            values[..., self.model.names.index(name)] = value
        return values

    def starts(self, measured: MeasuredRows, weight: Floats) -> Floats:
        """The model's first values, (starts, rows, parameters), within the bounds."""
        value = np.where(measured.use, measured.value, 0.0)
        starts = self.model.starts(value, weight, self.grid)
        low, high = (np.array([getattr(p, end) for p in self.model.parameters]) for end in ("low", "high"))
        middle = np.array([p.start for p in self.model.parameters])
        return self.with_held(np.where(np.isfinite(starts), starts, middle).clip(low, high))

    def solve(
        self,
        measured: MeasuredRows,
        weight: Floats,
        start: Floats,
        rounds: int = 30,
        resting: NDArray[np.bool_] | None = None,
    ) -> tuple[Solution, Floats]:
        """Least squares from `start` (rows, parameters), with the weights (rows, lines); and the cost (rows,).

        `resting` (rows, free) are those that keep their start in a row.
        """
        value = np.where(measured.use, measured.value, 0.0)
        weight = np.where(measured.use, weight, 0.0)
        scale = self._scales(start)

        def normal(x: Floats) -> tuple[Floats, Floats, Floats, Complex, Complex]:
            response, slope = self._slopes(x, start, scale, resting)
            # One matrix of slopes followed by the residual: its square contains all that is needed.
            both = np.concatenate([slope, (response - value)[..., np.newaxis]], axis=-1) * weight[..., np.newaxis]
            square = (both.conj().swapaxes(1, 2) @ both).real
            if not np.isfinite(square).all():
                bad = ~np.isfinite(square).all(axis=(1, 2))
                square[bad] = np.eye(square.shape[-1])
                square[bad, -1, -1] = np.inf
            return square[:, -1, -1], square[:, :-1, -1], square[:, :-1, :-1], response, slope

        with np.errstate(all="ignore"):
            low, high = self._bounds(scale)
            begun = self._inward(start, scale)
            if resting is not None:
                low, high = np.where(resting, begun, low), np.where(resting, begun, high)
            minimum: Minimum = minimise(normal, begun, rounds, 1e-10, enough=_ENOUGH, low=low, high=high)
        values = self._outward(minimum.parameters, start, scale)
        response, slope = minimum.known
        if self._unsized.any():
            slope = slope * (self._scale / scale)[:, np.newaxis]
        return Solution(values, response, slope, minimum.settled), minimum.cost

    def at_bound(self, values: Floats) -> NDArray[np.bool_]:
        """Rows with a free parameter at one of its bounds, except at a zero that it cannot pass."""
        x = self._inward(values, self._scale)
        low, high = self._bounds(self._scale)
        return np.asarray((((x - low < _AT_BOUND) & ~self._unsized) | (high - x < _AT_BOUND)).any(axis=1))

    def outward_slopes(self, values: Floats) -> Floats:
        """Derivatives of the free parameters by their coordinates, (rows, free)."""
        return np.where(self._log, values[:, self.free], self._scale)

    def relative(self) -> NDArray[np.bool_]:
        """Which free parameters move as logarithms."""
        return self._log

    def _scales(self, start: Floats) -> Floats:
        """Size of a step of each free parameter, (free,), or (rows, free) where one may be zero: its own value gives
        no scale then, so the smallest value that the lines show is used."""
        if not self._unsized.any():
            return self._scale
        shown = self.model.shown(start, self.grid)[:, self.free]
        return np.where(self._unsized & (shown > 0) & np.isfinite(shown), shown, self._scale)

    def _bounds(self, scale: Floats) -> tuple[Floats, Floats]:
        with np.errstate(invalid="ignore", divide="ignore"):
            low, high = (np.where(self._log, np.log(x), x / scale) for x in self._ends)
        return low, high

    def _inward(self, values: Floats, scale: Floats) -> Floats:
        free = values[..., self.free]
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(self._log, np.log(np.abs(free)), free / scale)

    def _outward(self, x: Floats, start: Floats, scale: Floats) -> Floats:
        values = np.array(start)
        with np.errstate(over="ignore"):
            values[..., self.free] = np.where(self._log, np.exp(x), x * scale)
        return values

    def _slopes(
        self, x: Floats, start: Floats, scale: Floats, resting: NDArray[np.bool_] | None = None
    ) -> tuple[Complex, Complex]:
        """Response (rows, lines) and its derivatives by the coordinates (rows, lines, free), by forward differences.

        Those by coordinates that are at rest are zero.
        """
        rows, n = x.shape
        moving = np.ones((n, rows), dtype=bool) if resting is None else ~resting.T
        column, row = np.nonzero(moving)
        moved = x[np.concatenate([np.arange(rows), row])]
        moved[np.arange(rows, len(moved)), column] += _STEP
        of = np.concatenate([np.arange(rows), row])
        steps = scale if scale.ndim == 1 else scale[of]
        every = self.model.at(self._outward(moved, start[of], steps), self.grid)
        slope = np.zeros((n, rows, every.shape[-1]), dtype=np.complex128)
        slope[column, row] = (every[rows:] - every[row]) / _STEP
        return every[:rows], np.moveaxis(slope, 0, -1)
