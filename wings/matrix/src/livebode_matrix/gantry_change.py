"""Which part of a gantry changed between two matrices, and by how much: the left belt, the right belt, beam, cart …"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from livebode.arrays import Floats
from livebode.core import MatrixResponses, needing, normal_quantile
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.simulation import Gantry
from livebode_matrix.change import ALPHA, MatrixChange, compare_matrices
from livebode_matrix.gantry_fit import INERTIA, MASS, MOMENT, PARAMETERS, GantryFit, fit_gantry
from livebode_matrix.line_correlation import RowSteps

CART_PLACE = Message("cart's place")
_CAUSES_MAX = 3


@dataclass(frozen=True)
class Cause:
    """A quantity of the machine that changed.

    Attributes
    ----------
    part
        As "left belt's stiffness".
    amount, bound
        After minus before and the half-width of its 95 % interval, in `unit`.
    before
        Its value before, for shares.
    explained
        By how much this change lowers chi².
    """

    part: str
    amount: float
    bound: float
    before: float
    unit: str
    explained: float

    @property
    def sentence(self) -> Message:
        """The cause in words."""
        if self.part == CART_PLACE:
            return Message(
                "the cart is {distance:.3g} ± {bound:.2g} m from its specified place",
                distance=abs(self.amount),
                bound=self.bound,
            )
        scale, unit = (100 / self.before, "%") if self.before > 0 else (1.0, self.unit)
        return Message(
            "{part} is {size:.3g} ± {bound:.2g} {unit} {way} than in the baseline",
            part=self.part,
            size=scale * abs(self.amount),
            bound=scale * self.bound,
            unit=unit,
            way=Message("less") if self.amount < 0 else Message("more"),
        )


@dataclass(frozen=True)
class GantryChange:
    """What changed between two matrices of a gantry; see `compare_gantries`.

    Attributes
    ----------
    entries
        The comparison of the entries; None where the cart is at another place: they differ then in any machine.
    probability
        That chance alone gives as large a difference of the parameters.
    alpha
        Rate of false alarms of a comparison.
    causes
        The change that explains most, then those that the rest shows; none where nothing changed.
    fits
        Before and after.
    """

    entries: MatrixChange | None
    probability: float
    alpha: float
    causes: tuple[Cause, ...]
    fits: tuple[GantryFit, GantryFit]

    @property
    def moved(self) -> bool:
        """Whether the cart is at another place than specified: the machine was not compared like with like."""
        return any(cause.part == CART_PLACE for cause in self.causes)

    @property
    def changed(self) -> bool:
        """Whether a part of the machine changed, other than the place of the cart."""
        return any(cause.part != CART_PLACE for cause in self.causes) or (self.unexplained and not self.causes)

    @property
    def unexplained(self) -> bool:
        """Whether entries changed by more than chance, but no parameter did."""
        return self.entries is not None and self.entries.changed and not self.causes

    @property
    def sentences(self) -> list[str]:
        """The result as text."""
        changes: list[str] = [cause.sentence for cause in self.causes]
        if self.moved and len(changes) == 1:
            return [Message("{change}: compare at the same place, or specify the place of the cart", change=changes[0])]
        if self.entries is not None and self.entries.changed:
            changes.append(self.entries.sentence)
        percent = 100 * self.alpha
        return changes or [Message("no parameter of the gantry changed (false alarms {percent:g} %)", percent=percent)]


def compare_gantries(
    before: MatrixResponses,
    after: MatrixResponses,
    description: Gantry,
    *,
    cart_m: tuple[float, float] | None = None,
    alpha: float = ALPHA,
    steps: RowSteps | None = None,
) -> GantryChange:
    """Which part of a gantry changed: its parameters are fitted to both matrices and their difference is explained.

    A change of the machine is reported where the entries differ (`compare_matrices`) or, with the cart at another
    place, where the parameters differ by more than that explains (F of 11 parameters and the noise of both). The cause
    is the single change, of a belt, the beam, the cart, the motors or the guides, that explains most of the difference
    by generalised least squares; further ones are added while the rest differs by more than chance.

    Delay: none. Bias: to first order in the change none; a model error that both fits share cancels, but counts in the
    bounds, which are then conservative.

    Parameters
    ----------
    before, after
        As of `fit_gantry`.
    description
        The gantry as it is known. Mass and place of the cart are taken from it: the matrix shows only sums with those
        of the beam.
    cart_m
        Places of the cart before and after, if they differ; by default both are that of the description.
    alpha
        Rate of false alarms of a comparison.
    steps
        As in `compare_matrices`.

    Raises
    ------
    UsageError, GridError, FitError
        As `fit_gantry` and `compare_matrices`.

    Examples
    --------
    >>> from livebode_matrix import example_matrix_responses
    >>> responses = example_matrix_responses()
    >>> compare_gantries(responses, responses, Gantry()).sentences
    ['no parameter of the gantry changed (false alarms 1 %)']
    """
    places = cart_m or (description.cart_m, description.cart_m)
    same = places[0] == places[1]
    entries = compare_matrices(before, after, alpha, steps=steps) if same else None
    first = fit_gantry(before, description)
    second = fit_gantry(after, description)
    kilograms = description.cart_kg
    difference = second.value - first.value
    difference[MOMENT] -= kilograms * (places[1] - places[0])
    difference[INERTIA] -= kilograms * (places[1] ** 2 - places[0] ** 2)
    covariance = first.independent + second.independent
    noise_dof = 2 * (first.noise_dof + second.noise_dof)
    probability = _tail(_square(difference, covariance), len(difference), noise_dof)
    judged = entries.changed if entries is not None else probability < alpha
    known = _Known(first, covariance, first.covariance + second.covariance, kilograms, places[1], noise_dof)
    causes = _causes(difference, known, alpha) if judged else []
    return GantryChange(entries, probability, alpha, tuple(causes), (first, second))


class _Known(NamedTuple):
    """The fit before, mass and place of the cart, degrees of freedom, and the covariance of the difference.

    That of independent lines chooses and tests; the other one, which has more scatter, gives the bounds.
    """

    before: GantryFit
    independent: Floats
    covariance: Floats
    cart_kg: float
    cart_m: float
    noise_dof: float


def _causes(difference: Floats, known: _Known, alpha: float) -> list[Cause]:
    """The changes that explain the difference, the largest first."""
    causes: list[Cause] = []
    left, names = difference, list(dict(_directions(known)))
    while len(causes) < _CAUSES_MAX:
        tried = [_explained(name, left, known) for name in names]
        best, remainder = max(tried, key=lambda attempt: attempt[0].explained)
        # The best of many candidates is the largest of as many random values.
        if _tail(best.explained, 1, known.noise_dof) > alpha / len(tried):
            break
        causes.append(best)
        left = remainder
        names.remove(best.part)
    return causes


def _explained(name: str, difference: Floats, known: _Known) -> tuple[Cause, Floats]:
    """This change alone by generalised least squares, and what it leaves of the difference."""
    amount = 0.0
    # The direction of a place depends on how far the cart moved.
    for _ in range(3 if name == CART_PLACE else 1):
        direction = dict(_directions(known, amount))[name]
        pair = _scaled(np.stack([direction, difference], axis=1), known.independent)
        solved = np.linalg.solve(_unit(known.independent), pair)
        both = pair.T @ solved
        amount = float(both[0, 1] / both[0, 0])
    by = _scaled(np.asarray(solved[:, 0]), known.independent) / both[0, 0]  # of the difference on the amount
    bound = normal_quantile(0.975) * float(np.sqrt(by @ known.covariance @ by))
    size, unit = _before(name, known)
    cause = Cause(name, amount, bound, size, unit, float(both[0, 1] ** 2 / both[0, 0]))
    return cause, difference - amount * direction


def _directions(known: _Known, amount: float = 0.0) -> Iterator[tuple[str, Floats]]:
    """Change of `PARAMETERS` by a unit of each quantity; of the place, at the middle of a change by this amount."""
    kilograms, place = known.cart_kg, known.cart_m
    for i, (name, _) in enumerate(PARAMETERS):
        if i not in (MASS, MOMENT, INERTIA):
            yield name, _vector({i: 1.0})
    yield Message("beam's mass"), _vector({MASS: 1.0})
    yield Message("beam's inertia"), _vector({INERTIA: 1.0})
    yield Message("cart's mass"), _vector({MASS: 1.0, MOMENT: place, INERTIA: place**2})
    yield CART_PLACE, _vector({MOMENT: kilograms, INERTIA: kilograms * (2 * place + amount)})


def _before(name: str, known: _Known) -> tuple[float, str]:
    """Value before and unit of a quantity; those of beam and cart apart from each other by the description."""
    value, kilograms, place = known.before.value, known.cart_kg, known.cart_m
    apart = {
        "beam's mass": (float(value[MASS]) - kilograms, "kg"),
        "beam's inertia": (float(value[INERTIA]) - kilograms * place**2, "kg m²"),
        "cart's mass": (kilograms, "kg"),
        CART_PLACE: (place, "m"),
    }
    return apart[name] if name in apart else (known.before[name], dict(PARAMETERS)[name])


def _vector(parts: dict[int, float]) -> Floats:
    vector = np.zeros(len(PARAMETERS))
    for i, value in parts.items():
        vector[i] = value
    return vector


def _scaled(values: Floats, covariance: Floats) -> Floats:
    """In units of sigma, along the first axis."""
    return np.asarray((values.T / np.sqrt(np.diag(covariance))).T)


def _unit(covariance: Floats) -> Floats:
    return _scaled(_scaled(covariance, covariance).T, covariance)


def _square(difference: Floats, covariance: Floats) -> float:
    scaled = _scaled(difference, covariance)
    return float(scaled @ np.linalg.solve(_unit(covariance), scaled))


def _tail(square: float, parameters: int, noise_dof: float) -> float:
    """Probability of a larger value by chance, of the distribution F: the covariance is that of estimated noise."""
    with needing("SciPy", "analysis", "a comparison of matrices"):
        from scipy.special import fdtrc

    return float(fdtrc(parameters, noise_dof, square / parameters))
