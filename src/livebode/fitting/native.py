"""Which problems the fit in C solves, and its description of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.fitting.chains import Chain, Rigid, TwoMass
from livebode.fitting.physical import EvaluationGrid, PhysicalModel
from livebode.fitting.unknown_gain import TwoMassGain
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
