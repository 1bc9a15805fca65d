"""ExtendedModel: a model and the effects that a machine has beside it."""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.dataclass import dataclass
from livebode.fitting.physical import EvaluationGrid, Parameter, PhysicalModel, plus, times
from livebode.fitting.transfer import Transfer, roots
from livebode.language import Message

LAG, RESIDUAL, MODE, COUPLING = "lag", "residual compliance", "further mode", "mode coupling"
BEYOND = 3.0
"""Frequency of the mode that represents all modes above the band, over the highest line."""

START_DAMPING = 0.03
"""Damping ratio of a further mode whose damping the lines do not show."""

_BEYOND_DAMPING = 0.05  # of a mode above the band, of which only the compliance shows
_SHOWN = 0.1  # of |G| at the highest line
WORDS = {
    "delay": Message("a delay"),
    "B": Message("viscous friction at the motor (B)"),
    "BL": Message("viscous friction at the load (BL)"),
    LAG: Message("a lag"),
    RESIDUAL: Message("the compliance of modes above the band"),
    MODE: Message("a further mode"),
    COUPLING: Message("damping that couples both modes"),
}
"""Effects that a model may lack."""


@dataclass(frozen=True)
class ExtendedModel(PhysicalModel):
    """A model G and some of: a lag behind it, G/(1 + s·lag); a further mode, G + mode_gain·s/(s² + 2ζωs + ω²); the
    compliance of modes above the band, the same with ω at three times the highest line; the coupling of two masses' own
    mode with the further one, by dampers that do not divide as the springs do: −mode_coupling·s²·ω²/((s² + 2ζ₁ω₁s +
    ω₁²)·(s² + 2ζωs + ω²)), to first order in the dampings.

    All but the first are over s for a position. At the motor the gains are not negative. Its own parameters keep their
    meaning: rigid body and first mode (or modes), which those of a chain with one more mass would not.

    Parameters
    ----------
    base
        The model.
    extras
        Of "lag", "residual compliance", "further mode", "mode coupling"; the last needs the further mode.
    top_hz
        Highest line.
    unnamed
        Those of `extras` that the lines do not show, but do not rule out either: they are only part of the bounds.

    Examples
    --------
    >>> from livebode.fitting import TwoMass
    >>> ExtendedModel(TwoMass(), ("lag",), 120.0).names[-2:]
    ('delay', 'lag')
    """

    base: PhysicalModel
    extras: tuple[str, ...]
    top_hz: float
    unnamed: tuple[str, ...] = ()

    @property
    def name(self) -> str:  # type: ignore[override]
        named = [extra for extra in self.extras if extra not in self.unnamed]
        if not named:
            return self.base.name
        extras = Message.conjunction(WORDS[extra] for extra in named)
        return Message("{model} with {extras}", model=self.base.name, extras=extras)

    @property
    def frictions(self) -> tuple[str, ...]:  # type: ignore[override]
        return self.base.frictions

    @property
    def parameters(self) -> tuple[Parameter, ...]:  # type: ignore[override]
        least = 0.0 if getattr(self.base, "side", "motor") == "motor" else -inf
        own_gain: str = getattr(self.base, "gain_unit", "")
        effort = ("m", "N") if getattr(self.base, "linear", False) else ("rad", "(N m)")  # of masses in SI units
        gain = own_gain or f"{effort[0]}/s²/{effort[1]}"
        compliance = f"{gain} s²" if own_gain else f"{effort[0]}/{effort[1]}"
        mobility = f"{gain} s" if own_gain else f"{effort[0]}/s/{effort[1]}"
        own = {
            LAG: (Parameter("lag", "s", 1e-4, 1e-6, 1.0),),
            RESIDUAL: (Parameter("residual_compliance", compliance, 0.0, least, inf),),
            MODE: (
                Parameter("mode", "Hz", 1.5 * self.top_hz, 1e-4, 1e6),
                Parameter("mode_damping", "", START_DAMPING, 1e-6, 2.0),
                Parameter("mode_gain", gain, 0.0, least, inf),
            ),
            COUPLING: (Parameter("mode_coupling", mobility, 0.0, -inf, inf),),
        }
        return (*self.base.parameters, *(p for extra in self.extras for p in own[extra]))

    def transfer(self, *parameters: Any) -> tuple[list[Any], list[Any]]:
        own = [p.name for p in self.parameters[len(self.base.parameters) :]]
        values = dict(zip(own, parameters[len(parameters) - len(own) :]))
        above, below = (list(part) for part in self.base.transfer(*parameters[: len(parameters) - len(own)]))
        coupled: list[Any] = []
        if COUPLING in self.extras:  # s³ over the masses' own denominator is s² over their mode, but for friction
            coupled = [-values["mode_coupling"] * (2 * np.pi * values["mode"]) ** 2 * below[0], 0.0, 0.0, 0.0]
        for omega, damping, gain in self._modes(values):
            mode = [1.0, 2 * damping * omega, omega**2]
            moved = [gain, 0.0] if getattr(self.base, "output", "velocity") == "velocity" else [gain]
            above, below = plus(times(above, mode), times(moved, below)), times(below, mode)
            if coupled:
                above, coupled = plus(above, coupled), []
        if LAG in self.extras:
            below = times([values["lag"], 1.0], below)
        return above, below

    def _transfer(self, p: Floats) -> Transfer:
        """With the poles of its parts, which are exact where those of the product lose digits."""
        own = len(self.base.names)
        values = {name: p[..., own + i] for i, name in enumerate(self.names[own:])}
        parts: list[Any] = [self.base._transfer(p[..., :own]).poles()]
        for omega, damping, _ in self._modes(values):
            squared = np.broadcast_to(np.asarray(omega**2), p.shape[:-1])
            twice = np.broadcast_to(np.asarray(2 * damping * omega), p.shape[:-1])
            parts.append(roots(np.stack([np.ones_like(squared), twice, squared], axis=-1)))
        if LAG in self.extras:
            parts.append(-1 / values["lag"][..., np.newaxis] + 0j)
        return super()._transfer(p)._replace(known=np.concatenate(parts, axis=-1))

    def _modes(self, values: dict[str, Any]) -> list[tuple[Any, Any, Any]]:
        """ω, ζ and gain of each that is added, the further mode first."""
        modes: list[tuple[Any, Any, Any]] = []
        if MODE in self.extras:
            modes.append((2 * np.pi * values["mode"], values["mode_damping"], values["mode_gain"]))
        if RESIDUAL in self.extras:
            omega = 2 * np.pi * BEYOND * self.top_hz
            modes.append((omega, _BEYOND_DAMPING, values["residual_compliance"] * omega**2))
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
        if "mode_coupling" in self.names:
            visible[..., self.names.index("mode_coupling")] = size * 2 * np.pi * self.top_hz
        return visible

    def starts(self, value: Complex, weight: Floats, grid: EvaluationGrid) -> Floats:
        first = self.base.starts(value, weight, grid)
        added = np.array([p.start for p in self.parameters[len(self.base.parameters) :]])
        return self.shown(
            np.concatenate([first, np.broadcast_to(added, (*first.shape[:-1], added.size))], axis=-1), grid
        )
