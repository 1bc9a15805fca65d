"""Parameters: the values of a model that was fitted to Responses, with their covariance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core._wording import counted
from livebode.core.distributions import COVERAGE, normal_quantile
from livebode.core.errors import UsageError
from livebode.core.rows import RowArrays
from livebode.dataclass import dataclass

OK = "ok"
"""The status of a valid row; any other status is the reason why the row contains NaN."""

_STEP = 1e-6  # of a value, to both sides: the cube root of the precision is about 6e-6


def half_width(sigma: Floats, probability: float) -> Floats:
    """Half-width of the interval that covers a normal value with this probability: 1.96 sigma for 0.95."""
    if not 0 < probability < 1:
        raise UsageError(
            "out-of-range",
            f"{probability=} is not between 0 and 1",
            "specify one such as 0.95",
            argument="probability",
            value=probability,
        )
    return np.asarray(sigma * normal_quantile(0.5 + probability / 2))


@dataclass(frozen=True, eq=False)
class Parameters(RowArrays):
    """Parameters of one model in a row, one for each Response that it was fitted to. Immutable.

    Attributes
    ----------
    model
        Name of the model.
    names, units
        Of the parameters, in the order of the columns.
    value
        Shape (rows, parameters); NaN where `status` is not "ok".
    covariance
        Shape (rows, parameters, parameters), of noise and, by `epsilon`, of the model error; a fixed parameter has
        zeros.
    status
        Shape (rows,): "ok", or the reason why there are no numbers, in a few stable words.
    epsilon
        Shape (rows,): model error that the covariance includes, |error of the model| = ε·|G| at a line.
    chi2, dof
        Shape (rows,): weighted sum of squared residuals by sigma alone, and its expected value for a true model.
    sample, time_s, schedule
        Those of the Response: its newest sample, its effective time, the scheduling signal at that time.

    Examples
    --------
    >>> import livebode
    >>> fitter = livebode.Fitter("two-mass")
    >>> parameters = fitter.process(livebode.example_responses()[-3:])
    >>> parameters.names, parameters["Js"].round(4)
    (('Js', 'JL', 'Keff', 'bs', 'B', 'BL', 'delay'), array([0.0028, 0.0028, 0.0028]))
    >>> bool((parameters.bound(0.95)[:, 0] < 0.0001).all())
    True
    """

    model: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    value: Floats
    covariance: Floats
    status: NDArray[np.str_]
    epsilon: Floats
    chi2: Floats
    dof: Floats
    sample: NDArray[np.int64]
    time_s: Floats
    schedule: Floats

    _SHARED = ("model", "names", "units")

    def __repr__(self) -> str:
        valid = f"{np.count_nonzero(self.ok)} of {counted(len(self), 'row')} valid"
        return f"<Parameters: {self.model}, {', '.join(self.names)}; {valid}>"

    @overload
    def __getitem__(self, rows: str) -> Floats: ...
    @overload
    def __getitem__(self, rows: slice | NDArray[Any]) -> Parameters: ...
    def __getitem__(self, rows: str | slice | NDArray[Any]) -> Floats | Parameters:
        """The values of one parameter by its name, shape (rows,); or some of the rows."""
        if isinstance(rows, str):
            return np.asarray(self.value[:, self.index(rows)])
        return super().__getitem__(rows)

    def index(self, name: str) -> int:
        """Column of a parameter; UsageError with the known names where it is not there."""
        if name not in self.names:
            raise UsageError(
                "unknown-name",
                f"the model {self.model!r} has no parameter {name!r}",
                f"choose one of {', '.join(self.names)}",
                value=name,
                allowed=list(self.names),
            )
        return self.names.index(name)

    def only(self, names: Sequence[str]) -> Parameters:
        """Some of the parameters, in this order; UsageError where one is not there."""
        columns = [self.index(name) for name in names]
        units = tuple(self.units[i] for i in columns)
        covariance = self.covariance[:, columns][:, :, columns]
        return replace(self, names=tuple(names), units=units, value=self.value[:, columns], covariance=covariance)

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Which rows are valid, shape (rows,)."""
        return np.asarray(self.status == OK)

    @property
    def sigma(self) -> Floats:
        """Standard deviation of each parameter, shape (rows, parameters)."""
        with np.errstate(invalid="ignore"):
            return np.asarray(np.sqrt(np.einsum("rii->ri", self.covariance)))

    def bound(self, probability: float = COVERAGE) -> Floats:
        """Half-width of the interval that covers the true value with this probability, shape (rows, parameters).

        For a normal error: 1.96 sigma for 95 %. It covers noise and the model error of `epsilon`; a model error that
        is the same in every response remains as a bias (docs/explanation/fits.md).

        Raises
        ------
        UsageError
            If the probability is not between 0 and 1.
        """
        return half_width(self.sigma, probability)

    def derived(self, names: Sequence[str], units: Sequence[str], of: Callable[[Floats], Floats]) -> Parameters:
        """Quantities derived from these, with their covariance by linear propagation.

        `of` takes values (…, parameters) to derived ones (…, names). Slopes are central differences.
        """
        n, shape = self.value.shape[1], (len(self), len(names))
        value, covariance = np.full(shape, np.nan), np.full((*shape, len(names)), np.nan)
        if (ok := self.ok).any():
            values, sigma = self.value[ok], self.sigma[ok]
            moving = np.flatnonzero((sigma > 0).any(axis=0))  # a fixed parameter contributes nothing
            # For a parameter near zero, sigma gives the scale of a small step; one fixed at zero in this row has none.
            scale = np.maximum(np.abs(values), sigma)[:, moving]
            size = _STEP * np.where(scale > 0, scale, 1.0)
            steps = size[..., np.newaxis] * np.eye(n)[moving]
            middle = values[:, np.newaxis]
            # All in one call: for few rows the number of calls determines the time.
            every = of(np.concatenate([middle, middle + steps, middle - steps], axis=1))
            above, below = np.split(every[:, 1:], 2, axis=1)
            slope = (above - below) / (2 * size[..., np.newaxis])
            value[ok] = every[:, 0]
            covariance[ok] = slope.swapaxes(1, 2) @ self.covariance[ok][:, moving[:, np.newaxis], moving] @ slope
        return replace(self, names=tuple(names), units=tuple(units), value=value, covariance=covariance)

    @classmethod
    def _not_alike(cls, parts: Sequence[Parameters]) -> UsageError:
        return UsageError(
            "conflict",
            "parameters of different models cannot be joined",
            "fit one model",
            models=sorted({part.model for part in parts}),
        )
