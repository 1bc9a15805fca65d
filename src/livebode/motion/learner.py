"""From chunk to chunk: the model of the machine's responses."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import Responses, Stage, StatefulBase
from livebode.dataclass import dataclass
from livebode.estimation import Settings
from livebode.motion.chunk import FLAT_M, Chunk, steady_rows
from livebode.motion.fit import MotionFitOptions, WeightedResponses, sampled
from livebode.motion.model import MovingModel, PositionCurve
from livebode.motion.replay import Residual
from livebode.motion.standstill import turns


@dataclass(frozen=True, eq=False)
class ReplayResult:
    """A model driven through a chunk: its residual, R/U of the residual, and the corrected responses (rows, lines)."""

    model: MovingModel
    left: Residual
    seen: Responses
    value: Complex


Replay = Callable[[MovingModel], ReplayResult]

_ROWS_MIN = 12
_OVERLAP = 4  # windows of a period in the fit: more windows share their samples without new information
_REACH = 0.25  # of the new range that may be outside of the model's, for a start from it
_CHECKED = 50  # positions
_WORSE = 1.5  # misfit relative to the previous one from which a start from the previous model is rejected


class Learner(StatefulBase):
    """Fits a MovingModel to each chunk, the first from a scan, the next ones from the previous model.

    A chunk without travel has no information on the curves: after one with travel, the model is unchanged.
    """

    _stage = Stage("motion-learner", 1)

    def __init__(self, settings: Settings, radius_m: float, splines: tuple[int, int], passes: int) -> None:
        self._settings, self._radius_m, self._splines, self._passes = settings, radius_m, splines, passes
        self.model: MovingModel | None = None
        self.chunks = 0
        self.travels = False
        self._misfit = np.inf

    @property
    def has_travelled(self) -> bool:
        """Whether the model was fitted to the machine in motion."""
        return self.model is not None and len(self.model.log_stiffness.weights) > 1

    def learn(self, tracked: Responses, chunk: Chunk, replay: Replay) -> ReplayResult | None:
        """The model after this chunk's steady motion; None while there is too little to fit."""
        usable = self._usable(tracked)
        steady = usable[steady_rows(tracked.sample[usable], chunk, self._settings.lines.window)]
        if steady.size >= _ROWS_MIN:
            self.travels = True
            return self._learn(tracked, steady, chunk, replay)
        self.travels = False
        if self.model is None and usable.size >= _ROWS_MIN:
            return self._learn(tracked, usable, chunk, replay)
        return None if self.model is None else replay(self.model)

    def widened(self, tracked: Responses, chunk: Chunk, now: ReplayResult) -> MovingModel:
        """The model over all positions of the chunk, with the stiffness and damping of all responses."""
        rows, fit, model = self._over_all(tracked, now)
        wide = fit.refine(self._rows(tracked, rows, chunk, now), model, masses_known=True)
        return wide if self._sound(wide) else now.model

    def completed(self, tracked: Responses, chunk: Chunk, replay: Replay, now: ReplayResult) -> ReplayResult:
        """The model fitted to all responses, for a chunk in which friction never stops the axis."""
        rows, fit, model = self._over_all(tracked, now)
        model = fit.refine(self._rows(tracked, rows, chunk, now), model)
        if not self._sound(model):
            return now
        self.model = model
        return replay(model)

    def _over_all(
        self, tracked: Responses, now: ReplayResult
    ) -> tuple[NDArray[np.intp], MotionFitOptions, MovingModel]:
        rows = self._thinned(tracked, self._usable(tracked))
        position_m = np.append(tracked.schedule[rows], (now.model.low_m, now.model.high_m))
        fit = self._fit(len(now.model.log_stiffness.weights), len(now.model.log_damping.weights))
        return rows, fit, fit.follow(now.model, float(position_m.min()), float(position_m.max()))

    def _learn(self, tracked: Responses, rows: NDArray[np.intp], chunk: Chunk, replay: Replay) -> ReplayResult | None:
        rows = self._thinned(tracked, rows)
        position_m = tracked.schedule[rows]
        splines = self._splines if self.travels else (1, 1)
        fit = self._fit(*splines)
        best = None
        if self.model is not None and _reaches(self.model, position_m, splines):
            model = fit.follow(self.model, float(position_m.min()), float(position_m.max()))
            best = self._refined(fit, replay(model), tracked, rows, chunk, replay, max(self._passes - 2, 1))
        if best is None or best[1] > _WORSE * self._misfit:
            raw = WeightedResponses(tracked.value[rows], chunk.torque[rows], position_m)
            first = fit.refine(raw, fit.start(raw))
            if self._sound(first):
                anew = self._refined(fit, replay(first), tracked, rows, chunk, replay, self._passes - 1)
                best = anew if best is None or anew[1] < best[1] else best
        if best is None:
            return None if self.model is None else replay(self.model)
        result, self._misfit = best
        self.model = result.model
        self.chunks += 1
        return result

    def _refined(
        self,
        fit: MotionFitOptions,
        now: ReplayResult,
        tracked: Responses,
        used: NDArray[np.intp],
        chunk: Chunk,
        replay: Replay,
        passes: int,
    ) -> tuple[ReplayResult, float]:
        rows = self._rows(tracked, used := self._onward(tracked, used, chunk, now), chunk, now)
        for _ in range(passes):
            model = fit.refine(rows, now.model)
            if not self._sound(model):
                break
            now = replay(model)
            rows = self._rows(tracked, used, chunk, now)
        return now, fit.misfit(rows, now.model)

    def _onward(self, tracked: Responses, used: NDArray[np.intp], chunk: Chunk, now: ReplayResult) -> NDArray[np.intp]:
        """Rows whose window has no reversal of motor or cart, where friction would bias them; all, if few remain."""
        where, newest = turns(now.left, chunk, chunk.start), tracked.sample[used]
        inside = np.searchsorted(where, newest, "right") - np.searchsorted(
            where, newest - self._settings.lines.window, "right"
        )
        onward = used[inside == 0]
        return onward if onward.size >= max(_ROWS_MIN, used.size // 4) else used

    def _rows(self, tracked: Responses, used: NDArray[np.intp], chunk: Chunk, now: ReplayResult) -> WeightedResponses:
        # The error of a response is n/|U|: white noise on y divided by the torque at the line.
        weight = chunk.torque[used]
        value = np.where(np.isfinite(now.value[used]), now.value[used], tracked.value[used])
        return WeightedResponses(value, weight, tracked.schedule[used])

    def _usable(self, tracked: Responses) -> NDArray[np.intp]:
        return np.flatnonzero(tracked.valid.all(axis=1) & np.isfinite(tracked.schedule))

    def _thinned(self, tracked: Responses, rows: NDArray[np.intp]) -> NDArray[np.intp]:
        """The first of these rows in each quarter of a window."""
        apart = max(self._settings.lines.window // _OVERLAP, 1)
        return rows[np.unique(tracked.sample[rows] // apart, return_index=True)[1]]

    def _sound(self, model: MovingModel) -> bool:
        """Whether all poles are slower than the rate; else the responses had too little information for a fit."""
        js, load, stiffness, damping = np.exp(model.parameters(np.linspace(model.low_m, model.high_m, _CHECKED))).T
        reduced = js * load / (js + load)
        fastest = np.maximum(np.sqrt(stiffness / reduced), damping / reduced)
        return bool(np.all(fastest < np.pi * self._settings.lines.rate_hz))

    def _fit(self, stiffness_splines: int, damping_splines: int) -> MotionFitOptions:
        lines = self._settings.lines
        return MotionFitOptions(
            lines.z, lines.rate_hz, self._radius_m, stiffness_splines, damping_splines, delayed=True
        )

    def _state(self) -> dict[str, Any]:
        m = self.model
        model = {} if m is None else {
            "constants": [m.inertia_kg_m2, m.load_kg, m.low_m, m.high_m, m.delay_s],
            "stiffness": m.log_stiffness.weights,
            "damping": m.log_damping.weights,
        }  # fmt: skip
        return {"chunks": self.chunks, "misfit": self._misfit} | model

    def _load(self, state: dict[str, Any]) -> None:
        self.chunks, self._misfit, self.model = int(state["chunks"]), float(state["misfit"]), None
        if "constants" in state:
            inertia, load, low, high, delay_s = (float(n) for n in state["constants"])
            stiffness, damping = (PositionCurve(low, high, state[name]) for name in ("stiffness", "damping"))
            self.model = MovingModel(inertia, load, self._radius_m, stiffness, damping, delay_s)


def _reaches(model: MovingModel, position_m: Floats, splines: tuple[int, int]) -> bool:
    """Whether a model covers enough of these positions to start from."""
    if splines != (len(model.log_stiffness.weights), len(model.log_damping.weights)):
        return False
    outside = max(model.low_m - position_m.min(), position_m.max() - model.high_m, 0.0)
    return bool(outside <= max(_REACH * np.ptp(position_m), FLAT_M))


def frozen(model: MovingModel, position_m: Floats, settings: Settings) -> Complex:
    """The model's response at these fixed positions (its lowest one, where NaN), (rows, lines)."""
    known_m = np.where(np.isfinite(position_m), position_m, model.low_m)
    return sampled(model, known_m, settings.lines.z, settings.lines.rate_hz)
