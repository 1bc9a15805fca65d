"""Machines that cannot be simulated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class SimulationError(LivebodeError):
    """A machine with these parameters cannot be simulated."""

    area: ClassVar[str] = "simulation"
    codes: ClassVar[Mapping[str, str]] = {
        "diverged": "The simulated machine does not stay finite.",
        "loop-unsupported": "A loop of this form cannot be simulated.",
    }
