"""Matrices of responses as objects of xarray and python-control, which are imported when they are used."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.core._conversion import imported

if TYPE_CHECKING:
    from xarray import Dataset

    from livebode.core._matrix_responses import MatrixResponses

_ENTRY = ("time_s", "frequency_hz", "output", "input")
_VARIABLES = {
    "response": ("value", _ENTRY, "complex frequency response"),
    "sigma": ("sigma", _ENTRY, "standard deviation, E|estimate - truth|^2 = sigma^2"),
    "noise": ("noise", (*_ENTRY[:3], "other_output"), "covariance of the noise in the outputs of one window"),
    "spread": ("spread", (*_ENTRY[:2], "input", "other_input"), "covariance of the columns for noise of unit power"),
    "coherence": ("coherence", _ENTRY[:3], "multiple coherence of the output with all inputs"),
    "condition": ("condition", _ENTRY[:2], "condition number of the inputs over the experiments"),
    "valid": ("valid", (*_ENTRY[:2], "input"), "whether the column is valid at this line"),
    "reason": ("reason", (*_ENTRY[:2], "input"), "why the column is invalid"),
    "dof": ("dof", _ENTRY[:1], "complex degrees of freedom of the noise"),
}
"""Attribute, dimensions and long name of each variable."""
_TIMES = {
    "time_s": "mean of the centres of the windows",
    "first": "number of the oldest sample in the windows",
    "sample": "number of the newest sample in the windows",
}


def dataset(responses: MatrixResponses, reasons: tuple[str, ...]) -> Dataset:
    """For `MatrixResponses.to_xarray`; `reasons` are the words of the numbers in `reason`."""
    xarray = imported("xarray", "xarray")
    variables = {
        name: (dimensions, getattr(responses, attribute), {"long_name": words})
        for name, (attribute, dimensions, words) in _VARIABLES.items()
    }
    variables["reason"][2]["flag_meanings"] = " ".join(word.replace(" ", "_") or "valid" for word in reasons)
    coords: dict[str, Any] = {
        name: ("time_s", getattr(responses, name), {"long_name": words}) for name, words in _TIMES.items()
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


def frd(responses: MatrixResponses, row: int) -> Any:
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
