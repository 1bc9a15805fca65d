"""From the [fit] section to a model and its Fitter."""

from __future__ import annotations

from typing import Any, Literal

from livebode.configuration.axis import FitSection
from livebode.fitting import Fitter, PhysicalModel, model_named

_POSITIONS = ("rad", "m", "deg", "mm")


def fitter_of(section: FitSection, unit: str) -> Fitter:
    """The section's Fitter for responses of this unit."""
    return Fitter(chosen_model(section, unit), **fit_settings(section))


def check_fit(section: FitSection) -> None:
    """LivebodeError if this model can never be fitted; with "auto" the unit determines the model later."""
    if section.model != "auto":
        fitter_of(section, "")


def chosen_model(section: FitSection, unit: str) -> PhysicalModel:
    """The section's model; "auto" is two masses if the input is a torque, else two masses with an unknown gain."""
    name = section.model
    if name == "auto":
        name = "two-mass" if unit.endswith("/(N m)") or section.radius_m else "two-mass-gain"
    output = section.output
    if output == "auto":
        output = output_of(unit) or "velocity"
    options = {"side": section.side, "radius_m": section.radius_m, "inertia_ratio": section.inertia_ratio}
    return model_named(name, output=output, **options)


def output_of(unit: str) -> Literal["velocity", "position"] | None:
    """Whether a response of this unit leads to a position or a velocity; None where it has no unit.

    >>> output_of("rad/(N m)"), output_of("rad/s/(N m)"), output_of("")
    ('position', 'velocity', None)
    """
    if not unit:
        return None
    return "position" if unit.split("/(")[0] in _POSITIONS else "velocity"


def fit_settings(section: FitSection) -> dict[str, Any]:
    """Keyword arguments of a Fitter or of `fit`."""
    band = None if section.band_hz is None else (section.band_hz[0], section.band_hz[1])
    return {"fixed": section.fixed, "free": section.free, "band_hz": band, "hold": section.hold}
