"""Responses as objects of pandas, xarray and python-control, which are imported when they are used."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.core.optional_packages import not_installed

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

    from livebode.core._response import Response, Responses

_NAMES = {
    "response": "complex frequency response",
    "sigma": "standard deviation, E|estimate - truth|^2 = sigma^2",
    "coherence": "coherence",
    "valid": "whether the window allows an estimate at this line",
    "dof": "complex degrees of freedom of sigma",
    "schedule": "scheduling signal at time_s",
    "first": "number of the oldest sample in the window",
    "sample": "number of the newest sample in the window",
    "ready": "whether the machine was ready in the whole window",
    "time_s": "centre of the window",
    "frequency_hz": "line",
}


def imported(package: str, extra: str, shown: str = "") -> Any:
    """The optional package; ExtraError with the extra that installs it."""
    try:
        return import_module(package)
    except ImportError:
        raise not_installed(f"{shown or package} is not installed", package=package, extra=extra) from None


def dataset(responses: Responses) -> Dataset:
    """For `FrequencyResponse.to_xarray`."""
    xarray = imported("xarray", "xarray")
    both, time = ("time_s", "frequency_hz"), "time_s"
    units = {"response": responses.unit, "sigma": responses.unit, "time_s": "s", "frequency_hz": "Hz"}

    def labelled(dims: str | tuple[str, ...], name: str, values: Any) -> tuple[Any, ...]:
        # In the CF conventions, "1" is the unit of a number without a unit; the schedule's unit is not known.
        attrs = {"long_name": _NAMES[name]} | ({} if name == "schedule" else {"units": units.get(name) or "1"})
        return dims, values, attrs

    per_row = ("time_s", "schedule", "first", "sample", "ready")
    coords = {name: labelled(time, name, getattr(responses, name)) for name in per_row}
    coords["frequency_hz"] = labelled("frequency_hz", "frequency_hz", responses.frequency_hz)
    variables = {name: labelled(both, name, getattr(responses, name)) for name in ("sigma", "coherence", "valid")}
    variables |= {"response": labelled(both, "response", responses.value), "dof": labelled(time, "dof", responses.dof)}
    converted: Dataset = xarray.Dataset(variables, coords, _about(responses))
    return converted


def frame(responses: Responses) -> DataFrame:
    """For `FrequencyResponse.to_pandas`."""
    pandas = imported("pandas", "pandas")
    columns = {
        "response": responses.value,
        "magnitude_db": responses.magnitude_db,
        "phase_deg": responses.phase_deg,
        "sigma": responses.sigma,
        "coherence": responses.coherence,
        "valid": responses.valid,
    }
    index = pandas.MultiIndex.from_product([responses.time_s, responses.frequency_hz], names=["time_s", "frequency_hz"])
    table: DataFrame = pandas.DataFrame({name: values.ravel() for name, values in columns.items()}, index=index)
    units = {"response": responses.unit, "sigma": responses.unit, "magnitude_db": "dB", "phase_deg": "deg"}
    table.attrs = _about(responses) | {"units": units}
    return table


def frd(response: Response) -> Any:
    """For `Response.to_frd`."""
    control = imported("control", "control", "python-control")
    omega = 2 * np.pi * response.frequency_hz[response.valid]
    # `control.bode_plot` draws no system without a name.
    return control.frd(response.value[response.valid], omega, name=response.quantity)


def _about(responses: Responses) -> dict[str, Any]:
    lines = responses.lines
    return {"quantity": responses.quantity, "rate_hz": lines.rate_hz, "window": lines.window}
