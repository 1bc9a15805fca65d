"""[record]: a record in segments."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from livebode.configuration.section import ConfigurationSection

BUDGET_BYTES_MIN = 16 << 20


class RecordSection(ConfigurationSection):
    """[record]: the run is recorded in segments that survive a kill, also if the section is empty.

    Parameters
    ----------
    samples
        Also record the raw samples of the channels in use.
    budget_bytes
        Maximum size of the record in bytes: the oldest segments are removed, events never. Default: no limit.
    segment_s
        Machine time in one segment, in seconds.
    """

    samples: bool = False
    budget_bytes: Annotated[int, Field(ge=BUDGET_BYTES_MIN)] | None = None
    segment_s: Annotated[float, Field(gt=0, le=86400)] = 300.0
