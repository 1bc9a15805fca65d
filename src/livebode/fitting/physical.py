"""PhysicalModel: a machine as a transfer function of parameters with units and bounds."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from math import inf, isfinite
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import Lines, UsageError
from livebode.dataclass import dataclass
from livebode.fitting.transfer import Transfer, roots


def times(first: list[Any], second: list[Any]) -> list[Any]:
    """Product of two polynomials.

    >>> times([1.0, 2.0], [1.0, 3.0])
    [1.0, 5.0, 6.0]
    """
    product: list[Any] = [0.0] * (len(first) + len(second) - 1)
    for i, a in enumerate(first):
        for j, b in enumerate(second):
            product[i + j] = product[i + j] + a * b
    return product


def plus(first: list[Any], second: list[Any]) -> list[Any]:
    """Sum of two polynomials.

    >>> plus([1.0, 0.0, 2.0], [5.0, 1.0])
    [1.0, 5.0, 3.0]
    """
    short, long = sorted((first, second), key=len)
    offset = len(long) - len(short)
    return [x + (short[i - offset] if i >= offset else 0.0) for i, x in enumerate(long)]


Hold = Literal["zero-order", "none"]

DELAY = "delay"


class EvaluationGrid(NamedTuple):
    """Where a model is evaluated: lines, the loop's rate, and the hold of the input."""

    frequency_hz: Floats
    rate_hz: float
    hold: Hold = "zero-order"

    @classmethod
    def of(cls, lines: Lines, hold: Hold = "zero-order") -> EvaluationGrid:
        return cls(lines.frequency_hz, lines.rate_hz, hold)


@dataclass(frozen=True)
class Parameter:
    """One parameter of a model.

    Parameters
    ----------
    name, unit
        As in tables and files.
    start
        Start value of the search, if the model gives no better one.
    low, high
        Bounds. A positive `low` makes the fit move the logarithm. A fit that ends at a bound has failed, except at a
        `low` of zero: a quantity that cannot be negative may be zero, and the fit then gives its upper limit.
    held
        Value at which it is fixed by default; None for a fitted parameter.

    Examples
    --------
    >>> damping = Parameter("d", "N m s/rad", start=0.1, low=0.0, high=10.0)
    >>> damping.held is None
    True
    """

    name: str
    unit: str
    start: float
    low: float
    high: float
    held: float | None = None

    def __post_init__(self) -> None:
        if not (self.low <= self.start <= self.high and self.low < self.high and isfinite(self.start)):
            raise UsageError(
                "out-of-range",
                f"parameter {self.name!r}: start={self.start:g} is not between {self.low:g} and {self.high:g}",
                "give a finite start within the bounds",
                argument="start",
                parameter=self.name,
                value=self.start,
                low=self.low,
                high=self.high,
            )

    @property
    def logarithmic(self) -> bool:
        return self.low > 0

    @property
    def one_sided(self) -> bool:
        """Whether it may be zero, but not negative."""
        return self.low == 0

    @property
    def unsized(self) -> bool:
        """Whether neither its bounds nor its start give the size of a step; `PhysicalModel.shown` gives it then."""
        return self.one_sided or self.low == -inf

    @property
    def scale(self) -> float:
        """Size of a step of a parameter that is not logarithmic."""
        finite = [abs(x) for x in (self.low, self.high) if isfinite(x) and x]
        return abs(self.start) or min(finite, default=1.0)


