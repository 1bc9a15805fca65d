"""[report]: what the first page of a report contains, and the limits that the machine must meet."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from livebode.configuration.section import ConfigurationSection, File, Language
from livebode.configuration.toml_file import one_line, read_table, shortened
from livebode.core import ConfigError, Field, Paper, ValueCheck, errors_of, nearest_name

LIMITS_MAX = 50
MARGIN_UNITS = {
    "gain_margin_db": "dB", "gain_reduction_db": "dB", "phase_margin_deg": "deg", "delay_margin_ms": "ms",
    "max_sensitivity": "", "bandwidth_hz": "Hz",
}  # fmt: skip
"""Quantities of the loop, with their units."""
MAGNITUDES = {"|G|": "plant", "|L|": "open loop", "|T|": "closed loop", "|S|": "sensitivity"}
"""Magnitudes over a band, and the response that each belongs to."""
PARAMETERS = (
    "resonance_hz", "resonance_damping", "antiresonance_hz", "antiresonance_damping", "stiffness", "inertia",
    "load_mass", "damping", "delay_s",
)  # fmt: skip
"""Quantities of the fitted model, by their kind; several modes are numbered, as in resonance_2_hz."""
QUANTITIES = (*PARAMETERS, *MARGIN_UNITS, *MAGNITUDES)
_NUMBERED = re.compile(r"(anti)?resonance_[1-9]_(hz|damping)")


def _known_quantity(name: str) -> str:
    if name not in QUANTITIES and not _NUMBERED.fullmatch(name):
        raise ValueError(nearest_name(name, QUANTITIES, "Quantities"))
    return name


class LimitSection(ConfigurationSection):
    """[[report.limits]]: a quantity of the machine and what it must not fall below or exceed.

    Parameters
    ----------
    quantity
        "resonance_hz", "resonance_damping", "antiresonance_hz", "antiresonance_damping", "stiffness", "inertia",
        "load_mass", "damping" or "delay_s" of the fitted model; "gain_margin_db", "gain_reduction_db",
        "phase_margin_deg", "delay_margin_ms", "max_sensitivity" or "bandwidth_hz" of the described loop; "|G|", "|L|",
        "|T|" or "|S|" in dB over band_hz.
    min
        Smallest permitted value, in the unit of the quantity.
    max
        Largest permitted value, in the unit of the quantity.
    band_hz
        Lowest and highest frequency of a magnitude, in Hz. Default: all lines.
    """

    quantity: Annotated[str, ValueCheck(_known_quantity)]
    min: float | None = None
    max: float | None = None
    band_hz: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None

    def check(self) -> None:
        """ValueError if the limit is not possible."""
        if self.min is None and self.max is None:
            raise ValueError(f"the limit of {self.quantity} needs min, max or both")
        if self.min is not None and self.max is not None and self.min >= self.max:
            raise ValueError(f"the limit of {self.quantity} has min {self.min:g} that is not below max {self.max:g}")
        if self.band_hz is not None and self.quantity not in MAGNITUDES:
            raise ValueError(f"band_hz applies to {', '.join(MAGNITUDES)}, not to {self.quantity}")
        if self.band_hz is not None and not 0 <= self.band_hz[0] <= self.band_hz[1]:
            raise ValueError(f"band_hz of {self.quantity} is not two ascending frequencies")


class ReportSection(ConfigurationSection):
    """[report]: the first page of `livebode report` and `livebode compare`, and the limits of the machine.

    Parameters
    ----------
    machine
        Name or type of the machine. Default: its path in [machine], or the name of the recording.
    serial_number
        Serial number of the machine.
    operator
        Who measured.
    company
        Whose report it is.
    customer
        Whom it is for.
    conditions
        Conditions of the measurement, such as load, temperature and axis position.
    logo
        PNG or SVG file of at most 1 MiB for the first page, relative to this file.
    language
        Language of the report. `--language` overrides it. Default: English.
    paper
        Size of the pages: "a4" or "letter".
    units
        Units of the response in pictures and tables: "si", or "drive" for those of the recording or live source.
        Parameters and limits are in SI units.
    limits
        Acceptance limits: a list of tables with quantity, min, max and band_hz.
    """

    machine: str = ""
    serial_number: str = ""
    operator: str = ""
    company: str = ""
    customer: str = ""
    conditions: str = ""
    logo: File | None = None
    language: Language | None = None
    paper: Paper = "a4"
    units: Literal["si", "drive"] = "si"
    limits: Annotated[list[LimitSection], Field(max_length=LIMITS_MAX)] = []

    def beside(self, folder: Path) -> ReportSection:
        """With the logo relative to a folder."""
        return self if self.logo is None else self.model_copy(update={"logo": folder / self.logo})

    def over(self, changed: dict[str, Any]) -> ReportSection:
        """With other values, such as options of the command line; None and empty ones change nothing."""
        return self.model_copy(update={name: value for name, value in changed.items() if value not in (None, "")})


def read_template(path: Path) -> ReportSection:
    """The [report] of a TOML file, which may contain the other sections of an axis or nothing else.

    Raises
    ------
    ConfigError
        If the file cannot be read, has no [report], or a key or value is not possible.
    """
    table = read_table(path).get("report")
    if not isinstance(table, dict):
        raise ConfigError("key-missing", f"{str(path)!r} has no [report] section", "add it", key="report")
    try:
        return ReportSection.model_validate(table).beside(path.parent)
    except ValueError as error:
        raise report_error(errors_of(error)[0]).at(str(path)) from None


def report_error(first: Mapping[str, Any]) -> ConfigError:
    """An error of pydantic in a [report], with the nearest name for an unknown one."""
    from livebode.configuration.toml_mistakes import meant_value  # needed for a mistake only

    loc = first["loc"][1:] if first["loc"][:1] == ("report",) else first["loc"]
    place = one_line(".".join(["report", *map(str, loc)]))
    if first["type"] == "extra_forbidden":
        known = LimitSection if "limits" in loc else ReportSection
        remedy = nearest_name(str(loc[-1]), known.model_fields, "Settings")
        return ConfigError("key-unknown", f"there is no setting {place!r}", remedy, key=place)
    if first["type"] == "missing":
        return ConfigError("key-missing", f"{place!r} is missing", "add it", key=place)
    why = first["msg"].removeprefix("Value error, ")
    value = shortened(first["input"])
    if isinstance(first["input"], dict):
        return ConfigError("value-invalid", f"{place}: {why}", "correct it", key=place)
    if "Quantities: " in why:
        return ConfigError("value-invalid", f"{place} = {value} is not a quantity", why, key=place, value=value)
    meant = meant_value(first["type"], first["input"])
    remedy = "correct it" if meant is None else f"write {meant}"
    return ConfigError("value-invalid", f"{place} = {value} is not usable: {why}", remedy, key=place, value=value)
