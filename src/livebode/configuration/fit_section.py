"""[fit]: a model that is fitted to every response, and the fitter of it."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from livebode import fitting
from livebode.configuration.section import ConfigurationSection, Positive
from livebode.core import ConfigError, PlantKinds, UsageError
from livebode.plugins import named


def fitter_of(section: FitSection, kinds: PlantKinds) -> fitting.Fitter:
    """The section's Fitter for the response of a plant of these kinds; ConfigError as in `chosen_model`."""
    return fitting.Fitter(chosen_model(section, kinds), **fit_settings(section))


def check_fit(section: FitSection) -> None:
    """LivebodeError if this model can never be fitted; with "auto" the kinds determine the model later."""
    if section.model != "auto":
        fitter_of(section, PlantKinds())


def check_model(name: str, *, finished: bool = True) -> None:
    """UsageError if there is no such model, with the names of all; those of poles are for `finished` runs only."""
    models = ["auto", *named("models"), *(fitting.POLE_MODELS if finished else ())]
    if name not in models:
        raise UsageError(
            "unknown-name",
            f"there is no model {name!r}",
            f"choose {', '.join(models)}",
            argument="model",
            value=name,
            allowed=models,
        )


def chosen_model(section: FitSection, kinds: PlantKinds) -> fitting.PhysicalModel:
    """The section's model; "auto" is two masses if the input is a torque, else two masses with an unknown gain.

    With a torque that is not in N m, or an output in rpm or degrees, the gain is unknown too: the parameters of all
    other models are in SI units.

    Raises
    ------
    UsageError
        If there is no such model.
    ConfigError
        If the section specifies modes or poles; if it does not specify the output, and its kind is neither a velocity
        nor a position; or if it specifies a model in SI units and a unit is not one.
    """
    name = section.model
    if name in fitting.POLE_MODELS:
        raise ConfigError(
            "value-invalid",
            f"fit.model = {name!r} is fitted to finished runs only, not to every response",
            "fit the finished run with this model (livebode fit), or choose a model of a drive here",
            key="fit.model",
            value=name,
        )
    check_model(name, finished=False)
    if name == "auto":
        name = "two-mass" if kinds.si and (kinds.input == "torque" or section.radius_m) else "two-mass-gain"
    elif name != "two-mass-gain" and not kinds.si:
        raise ConfigError(
            "unit-not-si",
            f"the parameters of fit.model = {name!r} are in SI units, but one unit of the output is "
            f"{kinds.output_factor:g} and one of the input {kinds.input_factor:g} SI units",
            "set fit.model to 'two-mass-gain', or record rad/s or m/s, and N m",
            key="fit.model",
            value=name,
            output_factor=kinds.output_factor,
            input_factor=kinds.input_factor,
        )
    output = section.output
    if output == "auto":
        output = _output_of(kinds)
    # The gain model is of the motor's side only: naming it is no conflict.
    side = None if name == "two-mass-gain" and section.side == "motor" else section.side
    options = {"side": side, "radius_m": section.radius_m, "inertia_ratio": section.inertia_ratio}
    return fitting.model_named(name, output=output, **options)


def _output_of(kinds: PlantKinds) -> Literal["velocity", "position"]:
    if kinds.output is None:
        return "velocity"
    if kinds.output == "velocity" or kinds.output == "position":
        return kinds.output
    shown = "is not recognised from its unit" if kinds.output == "other" else f"is {kinds.output!r}"
    raise ConfigError(
        "kind-needed",
        f"a model is fitted to a velocity or a position, but the kind of the output {shown}",
        "declare it, as in source.kinds = { y = 'velocity' }, or set fit.output",
        key="source.kinds",
        value=kinds.output,
        allowed=["velocity", "position"],
    )


def fit_settings(section: FitSection) -> dict[str, Any]:
    """Keyword arguments of a Fitter or of `fit`."""
    band = None if section.band_hz is None else (section.band_hz[0], section.band_hz[1])
    return {"fixed": section.fixed, "free": section.free, "band_hz": band, "hold": section.hold}


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
