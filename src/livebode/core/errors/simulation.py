"""Machines that cannot be simulated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class SimulationError(LivebodeError):
    """A machine with these parameters cannot be simulated.

    Examples
    --------
    >>> import livebode
    >>> import numpy as np
    >>> axis = livebode.BeltAxis(excitation_n_m=1e9 * np.ones(400), seconds=0.1)
    >>> try:
    ...     livebode.SimulatedAxis(axis).run()
    ... except livebode.SimulationError as error:
    ...     print(error.code)
    simulation.diverged
    """

    area: ClassVar[str] = "simulation"
    codes: ClassVar[Mapping[str, str]] = {
        "diverged": "The simulated machine does not stay finite.",
        "fmu-unusable": "The FMU cannot be read, started, or simulated on this computer.",
        "loop-unsupported": "A loop of this form cannot be simulated.",
        "parameters-impossible": "No machine has these parameters together.",
        "stroke-beyond-machine": "The stroke with its overrun reaches beyond the pulleys.",
        "unstable": "The closed loop is unstable.",
    }
