"""What tune.json contains."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, FiniteFloat, PositiveFloat

from livebode.configuration import LoopSection
from livebode_control.tuning import LoopSpecification


class StoredNotch(BaseModel):
    """A notch of a proposal."""

    frequency_hz: PositiveFloat
    depth_db: FiniteFloat
    damping: PositiveFloat


class StoredProposal(BaseModel):
    """What was asked for, and the controller and the filters that were proposed.

    Attributes
    ----------
    specification, loop, entry
        What `livebode tune` was called with.
    controller
        Its parameters.
    notches, low_passes_hz
        Filters in series with the innermost controller.
    """

    model_config = ConfigDict(allow_inf_nan=False)

    specification: LoopSpecification
    controller: dict[str, Any]
    notches: list[StoredNotch]
    low_passes_hz: list[PositiveFloat]
    loop: LoopSection | None = None
    entry: str | None = None
