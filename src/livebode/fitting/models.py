"""The models by their names."""

from __future__ import annotations

from typing import Any

from livebode.core import UsageError
from livebode.fitting.chains import Rigid, TwoMass
from livebode.fitting.physical import PhysicalModel
from livebode.fitting.three_mass import ThreeMass
from livebode.fitting.unknown_gain import TwoMassGain

MODELS: dict[str, type[PhysicalModel]] = {m.name: m for m in (Rigid, TwoMass, ThreeMass, TwoMassGain)}


def model_named(name: str, **options: Any) -> PhysicalModel:
    """The model of that name with its options; those that are None are left out.

    Raises
    ------
    UsageError
        If there is no such model, or it has no such option.

    Examples
    --------
    >>> model_named("two-mass", radius_m=0.019).names[:4]
    ('Js', 'mL', 'Keff', 'bs')
    """
    if name not in MODELS:
        raise UsageError(
            "unknown-name",
            f"there is no model {name!r}",
            f"choose {', '.join(MODELS)}",
            argument="model",
            value=name,
            allowed=list(MODELS),
        )
    given = {key: value for key, value in options.items() if value is not None}
    known = getattr(MODELS[name], "__dataclass_fields__", {})
    for key in given:
        if key not in known:
            raise UsageError(
                "conflict",
                f"the model {name!r} does not take {key} = {given[key]!r}",
                "leave it out",
                argument=key,
                value=given[key],
                model=name,
            )
    return MODELS[name](**given)
