"""A model over the position: JSON, MATLAB (gridded state space), NetCDF, and C with interpolation."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from livebode.arrays import Floats
from livebode.core import Parameters, UsageError, needing
from livebode.dataclass import dataclass
from livebode.export.matlab import VARIABLE
from livebode.export.result import WriteResult

_STATES = ("motor angle", "motor speed", "load", "load speed")


@dataclass(frozen=True, eq=False)
class LpvModel:
    """Two masses whose parameters follow the schedule, on a grid of its values.

    Between grid points the parameters are interpolated linearly; outside they are those of the nearest point.

    Parameters
    ----------
    parameters
        Of the two-mass model, a valid row for each place, ascending in the schedule.
    output, side
        Measured quantity ("velocity" or "position") and where ("motor" or "load").
    radius_m
        Of the pulley of a load in linear motion; None for one that turns.

    Raises
    ------
    UsageError
        If the model is not that of two masses, or there is no schedule with two places or more.
    """

    parameters: Parameters
    output: str = "velocity"
    side: str = "motor"
    radius_m: float | None = None

    def __post_init__(self) -> None:
        missing = {"Js", "Keff", "bs"} - set(self.parameters.names)
        if missing or len(self.parameters.names) != len(self.names):
            raise UsageError(
                "not-one-of",
                f"the model {self.parameters.model!r} has no state space over the position",
                "set fit.model to two-mass",
                argument="parameters",
                value=self.parameters.model,
            )
        at = self.position
        if at.size < 2 or not np.all(np.diff(at) > 0):
            raise UsageError(
                "wrong-shape",
                f"the run has {at.size} place(s) with a fit, and a model over the position needs two or more",
                "set signals.schedule to the position, and move the axis",
                argument="parameters",
                shape=[int(at.size)],
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters: Js, JL or mL, Keff, bs, B, BL, delay."""
        return ("Js", "mL" if "mL" in self.parameters.names else "JL", "Keff", "bs", "B", "BL", "delay")

    @property
    def position(self) -> Floats:
        """The grid, shape (places,)."""
        return self.parameters.schedule

    def at(self, position: float) -> Floats:
        """Parameters by linear interpolation, shape (parameters,)."""
        return np.array([np.interp(position, self.position, row) for row in self.parameters.value.T])

    def matrices(self) -> tuple[Floats, Floats, Floats]:
        """A (4, 4, places), B (4, 1, places), C (1, 4, places): torque to output, without the delay.

        States: motor angle and speed, load position (or angle) and speed; equations (11) and (12) of Nevaranta 2016
        with friction of motor and load.
        """
        js, load, k, b, motor_friction, load_friction, _ = self.parameters.only(self.names).value.T
        r, zero, one = self.radius_m or 1.0, np.zeros(js.size), np.ones(js.size)
        a = np.array(
            [
                [zero, one, zero, zero],
                [-(r**2) * k / js, -(r**2 * b + motor_friction) / js, r * k / js, r * b / js],
                [zero, zero, zero, one],
                [r * k / load, r * b / load, -k / load, -(b + load_friction) / load],
            ]
        )
        c = np.zeros((1, 4, js.size))
        c[0, 2 * (self.side == "load") + (self.output == "velocity")] = 1.0
        return a, np.array([zero, 1 / js, zero, zero])[:, np.newaxis], c

    def plain(self) -> dict[str, Any]:
        """For JSON: the grid, and at each point the parameters with their covariance."""
        parameters = self.parameters
        return {
            "model": parameters.model, "output": self.output, "side": self.side, "radius_m": self.radius_m,
            "interpolation": "linear", "names": list(parameters.names), "units": list(parameters.units),
            "position": self.position.tolist(), "value": parameters.value.tolist(),
            "covariance": parameters.covariance.tolist(),
        }  # fmt: skip


def write_lpv_json(path: Path, model: LpvModel) -> WriteResult:
    """Write grid, parameters and covariance as JSON."""
    path.write_text(json.dumps(model.plain(), indent=1) + "\n", encoding="utf-8")
    return WriteResult(model.position.size)


