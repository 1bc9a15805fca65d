"""[output_only]: modes from the outputs alone."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from livebode.configuration.section import ConfigurationSection, Positive

OUTPUTS_MAX = 8
"""Most outputs of an output-only run."""


class OutputOnlySection(ConfigurationSection):
    """[output_only]: the modes are tracked from the output alone, also if the section is empty; there is no response.

    Parameters
    ----------
    others
        Channels of further outputs, measured at the same time as signals.output.
    band_hz
        Lowest and highest frequency of the modes, in Hz. Default: from a fortieth of the upper limit to 1.25 times the
        frequency below which 99 % of the output's power is.
    """

    others: Annotated[list[str], Field(max_length=OUTPUTS_MAX - 1)] = []
    band_hz: Annotated[list[Positive], Field(min_length=2, max_length=2)] | None = None
