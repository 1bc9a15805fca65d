"""Model: anything with a frequency response."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.core.errors import UsageError
from livebode.dataclass import dataclass


@runtime_checkable
class Model(Protocol):
    """Anything that has a frequency response: a plant, a controller, a fit, a measured response.

    Examples
    --------
    >>> import livebode
    >>> isinstance(livebode.PID(gain=0.2, rate_hz=4000), Model), isinstance(livebode.example_responses()[-1], Model)
    (True, True)
    """

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """Complex response at each frequency, the shape of `frequency_hz`."""
        ...


class Algebra:
    """Series and parallel connection of Models, so that a controller can be written as its formula.

    Examples
    --------
    >>> (2.0 * Gain(3.0) + Gain(1.0)).response([10.0])
    array([7.+0.j])
    """

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        raise NotImplementedError

    def __mul__(self, other: object) -> CombinedModel:
        return CombinedModel(np.multiply, self, as_model(other))

    def __add__(self, other: object) -> CombinedModel:
        return CombinedModel(np.add, self, as_model(other))

    __rmul__ = __mul__
    __radd__ = __add__


@dataclass(frozen=True)
class CombinedModel(Algebra):
    """Two Models combined at each frequency."""

    operation: Callable[..., Any]
    first: Model
    second: Model

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        return np.asarray(
            self.operation(self.first.response(frequency_hz), self.second.response(frequency_hz)),
            dtype=np.complex128,
        )


@dataclass(frozen=True)
class Gain(Algebra):
    """A response that is equal at every frequency."""

    value: float

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        return np.full(np.shape(frequency_hz), self.value, dtype=np.complex128)


@dataclass(frozen=True)
class _Control(Algebra):
    """A python-control system, evaluated on jω or on the unit circle of its own rate."""

    system: Any

    def response(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
        argument = np.exp(s * self.system.dt) if self.system.dt else s
        return np.asarray(self.system(argument), dtype=np.complex128).reshape(np.shape(s))


def as_model(thing: object) -> Model:
    """A Model from a Model, a number or a single-input single-output python-control system.

    Raises
    ------
    TypeError
        If it is not one of these.
    UsageError
        If it has several inputs or outputs, or is discrete without a rate.
    """
    if isinstance(thing, Model):
        return thing
    if isinstance(thing, (int, float)):
        return Gain(float(thing))
    if not (callable(thing) and hasattr(thing, "dt")):
        raise TypeError(f"{thing!r} has no frequency response; give a Model, a number or a python-control system")
    if getattr(thing, "issiso", lambda: True)() is False:
        raise UsageError(
            "wrong-shape",
            f"the {type(thing).__name__} has several inputs or outputs",
            "give one of its transfer functions",
        )
    if thing.dt is True:
        raise UsageError(
            "missing", "the discrete system has no sample time", "specify it (dt in seconds)", argument="dt"
        )
    return _Control(thing)
