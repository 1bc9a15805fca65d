"""xarray: responses with their coordinates, and the same as NetCDF."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from livebode.core import ExtraError, Responses
from livebode.export.written import Written, whole

if TYPE_CHECKING:
    import xarray

_NAMES = {
    "response": "complex frequency response",
    "sigma": "standard deviation, E|estimate - truth|^2 = sigma^2",
    "coherence": "coherence",
    "valid": "whether the window allows an estimate at this line",
    "dof": "complex degrees of freedom of sigma",
    "schedule": "scheduling signal at time_s",
    "first": "number of the oldest sample in the window",
    "sample": "number of the newest sample in the window",
    "time_s": "centre of the window",
    "frequency_hz": "line",
}


def to_xarray(responses: Responses, about: Mapping[str, Any] | None = None) -> xarray.Dataset:
    """Responses as an xarray Dataset (extra `xarray`).

    Dimensions ``time_s`` and ``frequency_hz``, both coordinates; ``schedule``, ``first`` and ``sample`` are
    coordinates along time. Variables ``response`` (complex), ``sigma``, ``coherence`` and ``valid`` over both,
    ``dof`` over time. Each has attributes ``units`` and ``long_name``. The Dataset's attributes are ``quantity``,
    ``rate_hz``, ``window`` and, if `about` (as `Run.summary`) is given, ``run``: run.json as text.

    Raises
    ------
    ExtraError
        If xarray is not installed.
    """
    try:
        import xarray
    except ImportError:
        raise ExtraError(
            "not-installed",
            "xarray is not installed",
            "pip install 'livebode[xarray]'",
            package="xarray",
            extra="xarray",
        ) from None
    both, time = ("time_s", "frequency_hz"), "time_s"
    units = {"response": responses.unit, "sigma": responses.unit, "time_s": "s", "frequency_hz": "Hz"}

    def labelled(dims: str | tuple[str, ...], name: str, values: Any) -> tuple[Any, ...]:
        # In the CF conventions, "1" is the unit of a number without a unit; the schedule's unit is not known.
        attrs = {"long_name": _NAMES[name]} | ({} if name == "schedule" else {"units": units.get(name) or "1"})
        return dims, values, attrs

    per_row = ("time_s", "schedule", "first", "sample")
    coords = {name: labelled(time, name, getattr(responses, name)) for name in per_row}
    coords["frequency_hz"] = labelled("frequency_hz", "frequency_hz", responses.lines.frequency_hz)
    variables = {name: labelled(both, name, getattr(responses, name)) for name in ("sigma", "coherence", "valid")}
    variables |= {"response": labelled(both, "response", responses.value), "dof": labelled(time, "dof", responses.dof)}
    lines = responses.lines
    attrs: dict[str, Any] = {"quantity": responses.quantity, "rate_hz": lines.rate_hz, "window": lines.window}
    if about is not None:
        attrs["run"] = json.dumps(about, ensure_ascii=False)
    return xarray.Dataset(variables, coords, attrs)


def write_netcdf(path: Path, parts: Iterable[Responses], about: Mapping[str, Any] | None = None) -> Written:
    """Write responses as NetCDF 3 with 64-bit offsets, which needs no other library (extra `xarray`).

    As `to_xarray`, but NetCDF 3 has neither complex numbers nor 64-bit integers: ``response`` is ``response_re`` and
    ``response_im``, and sample numbers are doubles.

    Raises
    ------
    ExtraError
        If xarray is not installed.
    RecordError
        If there are no responses.
    OutputError
        If there are more values than `VALUES_MAX`.
    """
    responses = whole(parts, "netcdf")
    dataset = to_xarray(responses, about)
    response = dataset["response"]
    dataset = dataset.drop_vars("response").assign(response_re=response.real, response_im=response.imag)
    for part, name in (("real", "response_re"), ("imaginary", "response_im")):
        dataset[name].attrs = response.attrs | {"long_name": f"{part} part of the {_NAMES['response']}"}
    for name in ("first", "sample"):
        dataset[name] = dataset[name].astype(np.float64, keep_attrs=True)
    dataset.to_netcdf(path, format="NETCDF3_64BIT", engine="scipy")
    return Written(len(responses))
