"""One MovingModel for all responses along the travel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import FitError
from livebode.dataclass import dataclass
from livebode.fitting import minimise, scan, two_masses
from livebode.kernel import BeltGrid, BeltRows, BeltSplines, belt_together
from livebode.motion.model import MovingModel, PositionCurve, basis

_SCANNED_ROWS = 24
_SMOOTH = 1e-3  # of a third difference of the splines' weights, against the weight of all responses


class WeightedResponses(NamedTuple):
    """Responses (rows, lines), one over their standard deviations up to a factor, and positions (rows,)."""

    value: Complex
    weight: Floats
    position_m: Floats


@dataclass(frozen=True, eq=False)
class MotionFitOptions:
    """Options of the fit of a MovingModel.

    Parameters
    ----------
    z, rate_hz
        e^(jωT) at the lines, and the loop's rate.
    radius_m
        r.
    stiffness_splines, damping_splines
        Number of B-splines of ln Keff(x) and ln bs(x): 1 for a constant, else 4 or more. No shape is assumed.
    delayed
        Whether the output may lag the input; else the model has no delay.
    """

    z: Complex
    rate_hz: float
    radius_m: float
    stiffness_splines: int
    damping_splines: int
    delayed: bool = False

    def start(self, rows: WeightedResponses) -> MovingModel:
        """From a scan of ten stiffnesses at up to 24 places: medians of the masses, curves through the rest."""
        chosen = np.unique(np.linspace(0, len(rows.value) - 1, _SCANNED_ROWS).round().astype(int))
        order = np.argsort(rows.position_m, kind="stable")[chosen]
        logarithms, cost = scan(rows.value[order], rows.weight[order], self.z, self.rate_hz)
        good = np.isfinite(cost) & (cost <= 10 * np.median(cost))
        if np.count_nonzero(good) < 1:
            raise FitError(
                "no-model",
                "no two-mass model fits these responses",
                "check the lines, the signals and the loop",
                rows=len(chosen),
            )
        logarithms, position_m = logarithms[good], rows.position_m[order][good]
        low, high = float(rows.position_m.min()), float(rows.position_m.max())
        logarithms[:, :2] = np.median(logarithms[:, :2], axis=0)
        weights = []
        for which, splines in ((2, self.stiffness_splines), (3, self.damping_splines)):
            shape = basis(position_m, low, high, splines)
            smooth = _third_differences(splines)
            matrix = shape.T @ shape + 1e-2 * smooth + 1e-9 * np.eye(splines)
            weights.append(np.linalg.solve(matrix, shape.T @ logarithms[:, which]))
        return self._model(np.concatenate([logarithms[0, :2], *weights, np.zeros(1)]), low, high)

    def follow(self, model: MovingModel, low: float, high: float) -> MovingModel:
        """A previous model, over another range of positions."""
        position_m, arm = (
            np.linspace(low, high, 8 * max(self.stiffness_splines, self.damping_splines)),
            2 * np.log(self.radius_m),
        )
        weights = [
            np.linalg.lstsq(basis(position_m, low, high, splines), curve(position_m) + arm)[0]
            for curve, splines in (
                (model.log_stiffness, self.stiffness_splines),
                (model.log_damping, self.damping_splines),
            )
        ]
        known = self._unknowns(model)
        return self._model(np.concatenate([known[:2], *weights, known[-1:]]), low, high)

    def misfit(self, rows: WeightedResponses, model: MovingModel) -> float:
        """Residual of the model as a share of the weighted responses, rms."""
        residual = sampled(model, rows.position_m, self.z, self.rate_hz) - rows.value
        return float(np.linalg.norm(rows.weight * residual) / np.linalg.norm(rows.weight * rows.value))

    def refine(self, rows: WeightedResponses, model: MovingModel, *, masses_known: bool = False) -> MovingModel:
        """Weighted least squares over all rows, started from a model; `masses_known` fixes Js, mL and the delay."""
        low, high = model.low_m, model.high_m
        known = self._unknowns(model)
        free = slice(2 if masses_known else 0, None if self.delayed and not masses_known else -1)
        grid = BeltGrid.of(self.z, self.rate_hz)
        measured = BeltRows(rows.value, rows.weight)
        splines = BeltSplines(
            *(basis(rows.position_m, low, high, n) for n in (self.stiffness_splines, self.damping_splines))
        )
        pull = _SMOOTH * self._smoothness(rows)

        def normal(unknowns: Floats) -> tuple[Floats, Floats, Floats]:
            known[free] = unknowns[0]
            cost, gradient, matrix = belt_together(grid, measured, splines, known)
            gradient, matrix = gradient + pull @ known, matrix + pull
            return cost + known @ pull @ known, gradient[:, free], matrix[:, free, free]

        known[free] = minimise(normal, known[free][np.newaxis].copy())[0][0]
        return self._model(known, low, high)

    def _smoothness(self, rows: WeightedResponses) -> Floats:
        n, k = 2 + self.stiffness_splines + self.damping_splines, 2 + self.stiffness_splines
        penalty = np.zeros((n + 1, n + 1))
        penalty[2:k, 2:k] = _third_differences(self.stiffness_splines)
        penalty[k:-1, k:-1] = _third_differences(self.damping_splines)
        return penalty * float(np.sum(np.abs(rows.weight * rows.value) ** 2)) / n

    def _unknowns(self, model: MovingModel) -> Floats:
        arm = 2 * np.log(self.radius_m)
        masses = np.log(model.inertia_kg_m2), np.log(model.load_kg) + arm
        late = [model.delay_s * self.rate_hz]
        return np.concatenate([masses, model.log_stiffness.weights + arm, model.log_damping.weights + arm, late])

    def _model(self, unknowns: Floats, low: float, high: float) -> MovingModel:
        arm, k = 2 * np.log(self.radius_m), 2 + self.stiffness_splines
        return MovingModel(
            inertia_kg_m2=float(np.exp(unknowns[0])),
            load_kg=float(np.exp(unknowns[1] - arm)),
            radius_m=self.radius_m,
            log_stiffness=PositionCurve(low, high, unknowns[2:k] - arm),
            log_damping=PositionCurve(low, high, unknowns[k:-1] - arm),
            delay_s=float(unknowns[-1]) / self.rate_hz,
        )


def sampled(model: MovingModel, position_m: Floats, z: Complex, rate_hz: float) -> Complex:
    """Response at e^(jωT) behind a zero-order hold, of the model at these fixed positions, (rows, lines)."""
    return np.asarray(z ** (-model.delay_s * rate_hz) * two_masses.sampled(model.parameters(position_m), z, rate_hz))


def _third_differences(splines: int) -> Floats:
    differences = np.diff(np.eye(splines), n=3, axis=0)
    return np.asarray(differences.T @ differences)
