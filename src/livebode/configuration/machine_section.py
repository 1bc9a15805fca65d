"""[machine]: which machine it is, in the hierarchy of a factory."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from livebode.core import LEVELS

_LETTERS_MAX = 80
_PATTERN = r"^([^/\s\x00-\x1f\x7f]([^/\x00-\x1f\x7f]*[^/\s\x00-\x1f\x7f])?)?$"


def _checked(name: str) -> str:
    if "/" in name:
        raise ValueError("it contains '/', which separates the levels")
    if not name.isprintable() or name != name.strip():
        raise ValueError("it begins or ends with a space, or contains a control character")
    return name


Level = Annotated[
    str, Field(max_length=_LETTERS_MAX), AfterValidator(_checked), Field(json_schema_extra={"pattern": _PATTERN})
]


class MachineSection(BaseModel):
    """[machine]: which machine it is. Runs of one machine are compared and searched by it; every level may be omitted.

    Parameters
    ----------
    site
        The factory or the hall.
    line
        The production line.
    machine
        The machine in that line.
    axis
        The axis of that machine. Default, in a file with [axes.NAME]: NAME.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    site: Level = ""
    line: Level = ""
    machine: Level = ""
    axis: Level = ""

    @property
    def levels(self) -> dict[str, str]:
        """The levels that have a name.

        >>> MachineSection(site="Graz", machine="press 4").levels
        {'site': 'Graz', 'machine': 'press 4'}
        """
        return {level: name for level in LEVELS if (name := getattr(self, level))}

    @property
    def path(self) -> str:
        """The names from the site down; empty if none is specified.

        >>> MachineSection(site="Graz", machine="press 4", axis="X").path
        'Graz/press 4/X'
        """
        return "/".join(self.levels.values())
