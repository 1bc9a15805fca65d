"""[fit]: the model that is fitted to every response."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from livebode.configuration.section import ConfigurationSection, Positive


class FitSection(ConfigurationSection):
    """[fit]: with this section a model is fitted to every response.

    Parameters
    ----------
    model
        The model. "auto": two-mass if the input is a torque or radius_m is given, otherwise two-mass-gain; that also
        where a unit is recognised and not SI (rpm, mN m).
    output
        What the output is. "auto": by its kind, velocity if it has neither a unit nor a kind.
    side
        Where the output is measured: "motor" or "load". Default: motor.
    radius_m
        Radius of a belt's pulley in metres: the load is then a mass in kg, without it an inertia in kg m².
    inertia_ratio
        Load inertia divided by motor inertia, if known.
    fixed
        Parameters with a fixed value, such as { Js = 0.0028 }, in the unit of the parameter.
    free
        Parameters to fit that are fixed by default: "delay", "B", "BL".
    band_hz
        Lowest and highest frequency of the lines that are fitted, in Hz. Default: all lines.
    hold
        Hold of the sampled plant: "zero-order", the input is constant between samples; "none" for the
        response of a plant without a sampling hold.
    """

    model: str = "auto"
    output: Literal["auto", "velocity", "position"] = "auto"
    side: Literal["motor", "load"] | None = None
    radius_m: Positive | None = None
    inertia_ratio: Positive | None = None
    fixed: dict[str, float] = {}
    free: list[str] = []
    band_hz: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None
    hold: Literal["zero-order", "none"] = "zero-order"
