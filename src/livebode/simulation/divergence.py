"""The end of a simulation whose state left all bounds."""

from __future__ import annotations

from collections.abc import Sequence

from livebode.core import SimulationError


def diverged(time_s: float, state: Sequence[float], why: str) -> SimulationError:
    """The error for a simulated machine with this state at this time."""
    values = [float(value) for value in state]
    numbers = ", ".join(f"{value:.6g}" for value in values)
    return SimulationError(
        "diverged",
        f"the simulation stopped at {time_s:.6f} s, where {why} ({numbers})",
        "lower the gains, the delay or the amplitude",
        time_s=time_s,
        state=values,
    )
