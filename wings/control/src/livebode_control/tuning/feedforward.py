"""Feedforward of inertia and friction: the torque of a reference motion, with bounds."""

from __future__ import annotations

from dataclasses import field
from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import Responses, SignalError, t_quantile
from livebode.dataclass import dataclass
from livebode.motion import FrictionCurve

_OF_ANTIRESONANCE = 0.5  # the lines below this share of its frequency show the inertia
_LINES_MIN = 4
_OF_IMAGINARY = np.sqrt(0.5)  # sigma is of a circular error, half of whose power is in the imaginary part
_SHARE = (1e-9, 10.0)  # of the size, by which the model may be wrong


@dataclass(frozen=True)
class Feedforward:
    """Torque of a reference motion: inertia·a + viscous·v + coulomb·sign(v) + offset, in SI units.

    Bounds are half-widths of 95 %. Friction is None where no strokes show it; `curve` is what it is from.
    """

    inertia: float
    inertia_bound: float
    viscous: float | None = None
    viscous_bound: float | None = None
    coulomb: float | None = None
    coulomb_bound: float | None = None
    offset: float | None = None
    offset_bound: float | None = None
    curve: FrictionCurve | None = field(default=None, repr=False)

    @classmethod
    def of(cls, responses: Responses, kind: str, friction: FrictionCurve | None = None) -> Feedforward:
        """From the response at low lines, and from the friction of strokes.

        The inertia of the strokes is not used: it contains the swing of the load, and is less sure.

        Parameters
        ----------
        responses
            Of the plant, a row for each place.
        kind
            "velocity" or "position", of the output.
        friction
            With one Coulomb friction, without places.

        Raises
        ------
        SignalError
            If fewer than four lines are below half the antiresonance.
        """
        inertia, bound = rigid_inertia(responses, kind)
        if friction is None:
            return cls(inertia, bound)
        wide = dict(zip(friction.names, friction.bound()))
        names = ("viscous", "coulomb", "offset")
        values = {name: friction[name] for name in names} | {f"{name}_bound": float(wide[name]) for name in names}
        return cls(inertia, bound, **values, curve=friction)

    def torque(self, velocity: Floats, acceleration: Floats) -> Floats:
        """Torque of the reference at these velocities and accelerations."""
        friction = (self.viscous or 0.0) * velocity + (self.coulomb or 0.0) * np.sign(velocity) + (self.offset or 0.0)
        return np.asarray(self.inertia * acceleration + friction)

    def friction(self, velocity: Floats, sign: int) -> tuple[Floats, Floats]:
        """Viscous and Coulomb friction at velocities of one sign, and its 95 % bound; of a feedforward with a curve."""
        curve = self.curve
        assert curve is not None
        of = [curve.index(name) for name in ("viscous", "coulomb")]
        row = np.stack([velocity, np.full(velocity.shape, float(sign))])
        sigma = np.sqrt(np.einsum("iv,ij,jv->v", row, curve.covariance[np.ix_(of, of)], row))
        factor = t_quantile(0.975, int(curve.dof[of].min()))
        return np.asarray(curve.value[of] @ row), np.asarray(factor * sigma)

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {name: value for name, value in vars(self).items() if name != "curve"}


def rigid_inertia(responses: Responses, kind: str) -> tuple[float, float]:
    """Total inertia M + L and its 95 % bound: Im 1/G = M·ω + L·ω/(1 − (ω/ωₐ)²) − S/ω at the lines up to ωₐ/2.

    M and L are motor and load, ωₐ is the antiresonance of each place, and S the spring of cogging and of friction
    before it slides. Where the residuals are larger than the noise of the lines, the model is wrong by a share of 1/G,
    the same at all lines, that makes them as large as expected (Paule and Mandel, Consensus values and weighting
    factors, J. Research NBS 87, 1982): otherwise the few lines with the least noise would decide. The bound is by
    Student's t.

    Biased by friction that the excitation does not linearise, by 0.1 % in the simulated axis: measure while the axis
    moves in one direction.

    Parameters
    ----------
    responses
        Torque to velocity or position, a row for each place.
    kind
        "velocity" or "position".

    Raises
    ------
    SignalError
        If fewer than four valid lines are below half the antiresonance.
    """
    f = responses.lines.frequency_hz
    omega = 2 * np.pi * f
    value, sigma = responses.value, responses.sigma
    if kind == "position":
        value, sigma = value * 1j * omega, sigma * omega
    known = responses.valid & np.isfinite(sigma)
    dips = [_antiresonance_hz(f, row) for row in np.where(known, np.abs(value) * f, np.nan)]
    rows, goals, noise, sizes = [], [], [], []
    for place, dip in enumerate(dips):
        use = known[place] & (f <= _OF_ANTIRESONANCE * dip)
        rows.append(np.stack([omega[use], omega[use] / (1 - (f[use] / dip) ** 2), 1 / omega[use]], axis=1))
        goals.append((1 / value[place, use]).imag)
        sizes.append(1 / np.abs(value[place, use]))
        noise.append(sigma[place, use] * sizes[-1] ** 2 * _OF_IMAGINARY)
    matrix, goal = np.concatenate(rows), np.concatenate(goals)
    if goal.size < _LINES_MIN * len(dips):
        raise SignalError(
            "too-few-lines",
            f"{goal.size} valid lines are below half the antiresonance, but {_LINES_MIN} at each place are needed to "
            "find the inertia",
            "excite lower lines",
            lines=int(goal.size),
        )
    solution, covariance = _least_squares(matrix, goal, np.concatenate(noise), np.concatenate(sizes))
    total = np.array([1.0, 1.0, 0.0])
    wide = t_quantile(0.975, goal.size - 3) * np.sqrt(total @ covariance @ total)
    return float(total @ solution), float(wide)


def _antiresonance_hz(frequency_hz: Floats, size: Floats) -> float:
    """The lowest point of |G|·f before its highest; the last line where there is none."""
    top = int(np.nanargmax(size))
    return float(frequency_hz[int(np.nanargmin(size[:top]))]) if top > 1 else float(frequency_hz[-1])


def _least_squares(matrix: Floats, goal: Floats, noise: Floats, size: Floats) -> tuple[Floats, Floats]:
    """Solution and covariance, with the noise and the share of the size that the residuals ask for."""
    from scipy.optimize import brentq

    def solved(log_share: float) -> tuple[Floats, Floats, float]:
        deviation = np.hypot(noise, np.exp(log_share) * size)
        weighted = matrix / deviation[:, np.newaxis]
        scale = np.linalg.norm(weighted, axis=0)
        inverse = np.linalg.inv((weighted / scale).T @ (weighted / scale)) / np.outer(scale, scale)
        solution = inverse @ weighted.T @ (goal / deviation)
        spread = np.sum(((goal - matrix @ solution) / deviation) ** 2) / (goal.size - matrix.shape[1])
        return solution, inverse, float(spread)

    low, high = np.log(_SHARE)
    if solved(low)[2] > 1:
        low = brentq(lambda log_share: solved(log_share)[2] - 1, low, high)
    return solved(low)[:2]
