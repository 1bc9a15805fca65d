"""Rational: B(z)/A(z) as a Model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex, Floats
from livebode.core import Parameters, not_installed
from livebode.fitting.hold import to_continuous
from livebode.fitting.transfer import Transfer


@dataclass(frozen=True, eq=False)
class Rational:
    """B(z)/A(z) with coefficients from the highest power on, at a rate; a Model.

    Examples
    --------
    >>> integrator = Rational(np.array([0.01]), np.array([1.0, -1.0]), rate_hz=100.0)
    >>> abs(integrator.response(5.0)).round(4), integrator.continuous().numerator.round(6)
    (np.float64(0.032), array([1.]))
    """

    numerator: Floats
    denominator: Floats
    rate_hz: float

    def response(self, frequency_hz: ArrayLike) -> Complex:
        z = np.exp(2j * np.pi * np.asarray(frequency_hz, dtype=np.float64) / self.rate_hz)
        return np.asarray(np.polyval(self.numerator, z) / np.polyval(self.denominator, z))

    def continuous(self) -> Transfer:
        """The system in s whose zero-order-hold equivalent this is; see `to_continuous`."""
        return to_continuous(self.numerator, self.denominator, self.rate_hz)

    def to_control(self) -> Any:
        """python-control TransferFunction in z (extra `control`)."""
        try:
            import control
        except ImportError:
            raise not_installed("python-control is not installed", package="control", extra="control") from None
        return control.tf(self.numerator, self.denominator, 1 / self.rate_hz)


def rational_of(parameters: Parameters, row: int, rate_hz: float) -> Rational:
    """One row of the result of `fit_rational`, as a Model."""
    m = sum(name.startswith("b") for name in parameters.names)
    value = parameters.value[row]
    return Rational(value[:m][::-1], np.concatenate([[1.0], value[m:][::-1]]), rate_hz)
