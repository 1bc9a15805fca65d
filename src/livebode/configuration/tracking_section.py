"""[tracking]: how responses and their bounds are estimated."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from livebode.configuration.section import ConfigurationSection, Positive
from livebode.core import Quantity


class TrackingSection(ConfigurationSection):
    """[tracking]: how responses and their bounds are estimated.

    Parameters
    ----------
    estimator
        "direct" from input and output, "joint" from both by the excitation, "indirect" from the closed loop and the
        controllers in [loop]. For noise and single chirps, which do not repeat: "lpm" (local polynomial method) or
        "welch".
    quantity
        The response that is estimated: "plant", "open loop", "closed loop" or "sensitivity". All but "plant" need the
        controllers in [loop].
    hop
        Samples between responses. Default: for a recording a twentieth of the window, for a live source 20 responses
        per second; the nearest divisor of the window.
    average
        Average over the previous periods, weighted by forgetting, instead of using only the newest window.
    forgetting
        Weight of a period relative to the next one; 1 forgets nothing.
    noise
        Source of the bounds. "auto": the scatter between periods and, where the schedule moves, the detection lines
        (non-excited bins). "periods": always the scatter. "quiet": the larger of the two at standstill.
    differenced
        Channels that are differenced before the DFT: a position that drifts.
    hann
        Use a Hann window, from three bins; for an axis in motion.
    spikes
        Channels that are checked for spikes; windows with a spike are excluded.
    dtype
        Number format of the kernel; "float32" gives the result of a drive without double precision.
    ripple
        Orders of a torque ripple, such as [[201.0, 0.05]]: cycles per unit of the schedule, and amplitude in the unit
        of the input. The bounds contain it. Default: from the baseline, or found with [motion].
    accept_roles
        Accept the roles in [signals] whatever the recording shows.
    all_periods
        Include a transient at the start of a recording, and periods that differ from those around them.
    """

    estimator: Literal["direct", "joint", "indirect", "lpm", "welch"] = "joint"
    quantity: Quantity = "plant"
    hop: Annotated[int, Field(ge=1)] | None = None
    average: bool = False
    forgetting: Annotated[float, Field(gt=0, le=1)] = 0.8
    noise: Literal["auto", "periods", "quiet"] = "auto"
    differenced: list[str] = []
    hann: bool = False
    spikes: list[str] = []
    dtype: Literal["float64", "float32"] = "float64"
    ripple: list[Annotated[list[Positive], Field(min_length=2, max_length=2)]] = []
    accept_roles: bool = False
    all_periods: bool = False

    @property
    def periodic(self) -> bool:
        """Whether the estimator needs an excitation that repeats."""
        return self.estimator not in ("lpm", "welch")
