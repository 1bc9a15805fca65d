"""NetCDF of matrices: entries with their coordinates and their covariance."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from livebode.core import MatrixResponses
from livebode.export.result import WriteResult, whole

_COMPLEX = ("response", "noise", "spread")


def write_matrix_netcdf(
    path: Path, parts: Iterable[MatrixResponses], about: Mapping[str, Any] | None = None
) -> WriteResult:
    """Write matrices as NetCDF 3 with 64-bit offsets, which needs no other library (extra `xarray`).

    As `MatrixResponses.to_xarray`, with run.json (`about`) as the attribute ``run``; but NetCDF 3 has neither complex
    numbers nor 64-bit integers: ``response``, ``noise`` and ``spread`` are pairs such as ``response_re`` and
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
    dataset = responses.to_xarray()
    if about is not None:
        dataset.attrs["run"] = json.dumps(about, ensure_ascii=False)
    for name in _COMPLEX:
        both = dataset[name]
        for part, values, words in (("re", both.real, "real"), ("im", both.imag, "imaginary")):
            dataset[f"{name}_{part}"] = values
            dataset[f"{name}_{part}"].attrs = both.attrs | {"long_name": f"{words} part of the {both.long_name}"}
    dataset = dataset.drop_vars(_COMPLEX)
    for name in ("first", "sample"):
        dataset[name] = dataset[name].astype(np.float64, keep_attrs=True)
    dataset.to_netcdf(path, format="NETCDF3_64BIT", engine="scipy")
    return WriteResult(len(responses))
