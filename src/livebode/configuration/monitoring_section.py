"""[monitoring]: comparison with a baseline."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from livebode.configuration.section import ConfigurationSection, File, Positive

Bits = Annotated[int, Field(ge=0, lt=1 << 53)]


class MonitoringSection(ConfigurationSection):
    """[monitoring]: comparison with a baseline.

    Parameters
    ----------
    baseline
        File from `livebode learn`, relative to this file: the run is compared with it. Of a matrix of responses: the
        directory of a matrix run of the healthy machine. Default: none.
    covariates
        Channels on which the parameters of a baseline may depend, such as a temperature; the same in all runs that are
        learned. A run with a baseline uses the covariates of the baseline.
    false_alarm_interval_days
        Mean time between false alarms, at least, in days of judged motion.
    gantry
        Of a matrix of responses: TOML file that describes the machine as a gantry, as of `livebode compare --gantry`,
        relative to this file. An alarm then names the part that changed. Default: none.
    ready_mask
        Bits of signals.ready that are compared with ready_value, if it is a status word: of CiA 402 (object 0x6041)
        ready_mask = 0x6F and ready_value = 0x27 are "operation enabled". Default: all bits.
    ready_value
        Value of these bits if the machine is ready. Default: all of ready_mask.
    """

    baseline: File | None = None
    covariates: Annotated[list[str], Field(max_length=4)] = []
    false_alarm_interval_days: Positive = 30.0
    gantry: File | None = None
    ready_mask: Bits | None = None
    ready_value: Bits | None = None

    def beside(self, folder: Path) -> MonitoringSection:
        """The same with absolute paths, relative ones from `folder`: a run is also viewed from other directories."""
        files = {"baseline": self.baseline, "gantry": self.gantry}
        update = {name: (folder / file).absolute() for name, file in files.items() if file is not None}
        return self.model_copy(update=update) if update else self
