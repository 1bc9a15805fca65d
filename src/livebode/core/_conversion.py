"""Responses and matrices as objects of pandas, xarray and python-control, which are imported when they are used."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.core.optional_packages import not_installed

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

    from livebode.core._matrix_responses import MatrixResponses
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


_ENTRY = ("time_s", "frequency_hz", "output", "input")
_MATRIX_VARIABLES = {
    "response": ("value", _ENTRY, "complex frequency response"),
    "sigma": ("sigma", _ENTRY, "standard deviation, E|estimate - truth|^2 = sigma^2"),
    "noise": ("noise", (*_ENTRY[:3], "other_output"), "covariance of the noise in the outputs of one window"),
    "spread": ("spread", (*_ENTRY[:2], "input", "other_input"), "covariance of the columns for noise of unit power"),
    "variation": ("variation", _ENTRY, "standard deviation by a change of the machine, part of sigma"),
    "coherence": ("coherence", _ENTRY[:3], "multiple coherence of the output with all inputs"),
    "condition": ("condition", _ENTRY[:2], "condition number of the inputs over the experiments"),
    "valid": ("valid", (*_ENTRY[:2], "input"), "whether the column is valid at this line"),
    "reason": ("reason", (*_ENTRY[:2], "input"), "why the column is invalid"),
    "dof": ("dof", _ENTRY[:1], "complex degrees of freedom of the noise"),
}
"""Attribute, dimensions and long name of each variable."""
_MATRIX_TIMES = {
    "time_s": "mean of the centres of the windows",
    "first": "number of the oldest sample in the windows",
    "sample": "number of the newest sample in the windows",
}


def matrix_dataset(responses: MatrixResponses, reasons: tuple[str, ...]) -> Dataset:
    """For `MatrixResponses.to_xarray`; `reasons` are the words of the numbers in `reason`."""
    xarray = imported("xarray", "xarray")
    variables = {
        name: (dimensions, getattr(responses, attribute), {"long_name": words})
        for name, (attribute, dimensions, words) in _MATRIX_VARIABLES.items()
    }
    variables["reason"][2]["flag_meanings"] = " ".join(word.replace(" ", "_") or "valid" for word in reasons)
    coords: dict[str, Any] = {
        name: ("time_s", getattr(responses, name), {"long_name": words}) for name, words in _MATRIX_TIMES.items()
    }
    coords["time_s"][2]["units"] = "s"
    coords["frequency_hz"] = ("frequency_hz", responses.frequency_hz, {"long_name": "line", "units": "Hz"})
    for kind, names in (("output", responses.outputs), ("input", responses.inputs)):
        coords[kind], coords[f"other_{kind}"] = list(names), list(names)
    if responses.units:
        coords["unit"] = (
            ("output", "input"),
            [list(row) for row in responses.units],
            {"long_name": "of response and sigma"},
        )
    about = {"quantity": "plant", "rate_hz": responses.lines.rate_hz, "window": responses.lines.window}
    converted: Dataset = xarray.Dataset(variables, coords, about)
    return converted


def matrix_frd(responses: MatrixResponses, row: int) -> Any:
    """For `MatrixResponses.to_frd`."""
    control = imported("control", "control", "python-control")
    whole = responses.valid[row].all(axis=1)
    # `control.bode_plot` draws no system without a name.
    return control.frd(
        np.moveaxis(responses.value[row, whole], 0, 2),
        2 * np.pi * responses.frequency_hz[whole],
        inputs=list(responses.inputs),
        outputs=list(responses.outputs),
        name="plant",
    )
