"""Physical parameters of a gantry, fitted to the matrix from its two torques to the speeds of its motors."""

from __future__ import annotations

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import COVERAGE, MatrixResponses, UsageError, needing, normal_quantile
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.simulation import Gantry
from livebode_matrix.least_squares import minimise
from livebode_matrix.whitening import WeightedMatrix

PARAMETERS = (
    (Message("motor inertia"), "kg m²"),
    (Message("motor friction"), "N m s"),
    (Message("left belt's stiffness"), "N/m"),
    (Message("left belt's damping"), "N s/m"),
    (Message("right belt's stiffness"), "N/m"),
    (Message("right belt's damping"), "N s/m"),
    ("mass of beam and cart", "kg"),
    ("moment of the cart", "kg m"),
    ("yaw inertia", "kg m²"),
    (Message("yaw stiffness"), "N m"),
    (Message("yaw damping"), "N m s"),
)
"""What the two torques and the two speeds determine, and units. The moment of the cart is its mass times its place, the
yaw inertia that of the beam plus mass times square of the place."""

MASS, MOMENT, INERTIA = 6, 7, 8
_STEP = 1e-6


@dataclass(frozen=True, eq=False)
class GantryFit:
    """Parameters of a gantry with their covariance; see `fit_gantry`.

    Attributes
    ----------
    description
        The gantry as described: radius and half width are taken from it.
    value, covariance
        Of `PARAMETERS`, shapes (11,) and (11, 11).
    independent
        The covariance with lines that are independent: it has less scatter, for tests of all parameters at once.
    epsilon
        Model error as a share of each entry, 0 where noise explains the residuals.
    chi2, dof
        Sum of squares by noise alone, and its expectation for a true model.
    noise_dof
        Complex degrees of freedom of the noise.
    settled
        Whether the fit converged.
    """

    description: Gantry
    value: Floats
    covariance: Floats
    independent: Floats
    epsilon: float
    chi2: float
    dof: float
    noise_dof: float
    settled: bool

    def __getitem__(self, name: str) -> float:
        return float(self.value[_at(name)])

    def bound(self, name: str, probability: float = COVERAGE) -> float:
        """Half-width of its interval."""
        return float(self.bounds(probability)[_at(name)])

    def bounds(self, probability: float = COVERAGE) -> Floats:
        """Half-widths of all, shape (11,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)) * normal_quantile(0.5 + probability / 2))

    def rows(self, probability: float = COVERAGE) -> list[tuple[str, float, float, str]]:
        """Name, value, half-width and unit of all parameters."""
        bounds = self.bounds(probability)
        return [(name, float(v), float(b), unit) for (name, unit), v, b in zip(PARAMETERS, self.value, bounds)]


def fit_gantry(
    responses: MatrixResponses, description: Gantry, *, band_hz: tuple[float, float] | None = None
) -> GantryFit:
    """Fit the masses, belts and guides of a gantry to the matrix from the torques (N m) to the speeds (rad/s).

    The model is that of `Gantry` behind its zero-order hold. Weights and covariance are those of `fit_matrix`. Delay:
    none; bias: none to first order where the machine is such a gantry.

    Parameters
    ----------
    responses
        All matrices of a recording, with two inputs, the torques of the left and the right motor, and two outputs,
        their speeds; the mean of those that share no window is fitted.
    description
        The gantry as far as it is known: the start of the fit, and its radius and half width, which are not fitted.
    band_hz
        Lowest and highest frequency of the lines used.

    Raises
    ------
    UsageError
        If there are not two inputs and two outputs.
    FitError
        If the noise has too few degrees of freedom, or no line is valid.

    Examples
    --------
    >>> from livebode.excitation import MatrixExcitation
    >>> from livebode_matrix import example_matrix_responses
    >>> fit = fit_gantry(example_matrix_responses(), Gantry())
    >>> abs(fit["left belt's stiffness"] - 4e5) < 2 * fit.bound("left belt's stiffness")
    True
    """
    if (len(responses.outputs), len(responses.inputs)) != (2, 2):
        raise UsageError(
            "wrong-shape",
            f"the matrix has {len(responses.outputs)} outputs and {len(responses.inputs)} inputs, but a gantry has the "
            "torques and the speeds of two motors",
            "track two inputs and two outputs, the left motor first",
            argument="responses",
        )
    weighted = WeightedMatrix.of(responses, band_hz)
    start = parameters_of(description)
    size = np.where(start == 0, start[MASS] * description.half_width_m, start)
    model = _Model(description, weighted.frequency_hz, responses.lines.rate_hz, size)
    solution = minimise(weighted, model.response, model.slopes, start / size)
    return GantryFit(
        description, solution.values * size, solution.covariance * np.outer(size, size),
        solution.independent * np.outer(size, size), solution.epsilon, solution.chi2, solution.dof, weighted.dof,
        solution.settled,
    )  # fmt: skip


def parameters_of(gantry: Gantry) -> Floats:
    """Those of `PARAMETERS` that a gantry has, shape (11,).

    >>> dict(zip([name for name, _ in PARAMETERS], parameters_of(Gantry()).tolist()))["yaw stiffness"]
    10000.0
    """
    mass, _, _ = gantry.matrices
    right = (gantry.right_stiffness_n_per_m, gantry.right_damping_n_s_per_m)
    return np.array(
        [
            gantry.motor_inertia_kg_m2,
            gantry.motor_viscous_n_m_s,
            gantry.stiffness_n_per_m,
            gantry.damping_n_s_per_m,
            gantry.stiffness_n_per_m if right[0] is None else right[0],
            gantry.damping_n_s_per_m if right[1] is None else right[1],
            mass[2, 2],
            mass[2, 3],
            mass[3, 3],
            gantry.yaw_stiffness_n_m,
            gantry.yaw_damping_n_m_s,
        ]
    )


class _Model:
    """Response and slopes by the parameters, each in units of its size."""

    def __init__(self, description: Gantry, frequency_hz: Floats, rate_hz: float, size: Floats) -> None:
        self._radius, self._half = description.radius_m, description.half_width_m
        self._z, self._rate_hz, self._size = np.exp(2j * np.pi * frequency_hz / rate_hz), rate_hz, size

    def response(self, x: Floats) -> Complex:
        """Shape (lines, entries)."""
        return np.asarray(self._responses((x * self._size)[np.newaxis])[0])

    def slopes(self, x: Floats) -> Complex:
        """Derivatives by central differences, shape (lines, entries, parameters)."""
        steps = _STEP * np.eye(x.size)
        responses = self._responses(np.concatenate([x + steps, x - steps]) * self._size)
        return np.moveaxis((responses[: x.size] - responses[x.size :]) / (2 * _STEP), 0, -1)

    def _responses(self, values: Floats) -> Complex:
        """Responses for sets of parameters (sets, 11), shape (sets, lines, entries)."""
        with needing("SciPy", "analysis", "a fit of matrices"):
            from scipy.linalg import expm

        a, b = self._state_space(values)
        whole = np.zeros((len(values), 10, 10))
        whole[:, :8, :8], whole[:, :8, 8:] = a, b
        tick = expm(whole / self._rate_hz)
        inner = self._z[:, np.newaxis, np.newaxis] * np.eye(8) - tick[:, np.newaxis, :8, :8]
        states = np.linalg.solve(inner, tick[:, np.newaxis, :8, 8:].astype(np.complex128))
        return np.asarray(states[..., 4:6, :].reshape(len(values), -1, 4))

    def _state_space(self, values: Floats) -> tuple[Floats, Floats]:
        """A (sets, 8, 8) and B (sets, 8, 2), as of `Gantry.state_space`."""
        inertia, friction, k1, c1, k2, c2, kilograms, moment, yaw, k_yaw, c_yaw = values.T
        r, d = self._radius, self._half
        belts = np.array([[r, 0.0, -1.0, -d], [0.0, r, -1.0, d]])
        mass, damping, stiffness = (np.zeros((len(values), 4, 4)) for _ in range(3))
        mass[:, 0, 0] = mass[:, 1, 1] = inertia
        mass[:, 2, 2], mass[:, 3, 3] = kilograms, yaw
        mass[:, 2, 3] = mass[:, 3, 2] = moment
        for matrix, left, right in ((stiffness, k1, k2), (damping, c1, c2)):
            matrix += np.einsum("bi,sb,bj->sij", belts, np.stack([left, right], axis=1), belts)
        stiffness[:, 3, 3] += k_yaw
        damping[:, 3, 3] += c_yaw
        damping[:, 0, 0] += friction
        damping[:, 1, 1] += friction
        a, b = np.zeros((len(values), 8, 8)), np.zeros((len(values), 8, 2))
        a[:, :4, 4:] = np.eye(4)
        a[:, 4:, :4], a[:, 4:, 4:] = -np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)
        b[:, 4:] = np.linalg.inv(mass)[:, :, :2]
        return a, b


def _at(name: str) -> int:
    names = [name for name, _ in PARAMETERS]
    if name not in names:
        raise UsageError(
            "unknown-name", f"a gantry has no parameter {name!r}", f"choose {' or '.join(map(repr, names))}",
            argument="name", value=name, allowed=names,
        )  # fmt: skip
    return names.index(name)
