"""NetCDF: responses with their coordinates."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import Responses
from livebode.export.result import WriteResult, whole


def write_netcdf(path: Path, parts: Iterable[Responses], about: Mapping[str, Any] | None = None) -> WriteResult:
    """Write responses as NetCDF 3 with 64-bit offsets, which needs no other library (extra `xarray`).

    As `Responses.to_xarray`, with run.json (`about`) as the attribute ``run``; but NetCDF 3 has neither complex numbers
    nor 64-bit integers: ``response`` is ``response_re`` and ``response_im``, and sample numbers are doubles.

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
    dataset = responses.to_xarray()
    if about is not None:
        dataset.attrs["run"] = json.dumps(about, ensure_ascii=False)
    response = dataset["response"]
    dataset = dataset.drop_vars("response").assign(response_re=response.real, response_im=response.imag)
    for part, name in (("real", "response_re"), ("imaginary", "response_im")):
        dataset[name].attrs = response.attrs | {"long_name": f"{part} part of the {response.attrs['long_name']}"}
    for name in ("first", "sample"):
        dataset[name] = dataset[name].astype(np.float64, keep_attrs=True)
    dataset.to_netcdf(path, format="NETCDF3_64BIT", engine="scipy")
    return WriteResult(len(responses))
