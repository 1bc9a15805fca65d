"""Sections of axis.toml on the machine: which one it is, its shafts, and the comparison with a baseline."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from livebode.configuration.section import ConfigurationSection, File, Positive
from livebode.core import LEVELS, Field, TypedTable, UsageError, ValueCheck

if TYPE_CHECKING:
    from livebode.motion import Shaft


_LETTERS_MAX = 80
_PATTERN = r"^([^/\s\x00-\x1f\x7f]([^/\x00-\x1f\x7f]*[^/\s\x00-\x1f\x7f])?)?$"


def _checked(name: str) -> str:
    if "/" in name:
        raise ValueError("it contains '/', which separates the levels")
    if not name.isprintable() or name != name.strip():
        raise ValueError("it begins or ends with a space, or contains a control character")
    return name


Level = Annotated[
    str, Field(max_length=_LETTERS_MAX), ValueCheck(_checked), Field(json_schema_extra={"pattern": _PATTERN})
]


class MachineSection(TypedTable, extra="forbid", strict=True):
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


_HIGHEST = 48

Order = Annotated[int, Field(ge=1)]


class OrdersSection(ConfigurationSection):
    """[orders]: the angle of the motor, and the shafts, for `livebode orders` and for the orders of a baseline.

    Parameters
    ----------
    angle
        Channel of the motor's angle. Default: signals.output, or its integral if it is a velocity.
    turn
        Angle of one turn of the motor, in rad, or in the unit of a channel that has no SI unit. Default: 2π.
    shafts
        Turns of each shaft in one turn of the motor: {gear = 0.2}. "motor" has 1.
    orders
        Cycles in one turn of each shaft: {motor = [1, 24], gear = [1, 2]}. Default: 1 … 48 of the motor.
    highest_hz
        Highest frequency of an order; half the antiresonance of an axis with a belt or a coupling is suitable.
    """

    angle: str | None = None
    turn: Positive | None = None
    shafts: dict[str, Positive] = {}
    orders: dict[str, list[Order]] = {}
    highest_hz: Positive | None = None

    def all_shafts(self) -> list[Shaft]:
        """The shafts with their orders; UsageError if orders name a shaft that is absent."""
        from livebode.motion import Shaft  # not every configuration has this section

        turns = {"motor": 1.0} | self.shafts
        if unknown := [name for name in self.orders if name not in turns]:
            raise UsageError(
                "unknown-name",
                f"orders.orders names the shaft {unknown[0]!r}, which orders.shafts does not have",
                f"choose one of {', '.join(turns)}",
                value=unknown[0],
                allowed=list(turns),
            )
        orders = self.orders or {"motor": list(range(1, _HIGHEST + 1))}
        return [Shaft(name, turns[name], tuple(each)) for name, each in orders.items()]


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
