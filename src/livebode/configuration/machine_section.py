"""[machine]: which machine and axis a recording or a live source belongs to."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Name = Annotated[str, Field(pattern=r"^[^/]*$")]


class MachineSection(BaseModel):
    """[machine]: which machine and axis this is, in a hierarchy; a level that is empty is left out.

    Parameters
    ----------
    site
        Site or plant.
    line
        Production line.
    machine
        Machine.
    axis
        Axis of the machine.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    site: Name = ""
    line: Name = ""
    machine: Name = ""
    axis: Name = ""

    @property
    def path(self) -> str:
        """Written as site/line/machine/axis.

        >>> MachineSection(site="Ulm", machine="press 4", axis="x").path
        'Ulm/press 4/x'
        """
        return "/".join(name for name in (self.site, self.line, self.machine, self.axis) if name)
