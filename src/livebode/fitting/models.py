"""The models by their names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from livebode.core import UsageError
from livebode.fitting.physical import PhysicalModel
from livebode.plugins import loaded, named

MODELS: Mapping[str, str] = {
    "rigid": "livebode.fitting.chains:Rigid",
    "two-mass": "livebode.fitting.chains:TwoMass",
    "three-mass": "livebode.fitting.chains:ThreeMass",
    "two-mass-gain": "livebode.fitting.chains:TwoMassGain",
}
"""livebode's models by name, each with "module:name" of its class, a `PhysicalModel`."""


def model_named(name: str, **options: Any) -> PhysicalModel:
    """The model of that name with its options; options that are None are omitted.

    Raises
    ------
    UsageError
        If there is no such model, or it has no such option.

    Examples
    --------
    >>> model_named("two-mass", radius_m=0.019).names[:4]
    ('Js', 'mL', 'Keff', 'bs')
    """
    models = named("models")
    if name not in models:
        raise UsageError(
            "unknown-name",
            f"there is no model {name!r}",
            f"choose {', '.join(models)}",
            argument="model",
            value=name,
            allowed=list(models),
        )
    given = {key: value for key, value in options.items() if value is not None}
    model: type[PhysicalModel] = loaded(models[name])
    known = getattr(model, "__dataclass_fields__", {})
    for key in given:
        if key not in known:
            raise UsageError(
                "conflict",
                f"the model {name!r} has no option {key} = {given[key]!r}",
                "leave it out",
                argument=key,
                value=given[key],
                model=name,
            )
    return model(**given)