def write_lpv_mat(path: Path, model: LpvModel) -> WriteResult:
    """Write a struct `livebode` whose A, B, C, D (…, places) are those of an array of state spaces: ``ss(A, B, C, D)``.

    Also ``position`` (1, places), ``delay`` (1, places) in seconds for `InputDelay`, ``value`` (parameters, places),
    ``covariance`` (parameters, parameters, places), ``names`` and ``units``.
    """
    with needing("SciPy", "analysis", "an export for MATLAB"):
        from scipy.io import savemat

    a, b, c = model.matrices()
    found = model.parameters
    struct = {
        "A": a, "B": b, "C": c, "D": np.zeros((1, 1, model.position.size)),
        "position": model.position[np.newaxis], "delay": found["delay"][np.newaxis],
        "value": found.value.T, "covariance": np.moveaxis(found.covariance, 0, -1),
        "names": np.array(found.names, dtype=object), "units": np.array(found.units, dtype=object),
        "states": np.array(_STATES, dtype=object),
    }  # fmt: skip
    savemat(path, {VARIABLE: struct}, appendmat=False, do_compression=True)
    return WriteResult(model.position.size)


def write_lpv_netcdf(path: Path, model: LpvModel) -> WriteResult:
    """Write value and covariance over position and parameter as NetCDF 3, which xarray opens."""
    with needing("xarray", "xarray", "NetCDF"):
        import xarray as xr

    found, names = model.parameters, list(model.parameters.names)
    dataset = xr.Dataset(
        {
            "value": (("position", "parameter"), found.value),
            "covariance": (("position", "parameter", "other"), found.covariance),
            "unit": (("parameter",), list(found.units)),
        },
        {"position": model.position, "parameter": names, "other": names},
        {key: str(value) for key, value in model.plain().items() if key in ("model", "output", "side", "radius_m")},
    )
    dataset.to_netcdf(path, format="NETCDF3_64BIT", engine="scipy")
    return WriteResult(model.position.size)


def write_lpv_c(path: Path, model: LpvModel) -> WriteResult:
    """Write a C99 header with the grid and a function that interpolates every parameter linearly."""
    found = model.parameters
    rows = ",\n".join("    {" + ", ".join(f"{float(x)!r}" for x in row) + "}" for row in found.value)
    sigmas = ",\n".join("    {" + ", ".join(f"{float(x)!r}" for x in row) + "}" for row in found.sigma)
    units = ", ".join(f"{name} ({unit})" if unit else name for name, unit in zip(found.names, found.units))
    enum = ", ".join(f"LIVEBODE_{name.upper()}" for name in found.names)
    shape = f"[{model.position.size}][{len(found.names)}]"
    path.write_text(
        f"/* Two masses over the position: {units}. */\n#ifndef LIVEBODE_LPV_H\n#define LIVEBODE_LPV_H\n\n"
        f"enum {{ {enum}, LIVEBODE_PARAMETERS }};\n#define LIVEBODE_PLACES {model.position.size}\n"
        f"static const double livebode_position[{model.position.size}] = "
        f"{{{', '.join(f'{x!r}' for x in model.position.tolist())}}};\n"
        f"static const double livebode_value{shape} = {{\n{rows}\n}};\n"
        f"static const double livebode_sigma{shape} = {{\n{sigmas}\n}};\n\n"
        "/* Every parameter at a position: linear between two places, constant beyond the first and the last. */\n"
        "static inline void livebode_at(double position, double found[LIVEBODE_PARAMETERS])\n{\n"
        "    int i = 0;\n"
        "    while (i < LIVEBODE_PLACES - 2 && position > livebode_position[i + 1]) {\n        i++;\n    }\n"
        "    double share = (position - livebode_position[i]) / (livebode_position[i + 1] - livebode_position[i]);\n"
        "    share = share < 0.0 ? 0.0 : share > 1.0 ? 1.0 : share;\n"
        "    for (int p = 0; p < LIVEBODE_PARAMETERS; p++) {\n"
        "        found[p] = livebode_value[i][p] + share * (livebode_value[i + 1][p] - livebode_value[i][p]);\n"
        "    }\n}\n\n#endif\n",
        encoding="utf-8",
    )
    return WriteResult(model.position.size)
