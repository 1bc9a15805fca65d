"""A model extended by effects of a real machine: a lag, a further mode, the compliance of modes above the band."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.fitting.physical import EvaluationGrid, Parameter, PhysicalModel
from livebode.fitting.polynomials import plus, times
from livebode.language import Message

LAG, RESIDUAL, MODE = "lag", "residual compliance", "further mode"
BEYOND = 3.0
"""Frequency of the mode that represents all modes above the band, over the highest line."""

START_DAMPING = 0.03
"""Damping ratio of a further mode whose damping the lines do not show."""

_BEYOND_DAMPING = 0.05
_SHOWN = 0.1  # of |G| at the highest line
WORDS = {
    "delay": Message("a delay"),
    "B": Message("viscous friction at the motor (B)"),
    "BL": Message("viscous friction at the load (BL)"),
    LAG: Message("a lag"),
    RESIDUAL: Message("the compliance of modes above the band"),
    MODE: Message("a further mode"),
}
"""Effects that a model may lack."""


@dataclass(frozen=True)
class ExtendedModel(PhysicalModel):
    """A model G and some of: a lag behind it, G/(1 + s·lag); a further mode, G + mode_gain·s/(s² + 2ζωs + ω²); the
    compliance of modes above the band, the same with ω at three times the highest line.

    The last two are over s for a position. At the motor their gains are not negative. Its own parameters keep their
    meaning: rigid body and first mode (or modes), which those of a chain with one more mass would not.

    Parameters
    ----------
    base
        The model.
    extras
        Of "lag", "residual compliance", "further mode".
    top_hz
        Highest line.

    Examples
    --------
    >>> from livebode.fitting import TwoMass
    >>> ExtendedModel(TwoMass(), ("lag",), 120.0).names[-2:]
    ('delay', 'lag')
    """

    base: PhysicalModel
    extras: tuple[str, ...]
    top_hz: float

    @property
    def name(self) -> str:  # type: ignore[override]
        extras = Message.conjunction(WORDS[extra] for extra in self.extras)
        return Message("{model} with {extras}", model=self.base.name, extras=extras)

    @property
    def frictions(self) -> tuple[str, ...]:  # type: ignore[override]
        return self.base.frictions

    @property
    def parameters(self) -> tuple[Parameter, ...]:  # type: ignore[override]
        least = 0.0 if getattr(self.base, "side", "motor") == "motor" else -inf
        own = {
            LAG: (Parameter("lag", "s", 1e-4, 1e-6, 1.0),),
            RESIDUAL: (Parameter("residual_compliance", "rad per unit of input", 0.0, least, inf),),
            MODE: (
                Parameter("mode", "Hz", 1.5 * self.top_hz, 1e-4, 1e6),
                Parameter("mode_damping", "", START_DAMPING, 1e-6, 2.0),
                Parameter("mode_gain", Message("rad/s² per unit of input"), 0.0, least, inf),
            ),
        }
        return (*self.base.parameters, *(p for extra in self.extras for p in own[extra]))

    def transfer(self, *parameters: Any) -> tuple[list[Any], list[Any]]:
        own = [p.name for p in self.parameters[len(self.base.parameters) :]]
        values = dict(zip(own, parameters[len(parameters) - len(own) :]))
        above, below = (list(part) for part in self.base.transfer(*parameters[: len(parameters) - len(own)]))
        for omega, damping, gain in self._modes(values):
            mode = [1.0, 2 * damping * omega, omega**2]
            moved = [gain, 0.0] if getattr(self.base, "output", "velocity") == "velocity" else [gain]
            above, below = plus(times(above, mode), times(moved, below)), times(below, mode)
        if LAG in self.extras:
            below = times([values["lag"], 1.0], below)
        return above, below

    def _modes(self, values: dict[str, Any]) -> list[tuple[Any, Any, Any]]:
        """ω, ζ and gain of each that is added."""
        modes: list[tuple[Any, Any, Any]] = []
        if RESIDUAL in self.extras:
            omega = 2 * np.pi * BEYOND * self.top_hz
            modes.append((omega, _BEYOND_DAMPING, values["residual_compliance"] * omega**2))
        if MODE in self.extras:
            modes.append((2 * np.pi * values["mode"], values["mode_damping"], values["mode_gain"]))
        return modes

    @property
    def derived_names(self) -> tuple[str, ...]:
        return self.base.derived_names

    @property
    def derived_units(self) -> tuple[str, ...]:
        return self.base.derived_units

    def derived(self, values: Floats) -> Floats:
        return self.base.derived(values[..., : len(self.base.names)])

    def shown(self, values: Floats, grid: EvaluationGrid) -> Floats:
        own = len(self.base.names)
        visible = np.concatenate([self.base.shown(values[..., :own], grid), values[..., own:]], axis=-1)
        top = grid._replace(frequency_hz=np.array([self.top_hz]))
        position = 1 if getattr(self.base, "output", "velocity") == "velocity" else 0
        size = _SHOWN * np.abs(self.base.at(values[..., :own], top)[..., 0]) / (2 * np.pi * self.top_hz) ** position
        for name, scale in (("residual_compliance", 1.0), ("mode_gain", None)):
            if name in self.names:
                square = scale or (2 * np.pi * values[..., self.names.index("mode")]) ** 2
                visible[..., self.names.index(name)] = size * square
        return visible

    def starts(self, value: Complex, weight: Floats, grid: EvaluationGrid) -> Floats:
        first = self.base.starts(value, weight, grid)
        added = np.array([p.start for p in self.parameters[len(self.base.parameters) :]])
        return self.shown(
            np.concatenate([first, np.broadcast_to(added, (*first.shape[:-1], added.size))], axis=-1), grid
        )
