"""The residual of the model in the windows of the Tracker."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import Block, Channel, Responses, Stage, StatefulBase
from livebode.estimation import Settings, Tracker
from livebode.motion.chunk import Chunk
from livebode.motion.model import MovingModel
from livebode.motion.replay import by_torque, without_drift


@dataclass(frozen=True, eq=False)
class Residual:
    """y less the model's velocity under the measured torque, without slow drift; and the cart's velocity, rad/s."""

    velocity: Floats
    cart: Floats


def residual(model: MovingModel, chunk: Chunk, settings: Settings) -> Residual:
    """The residual over a chunk; NaN where a sample is missing. Arrays of shape (samples,)."""
    lines = settings.lines
    motor, cart = by_torque(model, lines.rate_hz, chunk.u, chunk.x)
    slow = without_drift(motor, chunk.y, lines.window) - motor
    return Residual(np.where(chunk.missing, np.nan, chunk.y - motor - slow), cart / model.radius_m + slow)


class Scatter(StatefulBase):
    """A Tracker on the residual: R/U, and the noise from the scatter of R between periods, or from detection lines.

    The motion is also in the model, so the residual does not contain it. The memory continues from chunk to chunk;
    windows across a chunk's end are not used, because they would contain two models.
    """

    _stage = Stage("residual-scatter", 1)

    def __init__(self, settings: Settings) -> None:
        self._settings = replace(settings, schedule=None, spikes=(), ripple=())
        self._memory = b""

    def once(self, velocity: Floats, chunk: Chunk) -> Responses:
        """Responses R/U of this residual, without memory."""
        return Tracker(self._settings, repeating=False).process(self._block(velocity, chunk))

    def then(self, velocity: Floats, chunk: Chunk) -> tuple[Responses, bytes]:
        """Corrected responses with their sigma, and the memory for `keep`."""
        tracker, block = Tracker(self._settings, repeating=False), self._block(velocity, chunk)
        if self._memory:
            tracker.restore(self._memory)
        until = chunk.stop - self._settings.lines.window + 1 - block.start
        if until <= 0:
            return tracker.process(block), self._memory
        parts = [tracker.process(block.cut(0, until))]
        memory = tracker.snapshot()
        return Responses.join([*parts, tracker.process(block.cut(until, len(block)))]), memory

    def keep(self, memory: bytes) -> None:
        self._memory = memory

    def _block(self, velocity: Floats, chunk: Chunk) -> Block:
        """The residual from the first sample of a new window on."""
        s = self._settings
        rows = {s.output: velocity, s.input: chunk.u} | ({s.excitation: chunk.w} if s.excitation else {})
        names = [name for name in rows if name]
        begin = max(chunk.first - s.lines.window + 1 - chunk.start, 0)
        data = np.array([rows[name][begin:] for name in names])
        return Block(data, tuple(map(Channel, names)), s.lines.rate_hz, start=chunk.start + begin, gap=True)

    def _state(self) -> dict[str, Any]:
        return {"memory": self._memory}

    def _load(self, state: dict[str, Any]) -> None:
        if state["memory"]:
            Tracker(self._settings, repeating=False).restore(state["memory"])
        self._memory = state["memory"]
