"""[fit]: a model that is fitted to every response, and the fitter of it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Literal, NamedTuple

from livebode import fitting
from livebode.configuration.section import ConfigurationSection, Positive
from livebode.core import SI_UNITS, ConfigError, Field, PlantKinds, UsageError
from livebode.language import Message
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
    """The section's model; "auto" is two masses if their parameters are known in SI units, else with an unknown gain.

    Raises
    ------
    UsageError
        If there is no such model.
    ConfigError
        If the section specifies modes or poles; if it does not specify the output, and its kind is neither a velocity
        nor a position; or if it specifies a model in SI units and one of the units contradicts that.
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
        name = "two-mass-gain" if unknown_gain(section, kinds) else "two-mass"
    elif name != "two-mass-gain" and (doubts := list(_units_not_si(name, section, kinds))):
        raise ConfigError(
            "unit-not-si",
            f"the parameters of fit.model = {name!r} are in SI units, but {_why(doubts)}",
            f"{_remedy(doubts)}, or set fit.model to 'two-mass-gain'",
            key="fit.model",
            value=name,
            unit=doubts[0].unit,
        )
    output = section.output
    if output == "auto":
        output = _output_of(kinds)
    # The gain model is of the motor's side only: naming it is no conflict.
    side = None if name == "two-mass-gain" and section.side == "motor" else section.side
    options: dict[str, Any] = {"side": side, "radius_m": section.radius_m, "inertia_ratio": section.inertia_ratio}
    if name in fitting.MODELS and name != "two-mass-gain" and _is_linear(section, kinds):
        options["linear"] = True
    if name == "two-mass-gain":
        options |= {"output_unit": kinds.output_unit, "input_unit": kinds.input_unit}
    return fitting.model_named(name, output=output, **options)


class _UnitDoubt(NamedTuple):
    """A channel whose unit does not give parameters in SI units: empty, or not that of the quantity that it is."""

    name: str
    unit: str
    quantity: str


_TORQUE_OF = {"%": "0.024 N m", "A": "0.35 N m"}
_ONE_UNIT = {"torque": "0.001 N m", "position": "1/131072 rev", "velocity": "0.1 rpm"}
_UNIT = {"torque": "N m", "position": "rad", "velocity": "rad/s"}


def unknown_gain(section: FitSection, kinds: PlantKinds) -> str:
    """Why "auto" is not two masses with parameters in SI units, and how to get them; empty if it is."""
    if section.model != "auto":
        return ""
    doubts = [*_units_not_si("two-mass", section, kinds), *(_units_unknown(kinds) if section.radius_m is None else ())]
    if _is_linear(section, kinds):
        return ""
    if not doubts and kinds.output_unit in ("m", "m/s") and not (section.radius_m and section.side == "load"):
        why = Message("{channel} is in {unit}", channel=repr(kinds.output_name), unit=kinds.output_unit)
        return _unknown(why, Message("set radius_m and side = 'load' in [fit]"))
    return _unknown(_why(doubts), _remedy(doubts)) if doubts else ""


def _unknown(why: str, remedy: str) -> str:
    return Message(
        "the gain is unknown, so that masses and stiffness are not fitted: {why}; {remedy}", why=why, remedy=remedy
    )


def _is_linear(section: FitSection, kinds: PlantKinds) -> bool:
    """Whether a force moves masses along: a linear motor."""
    return section.radius_m is None and kinds.input_unit == "N" and kinds.output_unit in ("m", "m/s")


def _units_not_si(model: str, section: FitSection, kinds: PlantKinds) -> Iterator[_UnitDoubt]:
    """Of known units that are not those that the model needs."""
    torque = model in fitting.MODELS and not _is_linear(section, kinds)
    if kinds.input_unit and (kinds.input_unit != "N m" if torque else kinds.input_unit not in SI_UNITS):
        yield _UnitDoubt(kinds.input_name, kinds.input_unit, "torque")
    if kinds.output_unit and kinds.output_unit not in SI_UNITS:
        yield _UnitDoubt(kinds.output_name, kinds.output_unit, _motion(kinds))


def _units_unknown(kinds: PlantKinds) -> Iterator[_UnitDoubt]:
    if not kinds.input_unit:
        yield _UnitDoubt(kinds.input_name, "", "torque")
    if not kinds.output_unit:
        yield _UnitDoubt(kinds.output_name, "", _motion(kinds))


def _motion(kinds: PlantKinds) -> str:
    return "position" if kinds.output == "position" else "velocity"


def _why(doubts: Sequence[_UnitDoubt]) -> str:
    return Message.conjunction(
        Message("{channel} is in {unit}", channel=repr(doubt.name), unit=doubt.unit)
        if doubt.unit
        else Message("the unit of {channel} is not known", channel=repr(doubt.name))
        for doubt in doubts
    )


def _remedy(doubts: Sequence[_UnitDoubt]) -> str:
    if doubts[0].unit == "N":
        return Message("a force drives masses only if the output is in m or m/s")
    entries = ", ".join(f'{_toml_key(doubt.name)} = "{_example(doubt)}"' for doubt in doubts)
    return Message("state what one unit is in [source] of axis.toml, as in {units}", units=f"units = {{ {entries} }}")


def _example(doubt: _UnitDoubt) -> str:
    if not doubt.unit:
        return _UNIT[doubt.quantity]
    return (_TORQUE_OF if doubt.quantity == "torque" else {}).get(doubt.unit, _ONE_UNIT[doubt.quantity])


def _toml_key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else f'"{name}"'


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
        The model. "auto": two-mass if, as they are read, the input is a torque in N m and the output in rad or rad/s,
        or a force in N and the output in m or m/s (linear motor), or radius_m is given; otherwise two-mass-gain, and
        the result says why.
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
