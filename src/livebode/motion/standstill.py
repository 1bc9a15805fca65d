"""Detection of dry friction that stops an axis at standstill or reversal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Floats
from livebode.core import Event, Responses, Stage, StatefulBase
from livebode.dataclass import dataclass
from livebode.estimation import Settings
from livebode.language import Message
from livebode.motion.chunk import Chunk, steady_rows
from livebode.motion.replay import Residual

_UNEXPLAINED = 0.03  # of the output's amplitude at the lines; with dry friction |G| is then off by some 0.7 dB
_DRAG = 0.01  # of the torque's amplitude at the lines, rms; smaller friction cannot cause the share above
_SLOW = 0.05  # of the largest speed: friction at its bend
_LONGEST = 4  # windows per verdict


@dataclass(frozen=True)
class StandstillStretch:
    """Samples `first` to `last` with standstill or reversal of motor or cart; `unexplained`: share of the output."""

    first: int
    last: int
    unexplained: float


class StandstillDetector(StatefulBase):
    """Finds the stretches in which the axis does not respond as the model that was fitted to its motion.

    Coulomb friction is a constant torque while motor and cart do not change their direction, and does not affect a
    line. Where one of them is at standstill or reverses, it is not constant. Such stretches are judged by the residual
    power of the output at the lines, for a belt on the masses known from the motion, beyond the residual elsewhere (the
    noise): more than 3 % in amplitude is friction, if steady motion has shown a drag. A real change of the masses at
    standstill of an axis with drag has the same effect.
    """

    _stage = Stage("standstill", 1)
    _STATE = ("_noise", "_drag", "_until")

    def __init__(self, settings: Settings, events: list[Event]) -> None:
        self._settings = settings
        self._window = settings.lines.window
        self._noise = 0.0  # Σ|R|² over the lines where the axis moves
        self._drag = np.inf  # mean torque in steady motion; unlimited while unknown
        self._until = -1  # end of the last stretch in which friction stopped it
        self._events = events

    def stretches(self, left: Residual, chunk: Chunk) -> list[tuple[int, int]]:
        """Numbers of the first and last sample of stretches with changes of sign less than a window apart.

        None is longer than four windows, so that each belongs to one place.
        """
        where = turns(left, chunk, max(chunk.first - self._window + 1, chunk.start))
        apart = (np.diff(where) >= self._window) | (np.diff(where // (_LONGEST * self._window)) > 0)
        groups = np.split(where, 1 + np.flatnonzero(apart))
        return [(int(group[0]), int(group[-1])) for group in groups if group.size]

    def tail(self, chunk: Chunk) -> list[StandstillStretch]:
        """The end of a stretch with friction from the previous chunk, if it reaches into this one."""
        reaches = self._until >= 0 and self._until + 2 * self._window > chunk.first
        return [StandstillStretch(self._until, self._until, 0.0)] if reaches else []

    def held(
        self, stretches: list[tuple[int, int]], tracked: Responses, seen: Responses, chunk: Chunk, inertia_kg_m2: float
    ) -> list[StandstillStretch]:
        """The stretches in which friction stops the axis.

        `seen` is R/U with a model whose belt fits here too, `inertia_kg_m2` the total inertia at the motor.
        """
        rows = np.flatnonzero(tracked.valid.all(axis=1))
        rows = rows[np.unique(tracked.sample[rows] // max(self._window // 4, 1), return_index=True)[1]]
        torque = chunk.torque[rows]
        power = np.sum(np.abs(seen.value[rows] * torque) ** 2, axis=1)
        output = np.sum(np.abs(tracked.value[rows] * torque) ** 2, axis=1)
        newest = tracked.sample[rows]
        touches = [(newest >= first) & (newest - self._window < last) for first, last in stretches]
        moving = ~np.any(touches, axis=0) & np.isfinite(power)
        if moving.any():
            self._noise = float(np.median(power[moving]))
        steady = steady_rows(newest, chunk, self._window)
        if steady.any():
            self._drag = float(np.abs(np.mean(chunk.drag(self._window, newest[steady], inertia_kg_m2))))
        # |U| of a sine of amplitude a over N samples is N·a/2.
        amplitude = np.sqrt(2 * np.mean(np.sum(torque**2, axis=1))) / self._window
        dragged = self._drag > _DRAG * amplitude
        done = []
        for (first, last), touch in zip(stretches, touches):
            continues = self._until >= 0 and first - self._until < self._window
            rest_of_one = continues and last - first < self._window
            within = touch & np.isfinite(power)
            excess = max(np.mean(power[within]) - self._noise, 0.0) / np.mean(output[within]) if within.any() else 0.0
            stretch = StandstillStretch(first, last, float(np.sqrt(excess)))
            if rest_of_one or (dragged and stretch.unexplained > _UNEXPLAINED):
                if not continues:
                    self._report(stretch, tracked)
                self._until = last
                done.append(stretch)
        return done

    def _report(self, stretch: StandstillStretch, tracked: Responses) -> None:
        lines = self._settings.lines
        newest_s = float(tracked.time_s[0]) + (lines.window - 1) / 2 / lines.rate_hz
        time_s = newest_s + (stretch.first - int(tracked.sample[0])) / lines.rate_hz
        message = Message(
            "dry friction stops the axis at standstill or reversal: {unexplained_percent:.0f} % of its output "
            "differs from the response in motion; responses are invalid until it has moved for two windows",
            unexplained_percent=100 * stretch.unexplained,
        )
        self._events.append(Event("held", stretch.first, time_s, message, {"unexplained": stretch.unexplained}))


def turns(left: Residual, chunk: Chunk, first: int) -> NDArray[np.int64]:
    """Numbers of the samples, from `first` on, at which motor or cart reverses or is nearly at standstill."""
    begin, end = first - chunk.start, chunk.stop - chunk.start
    changes = np.zeros(max(end - begin - 1, 0), dtype=np.bool_)
    for velocity in (chunk.y[begin:end], left.cart[begin:end]):
        forward, speed = velocity > 0, np.abs(velocity)
        changes |= (forward[1:] != forward[:-1]) | (speed[1:] < _SLOW * np.max(speed, initial=0.0))
    return np.asarray(first + 1 + np.flatnonzero(changes), dtype=np.int64)


def without(velocity: Floats, held: list[StandstillStretch], chunk: Chunk, window: int) -> Floats:
    """The residual with NaN where friction stops the axis and a window to either side: its drift has a kink there."""
    left = velocity.copy()
    for stretch in held:
        left[max(stretch.first - window - chunk.start, 0) : max(stretch.last + window + 1 - chunk.start, 0)] = np.nan
    return left
