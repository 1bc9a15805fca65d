"""FrictionCurve: Coulomb, viscous and Stribeck friction of an axis from usual strokes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import COVERAGE, Block, SignalError, UsageError, t_quantile
from livebode.dataclass import dataclass
from livebode.motion.robust_regression import Regression, regress
from livebode.motion.smooth_motion import OutputKind, SmoothMotion

_STANDING = 0.01  # of a kernel: at standstill any smaller input gives the same motion, in a reversal none does
_EACH_WAY_MIN = 20  # samples in each direction
# Of the samples, away from reversals: where feedback and noise alone move an axis, they look like friction.
_STROKES_LEAST = 0.4
_STRIBECK = np.geomspace(0.02, 0.5, 15)  # of the highest speed: places of the search
_SLIDING = 0.99  # of a kernel in one direction: away from reversals
_ROUNDS = 30
_SETTLED = 1e-6
_SEEN = 0.999  # probability that the Stribeck friction is not zero


@dataclass(frozen=True, eq=False)
class FrictionCurve:
    """Friction of an axis over its speed, with bounds.

    The input that keeps an axis in motion is

        u = J·a + Fv·v + (Fc + Fs/(1 + (v/vs)²))·sign(v) + F0

    and with `places` the Coulomb friction Fc is a polygon over the position.

    Attributes
    ----------
    names, units
        Of the parameters, in order: inertia J, viscous Fv, coulomb Fc (or coulomb at each place), offset F0,
        asymmetry (Fv forward minus Fv backward, halved; only in `directions`), and stribeck Fs, stribeck_speed vs if
        found.
    value, covariance
        Shape (parameters,) and (parameters, parameters), in SI units.
    dof
        Degrees of freedom of each variance, shape (parameters,).
    places
        Positions of the Coulomb frictions; empty without.
    speed
        Lowest and highest speed of the samples that were used.
    residual
        Standard deviation of the smoothed input that the model does not explain.
    samples, excluded
        Numbers of smoothed samples used, and left out because the axis was at standstill.
    measured
        Speed and friction away from reversals, shape (2, some samples): the input without J·a and F0.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    value: Floats
    covariance: Floats
    dof: NDArray[np.int64]
    places: Floats
    speed: tuple[float, float]
    residual: float
    samples: int
    excluded: int
    measured: Floats

    @property
    def sigma(self) -> Floats:
        """Standard deviation of each parameter, shape (parameters,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def bound(self, probability: float = COVERAGE) -> Floats:
        """Half-width of the interval that covers the true value with this probability, shape (parameters,).

        By Student's t, because the covariance is estimated from correlated residuals. A model error, such as friction
        that depends on the temperature, is covered as far as it varies within the recording.
        """
        return np.asarray(self.sigma * [t_quantile(0.5 + probability / 2, int(dof)) for dof in self.dof])

    def __getitem__(self, name: str) -> float:
        return float(self.value[self.index(name)])

    def index(self, name: str) -> int:
        """Place of a parameter; UsageError with the known names where it is not there."""
        if name not in self.names:
            raise UsageError(
                "unknown-name",
                f"the friction curve has no parameter {name!r}",
                f"choose one of {', '.join(self.names)}",
                value=name,
                allowed=list(self.names),
            )
        return self.names.index(name)

    def at(self, velocity: Floats, probability: float = COVERAGE) -> tuple[Floats, Floats]:
        """Friction at these speeds with its bound, without the offset, as the mean over the places; (speeds,) each."""
        slope = self._slopes(np.asarray(velocity, dtype=np.float64))
        linear = slope.copy()
        if "stribeck_speed" in self.names:
            linear[:, self.index("stribeck_speed")] = 0.0
        variance = np.einsum("ij,jk,ik->i", slope, self.covariance, slope)
        least = int(self.dof[np.any(slope != 0, axis=0)].min(initial=self.dof.max()))
        return linear @ self.value, np.sqrt(variance) * t_quantile(0.5 + probability / 2, least)

    def direction(self, sign: int, probability: float = COVERAGE) -> tuple[Floats, Floats]:
        """Coulomb and viscous friction of one direction with their bounds, shapes (2,) and (2,).

        The offset counts as Coulomb friction: Fc ± F0 and Fv ± asymmetry. Needs a curve of `directions`, no places.
        """
        take = np.zeros((2, len(self.names)))
        take[0, [self.index("coulomb"), self.index("offset")]] = 1.0, sign
        take[1, [self.index("viscous"), self.index("asymmetry")]] = 1.0, sign
        sigma = np.sqrt(np.diag(take @ self.covariance @ take.T))
        factor = [t_quantile(0.5 + probability / 2, int(self.dof[row != 0].min())) for row in take]
        return take @ self.value, sigma * factor

    def _slopes(self, v: Floats) -> Floats:
        """Derivative of the friction by each parameter, shape (speeds, parameters)."""
        slope = np.zeros((v.size, len(self.names)))
        sign = np.sign(v)
        for i, name in enumerate(self.names):
            if name == "viscous":
                slope[:, i] = v
            elif name == "asymmetry":
                slope[:, i] = np.abs(v)
            elif name.startswith("coulomb"):
                slope[:, i] = sign / max(self.places.size, 1)
            elif name == "stribeck":
                slope[:, i] = sign * _decay(v, self["stribeck_speed"])
            elif name == "stribeck_speed":
                slope[:, i] = self["stribeck"] * sign * _decay_slope(v, self["stribeck_speed"])
        return slope

    def plain(self) -> dict[str, Any]:
        """Plain data of the curve, for JSON; bounds of 95 %."""
        bound = self.bound()
        parameters: dict[str, Any] = {
            name: {"value": float(self.value[i]), "bound": float(bound[i]), "unit": self.units[i]}
            for i, name in enumerate(self.names)
        }
        return {
            "parameters": parameters,
            "covariance": self.covariance.tolist(),
            "dof": self.dof.tolist(),
            "places": self.places.tolist(),
            "speed": list(self.speed),
            "residual": self.residual,
            "samples": self.samples,
            "excluded": self.excluded,
        }


def friction_curve(
    block: Block,
    *,
    input: str,
    output: str,
    kind: OutputKind,
    directions: bool = False,
    places: int = 0,
    band_hz: float = 5.0,
    slowest: float | None = None,
) -> FrictionCurve:
    """Friction from samples of usual strokes, by least squares of the inverse dynamics.

    All terms of the equation of motion are smoothed by one kernel without delay (`SmoothKernel`), so that an excitation
    above the band does not matter, and neither do the steps of an encoder. Samples at standstill are left out; a
    reversal is not, because the sign of the speed is smoothed as the input is.
    Stribeck friction is part of the result if it differs from zero with a probability of 99.9 %.

    Parameters
    ----------
    block
        Samples without gaps.
    input, output
        Channels of the torque or force (or current: the frictions are then in its unit), and of the axis.
    kind
        Quantity of the output. Of a position, the differences between samples count; of an encoder, its counts.
    directions
        With a viscous friction of each direction.
    places
        Number of positions, evenly over the travel, at which the Coulomb friction is found; 0: one for all.
    band_hz
        Band of the kernel. Above the speed at which strokes change, and below excitation and resonances.
    slowest
        Speed below which the axis is at standstill. Default: 1 % of the highest one.

    Raises
    ------
    SignalError
        If the samples do not show the friction: too few, at standstill, in one direction only, or at one speed.
    UsageError
        If an argument is out of its range.

    Notes
    -----
    Biased where friction depends on something else, such as load or temperature; by an elasticity that swings within
    the band; and by noise of a position that is not small against the travel of a kernel.
    """
    _check(places, slowest)
    motion = SmoothMotion.of(block, input, output, kind, band_hz, slowest)
    top = float(np.max(np.abs(motion.velocity)))
    used = motion.standing < _STANDING
    each_way = [int(np.count_nonzero(used & (motion.sign * sign > _SLIDING))) for sign in (1, -1)]
    if min(each_way) < _EACH_WAY_MIN or sum(each_way) < _STROKES_LEAST * np.count_nonzero(used):
        raise SignalError(
            "too-short",
            f"away from reversals the axis moves forward for {each_way[0]} smoothed samples and backward for "
            f"{each_way[1]}, of {np.count_nonzero(used)}, but {_EACH_WAY_MIN} each way and {_STROKES_LEAST:.0%} of all "
            "are needed",
            "record longer strokes, in both directions, or use a higher band",
            forward=each_way[0],
            backward=each_way[1],
            limit=_EACH_WAY_MIN,
        )
    positions = _places(motion.position[used], places)
    names, columns = _columns(motion, directions, positions)
    regression = regress(columns, motion.input, used, motion.kernel.correlation)
    names, regression = _with_stribeck(names, columns, motion, used, regression, top)
    return _curve(names, regression, motion, used, positions, block, input, output, kind)


def _check(places: int, slowest: float | None) -> None:
    for name, value, good in (
        ("places", places, places == 0 or 2 <= places <= 100),
        ("slowest", slowest, slowest is None or 0 < slowest < np.inf),
    ):
        if not good:
            remedy = "choose 2 … 100, or 0 for none" if name == "places" else "choose a positive number"
            raise UsageError("out-of-range", f"{name}={value} is out of its range", remedy, argument=name, value=value)


def _places(position: Floats, many: int) -> Floats:
    return np.linspace(position.min(), position.max(), many) if many else np.zeros(0)


def _columns(motion: SmoothMotion, directions: bool, positions: Floats) -> tuple[list[str], Floats]:
    names = ["inertia", "viscous", "offset"]
    columns = [motion.acceleration, motion.velocity, np.ones(motion.velocity.size)]
    if directions:
        names.append("asymmetry")
        columns.append(np.abs(motion.velocity))
    if positions.size:
        for j in range(positions.size):
            names.append(f"coulomb_{j + 1}")
            columns.append(motion.sign * np.interp(motion.position, positions, np.eye(positions.size)[j]))
    else:
        names.append("coulomb")
        columns.append(motion.sign)
    return names, np.stack(columns, axis=1)


def _with_stribeck(
    names: list[str], columns: Floats, motion: SmoothMotion, used: NDArray[np.bool_], plain: Regression, top: float
) -> tuple[list[str], Regression]:
    """The regression with Stribeck friction if it is seen, else the plain one."""
    try:
        full = _stribeck(columns, motion, used, top)
    except SignalError:  # the strokes cannot tell it from the other frictions
        return names, plain
    amount, speed = full.value[-2:]
    seen = amount > 0 and top * _STRIBECK[0] / 4 < speed < top
    # The speed must be known too: a flat Stribeck curve is a change of the Coulomb friction.
    limit = full.sigma[-2:] * [t_quantile(0.5 + _SEEN / 2, int(dof)) for dof in full.dof[-2:]]
    return (
        ([*names, "stribeck", "stribeck_speed"], full)
        if seen and amount > limit[0] and speed > limit[1]
        else (
            names,
            plain,
        )
    )


def _stribeck(columns: Floats, motion: SmoothMotion, used: NDArray[np.bool_], top: float) -> Regression:
    """The regression with Stribeck friction: a scan of its speed, then Gauss-Newton steps."""

    def with_decay(speed: float) -> Floats:
        return np.column_stack([columns, _smooth_decay(motion, speed)])

    def squares(speed: float) -> float:
        tried = with_decay(speed)[used]
        return float(np.sum((motion.input[used] - tried @ np.linalg.lstsq(tried, motion.input[used])[0]) ** 2))

    speed = min((top * share for share in _STRIBECK), key=squares)
    for _ in range(_ROUNDS):
        tried = with_decay(speed)
        amount = np.linalg.lstsq(tried[used], motion.input[used])[0][-1]
        slope = amount * motion.smoothed(np.sign(motion.sharp) * _decay_slope(motion.sharp, speed))
        full = np.column_stack([tried, slope])
        step = float(np.clip(np.linalg.lstsq(full[used], motion.input[used])[0][-1], -speed / 2, speed))
        speed += step
        if abs(step) < _SETTLED * speed:
            break
    return regress(full, motion.input, used, motion.kernel.correlation).displaced(-1, speed)


def _smooth_decay(motion: SmoothMotion, speed: float) -> Floats:
    """Stribeck friction of 1 through the kernel; only its difference from a step is continuous."""
    v = motion.sharp
    return motion.sign - motion.smoothed(np.sign(v) * (1 - _decay(v, speed)))


def _curve(
    names: list[str],
    regression: Regression,
    motion: SmoothMotion,
    used: NDArray[np.bool_],
    positions: Floats,
    block: Block,
    input: str,
    output: str,
    kind: OutputKind,
) -> FrictionCurve:
    u = motion.input[used] - regression.value[0] * motion.acceleration[used] - regression.value[names.index("offset")]
    speeds = np.abs(motion.velocity[used])
    return FrictionCurve(
        names=tuple(names),
        units=_units(names, block.channels[block.index(input)].unit, block.channels[block.index(output)].unit, kind),
        value=regression.value,
        covariance=regression.covariance,
        dof=regression.dof,
        places=positions,
        speed=(float(speeds.min()), float(speeds.max())),
        residual=regression.residual,
        samples=int(np.count_nonzero(used)),
        excluded=int(np.count_nonzero(~used)),
        measured=np.stack([motion.velocity[used], u])[:, np.abs(motion.sign[used]) > _SLIDING],
    )


def _units(names: list[str], force: str, output: str, kind: OutputKind) -> tuple[str, ...]:
    """Units of the parameters; empty where the recording does not report those of its channels."""
    velocity = output if kind == "velocity" or not output else f"{output}/s"
    per = {
        "inertia": f"{force}/({velocity}/s)",
        "viscous": f"{force}/({velocity})",
        "asymmetry": f"{force}/({velocity})",
        "stribeck_speed": velocity,
    }
    known = bool(force and velocity)
    return tuple((per[name] if known or name == "stribeck_speed" else "") if name in per else force for name in names)


def _decay(v: Floats, speed: float) -> Floats:
    return np.asarray(1 / (1 + (v / speed) ** 2))


def _decay_slope(v: Floats, speed: float) -> Floats:
    """Derivative of `_decay` by the Stribeck speed."""
    square = (v / speed) ** 2
    return np.asarray(2 * square / (speed * (1 + square) ** 2))
