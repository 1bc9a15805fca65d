"""What the machine did and the model did not, through the windows of the Tracker."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Channel, Responses
from livebode.estimation import Settings, Tracker
from livebode.motion.chunk import Chunk
from livebode.motion.model import MovingModel
from livebode.motion.replay import by_torque, without_drift

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Residual:
    """y less the model's velocity under the measured torque, without slow drift; and the cart's velocity, rad/s."""

    velocity: Floats
    cart: Floats


def residual(model: MovingModel, chunk: Chunk, settings: Settings) -> Residual:
    """What is left over a chunk; NaN where a sample is missing. Arrays of shape (samples,)."""
    lines = settings.lines
    motor, cart = by_torque(model, lines.rate_hz, chunk.u, chunk.x)
    slow = without_drift(motor, chunk.y, lines.window) - motor
    return Residual(np.where(chunk.missing, np.nan, chunk.y - motor - slow), cart / model.radius_m + slow)


class Scatter:
    """A Tracker on the residual: R/U, and the noise by how R scatters from period to period, or by the quiet bins.

    The motion is in the model too, so it does not count. What is remembered goes from chunk to chunk; the windows that
    hold a chunk's end are in none, for they would hold two models.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = replace(settings, schedule=None, spikes=(), ripple=())
        self._memory = b""

    def once(self, velocity: Floats, chunk: Chunk) -> Responses:
        """Responses R/U of this residual; remembers nothing."""
        return Tracker(self._settings, repeating=False).process(self._block(velocity, chunk))

    def then(self, velocity: Floats, chunk: Chunk) -> tuple[Responses, bytes]:
        """The same with the sigma that goes with it, and the memory that `keep` takes."""
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
        """From the first sample on that a new window holds."""
        s = self._settings
        rows = {s.output: velocity, s.input: chunk.u} | ({s.excitation: chunk.w} if s.excitation else {})
        names = [name for name in rows if name]
        at = max(chunk.first - s.lines.window + 1 - chunk.start, 0)
        data = np.array([rows[name][at:] for name in names])
        return Block(data, tuple(map(Channel, names)), s.lines.rate_hz, start=chunk.start + at, gap=True)

    def state(self) -> dict[str, NDArray[np.generic]]:
        return {"memory": np.frombuffer(self._memory, dtype=np.uint8)}

    def load(self, state: dict[str, NDArray[np.generic]]) -> None:
        self._memory = state["memory"].tobytes()
