"""[experiments]: the experiments that separate the inputs of a matrix of responses."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from livebode.configuration.section import ConfigurationSection


class ExperimentsSection(ConfigurationSection):
    """[experiments]: the experiments that separate the inputs of a matrix, one after the other, repeatedly.

    Parameters
    ----------
    number
        Number of different experiments before they repeat. Default: as many as excitations, with "direct" as inputs.
    dwell_periods
        Periods of an experiment. Default: 2, with a single experiment 1.
    settle_periods
        Periods at its beginning that contain the transient from the experiment before it, and are not used. Default: 1,
        with a single experiment 0.
    start
        Number of the first sample of an experiment.
    memory
        Repetitions of all experiments that are remembered: those that the noise is estimated from.
    condition_max
        Condition number of the inputs over the experiments beyond which they are not separated.
    """

    number: Annotated[int, Field(ge=1, le=64)] | None = None
    dwell_periods: Annotated[int, Field(ge=1, le=1000)] | None = None
    settle_periods: Annotated[int, Field(ge=0, le=999)] | None = None
    start: Annotated[int, Field(ge=0, lt=1 << 62)] = 0
    memory: Annotated[int, Field(ge=2, le=1000)] = 8
    condition_max: Annotated[float, Field(ge=1, le=1e12)] = 1e3
