"""From chunk to chunk: the model that the machine's responses show."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from livebode.estimation import Settings
from livebode.motion import two_masses
from livebode.motion.chunk import Chunk
from livebode.motion.fit import Fit, Rows
from livebode.motion.model import Curve, MovingModel
from livebode.motion.steady import FLAT_M, steady_rows
from livebode.nouns import Responses

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Moved = Callable[[MovingModel], Complex]
"""From a model to the chunk's responses, corrected with it, (rows, lines); NaN where there is no whole window."""

_ROWS_MIN = 12
_OVERLAP = 4  # windows of a period that go into the fit: more share their samples, and say nothing new
_REACH = 0.25  # of the new range that may lie outside of the model's, for a start from it
_WORSE = 1.5  # misfit against the one before from which a start from the model before is doubted


class Learner:
    """Fits a MovingModel to each chunk, the first from a scan, the next ones from the model before.

    A chunk that does not travel says nothing of the curves: after one that did, the model stays.
    """

    def __init__(self, settings: Settings, radius_m: float, splines: tuple[int, int], passes: int) -> None:
        self._settings, self._radius_m, self._splines, self._passes = settings, radius_m, splines, passes
        self.model: MovingModel | None = None
        self.chunks = 0
        self._misfit = np.inf

    def learn(self, tracked: Responses, chunk: Chunk, moved: Moved) -> MovingModel | None:
        """The model after this chunk; None as long as there is too little to fit."""
        usable = np.flatnonzero(tracked.valid.all(axis=1) & np.isfinite(tracked.schedule))
        window = self._settings.lines.window
        steady = usable[steady_rows(tracked.sample[usable], chunk, window)]
        if steady.size >= _ROWS_MIN:
            self._learn(tracked, steady, chunk, moved, self._splines)
        elif self.model is None and usable.size >= _ROWS_MIN:
            self._learn(tracked, usable, chunk, moved, (1, 1))
        return self.model

    def _learn(
        self, tracked: Responses, rows: NDArray[np.intp], chunk: Chunk, moved: Moved, splines: tuple[int, int]
    ) -> None:
        lines, at = self._settings.lines, tracked.schedule[rows]
        if np.ptp(at) <= FLAT_M:
            splines = (1, 1)
        rows = rows[_thinned(tracked.sample[rows], lines.window // _OVERLAP)]
        at = tracked.schedule[rows]
        fit = Fit(lines.z, lines.rate_hz, self._radius_m, *splines)
        # The error of a response is n/|U|: white noise on y over the torque at the line.
        weight = chunk.torque(lines, tracked.sample[rows])

        def corrected(model: MovingModel) -> Rows:
            value = moved(model)[rows]
            return Rows(np.where(np.isfinite(value), value, tracked.value[rows]), weight, at)

        raw = Rows(tracked.value[rows], weight, at)
        best = None
        if self.model is not None and _reaches(self.model, at, splines):
            model = fit.follow(self.model, float(at.min()), float(at.max()))
            best = self._refined(fit, model, corrected, corrected(model), self._passes - 1)
        if best is None or best[1] > _WORSE * self._misfit:
            anew = self._refined(fit, fit.start(raw), corrected, raw, self._passes)
            best = anew if best is None or anew[1] < best[1] else best
        self.model, self._misfit = best
        self.chunks += 1

    def _refined(
        self, fit: Fit, model: MovingModel, corrected: Callable[[MovingModel], Rows], rows: Rows, passes: int
    ) -> tuple[MovingModel, float]:
        for left in reversed(range(max(passes, 1))):
            model = fit.refine(rows, model)
            if left:
                rows = corrected(model)
        return model, fit.misfit(rows, model)

    def state(self) -> dict[str, NDArray[np.generic]]:
        head = {"count": np.array([self.chunks]), "misfit": np.array([self._misfit])}
        if self.model is None:
            return head
        m = self.model
        return head | {
            "constants": np.array([m.inertia_kg_m2, m.load_kg, m.low_m, m.high_m]),
            "stiffness": m.log_stiffness.weights,
            "damping": m.log_damping.weights,
        }

    def load(self, state: dict[str, NDArray[np.generic]]) -> None:
        self.chunks, self._misfit = int(state["count"][0]), float(state["misfit"][0])
        self.model = None
        if "constants" in state:
            inertia, load, low, high = (float(n) for n in state["constants"])
            curves = (Curve(low, high, np.array(state[name], dtype=np.float64)) for name in ("stiffness", "damping"))
            self.model = MovingModel(inertia, load, self._radius_m, *curves)


def _thinned(sample: NDArray[np.int64], apart: int) -> NDArray[np.intp]:
    """Places in `sample`, the first of each stretch of `apart` samples."""
    return np.unique(sample // max(apart, 1), return_index=True)[1]


def _reaches(model: MovingModel, at: Floats, splines: tuple[int, int]) -> bool:
    """Whether a model has seen enough of these positions to start from."""
    if splines != (len(model.log_stiffness.weights), len(model.log_damping.weights)):
        return False
    outside = max(model.low_m - at.min(), at.max() - model.high_m, 0.0)
    return bool(outside <= max(_REACH * np.ptp(at), FLAT_M))


def frozen(model: MovingModel, position_m: Floats, settings: Settings) -> Complex:
    """The model's response held at these positions (the lowest it knows, where NaN), (rows, lines)."""
    at = np.where(np.isfinite(position_m), position_m, model.low_m)
    return two_masses.sampled(model.parameters(at), settings.lines.z, settings.lines.rate_hz)