class PhysicalModel:
    """Base of all models: a subclass defines its name, its parameters and its transfer function.

    The transfer function is written with NumPy arithmetic on its arguments, one for each parameter in order, which may
    be numbers or arrays: fits evaluate it for many values at once. It gives the coefficients of numerator and
    denominator from the highest power of s on. A parameter named "delay" (s) is a delay behind it, and not an argument.

    A model in state space gives `from_state_space(a, b, c)`, one by its poles and zeros `from_zeros_poles(...)`.

    Attributes
    ----------
    name
        In tables, files and `livebode fit --model`.
    parameters
        Parameters of the model.

    Examples
    --------
    >>> class Oscillator(PhysicalModel):
    ...     name = "oscillator"
    ...     parameters = (
    ...         Parameter("m", "kg", start=1.0, low=1e-3, high=1e3),
    ...         Parameter("c", "N s/m", start=10.0, low=1e-3, high=1e4),
    ...         Parameter("k", "N/m", start=1e4, low=1.0, high=1e8),
    ...     )
    ...
    ...     def transfer(self, m, c, k):
    ...         return [1.0], [m, c, k]
    >>> grid = EvaluationGrid(np.array([1.0, 16.0]), rate_hz=1000.0)
    >>> abs(Oscillator().at([1.0, 10.0, 1e4], grid)).round(6)
    array([0.0001  , 0.000989])
    >>> Oscillator().derived_names
    ('resonance', 'resonance_damping', 'resonance_q')
    """

    name: ClassVar[str]
    parameters: tuple[Parameter, ...]

    frictions: ClassVar[tuple[str, ...]] = ()
    """Parameters that are viscous frictions, which a fit tries where the model is incomplete."""

    def transfer(self, *parameters: Any) -> tuple[Sequence[ArrayLike], Sequence[ArrayLike]]:
        """Coefficients of numerator and denominator, each a number or an array like the arguments."""
        raise NotImplementedError(f"{type(self).__name__} has no transfer function; define transfer()")

    def starts(self, value: Complex, weight: Floats, grid: EvaluationGrid) -> Floats:  # noqa: ARG002  for those who look
        """First values to try for responses (rows, lines), shape (starts, rows, parameters).

        By default: the declared ones, and each of them a third and three times as large.
        """
        middle = np.array([p.start for p in self.parameters])
        tried = [middle]
        for i, parameter in enumerate(self.parameters):
            if parameter.logarithmic and parameter.held is None:
                for factor in (1 / 3, 3.0):
                    other = middle.copy()
                    other[i] = np.clip(other[i] * factor, parameter.low, parameter.high)
                    tried.append(other)
        return np.repeat(np.array(tried)[:, np.newaxis], len(value), axis=1)

    def shown(self, values: Floats, grid: EvaluationGrid) -> Floats:  # noqa: ARG002  for those who look
        """These values (..., parameters), with frictions that may be zero at the smallest visible value."""
        return values

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    @cached_property
    def units(self) -> tuple[str, ...]:
        return tuple(p.unit for p in self.parameters)

    def at(self, values: ArrayLike, grid: EvaluationGrid) -> Complex:
        """Response at the lines, behind the hold and the delay, for values (..., parameters): shape (..., lines)."""
        p = np.asarray(values, dtype=np.float64)
        transfer, delay_s = self._transfer(p), self._delay_s(p)
        s = np.asarray(2j * np.pi * grid.frequency_hz, dtype=np.complex128)
        if grid.hold == "zero-order":
            return transfer.sampled(np.exp(s / grid.rate_hz), grid.rate_hz, delay_s)
        late = np.exp(-s * np.asarray(delay_s)[..., np.newaxis])
        return np.asarray(transfer.response(s) * late)

    def continuous(self, values: ArrayLike) -> Transfer:
        """The transfer function in s, without the delay."""
        return self._transfer(np.asarray(values, dtype=np.float64))

    @property
    def derived_names(self) -> tuple[str, ...]:
        """Names in `derived`: frequency, damping ratio and quality factor of each mode, and of each pair of zeros."""
        return tuple(n + end for n in self._pairs() for end in ("", "_damping", "_q"))

    @property
    def derived_units(self) -> tuple[str, ...]:
        return ("Hz", "", "") * len(self._pairs())

    def derived(self, values: Floats) -> Floats:
        """From values (..., parameters): |p|/2π, −Re p/|p| and its half inverse for each pair, (..., derived_names)."""
        transfer, rows = self._transfer(values), values.shape[:-1]
        parts = [_paired(polynomial) for polynomial in (transfer.denominator, transfer.numerator)]
        # A polynomial without parameters in it has roots for one set of values only.
        product, total = (
            np.concatenate([np.broadcast_to(x, (*rows, x.shape[-1])) for x in both], axis=-1) for both in zip(*parts)
        )
        quantities = np.empty((*product.shape, 3))
        with np.errstate(divide="ignore", invalid="ignore"):
            size = np.sqrt(np.abs(product))
            damping = -total / (2 * size)
            quantities[..., 0], quantities[..., 1], quantities[..., 2] = size / (2 * np.pi), damping, 1 / (2 * damping)
        return quantities.reshape(*rows, -1)

    def _pairs(self) -> list[str]:
        transfer = self._transfer(np.array([p.start for p in self.parameters]))
        counts = (transfer.denominator.shape[-1] - 1) // 2, (transfer.numerator.shape[-1] - 1) // 2
        return [
            name if count == 1 else f"{name}_{i + 1}"
            for name, count in zip(("resonance", "antiresonance"), counts)
            for i in range(count)
        ]

    def _transfer(self, p: Floats) -> Transfer:
        late = self._late
        arguments = [p[..., i] for i in range(len(self.names)) if i != late]
        return Transfer.of(*self.transfer(*arguments))

    def _delay_s(self, p: Floats) -> Floats | float:
        return 0.0 if self._late is None else np.asarray(p[..., self._late])

    @cached_property
    def _late(self) -> int | None:
        """Position of the delay among the parameters."""
        return self.names.index(DELAY) if DELAY in self.names else None


def delay(held: float | None = 0.0) -> Parameter:
    """A delay, fixed at zero by default; negative where the input was logged later than it acted."""
    return Parameter(DELAY, "s", start=0.0, low=-0.02, high=0.02, held=held)


def free_friction(name: str, unit: str) -> Parameter:
    """A viscous friction, fixed at zero by default."""
    return Parameter(name, unit, start=1e-3, low=0.0, high=1e12, held=0.0)


def _paired(polynomial: Floats) -> tuple[Floats, Floats]:
    """Product and sum of the roots of each pair of neighbours by size, shape (..., pairs).

    The smallest real root, if left over, is not a mode.
    """
    if polynomial.shape[-1] == 3:
        return polynomial[..., 2:] / polynomial[..., :1], -polynomial[..., 1:2] / polynomial[..., :1]
    ordered = roots(polynomial)
    left = ordered.shape[-1] % 2
    first, second = ordered[..., left::2], ordered[..., left + 1 :: 2]
    return np.abs(first * second), (first + second).real
