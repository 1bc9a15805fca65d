"""Experiment: description of a machine and of the measurement, from a TOML file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Any, ClassVar, TypeVar, get_type_hints

import tomli_w
from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from livebode.configuration import LoopSection, nearest, read_table, shortened
from livebode.core import ConfigError, nearest_name
from livebode.estimation import DETECTION_LINES_MIN
from livebode.excitation import BLOCK_PERIOD_MAX
from livebode.simulation import BeltAxis, Drive, Friction, Limits, Mechanics, Sensor, Standstill, Strokes
from livebode.sources.live import MeasureSection, SourceSettings
from livebode_design._choose import choose
from livebode_design.belt import belt_machine
from livebode_design.design import Design
from livebode_design.files import FORMATS, write
from livebode_design.limits import MachineLimits
from livebode_design.machine import Machine
from livebode_design.measured_axis import MeasuredAxis, MeasuredSection
from livebode_design.spec import ExperimentSpec

T = TypeVar("T")

BELT: dict[str, Any] = {
    "mechanics": Mechanics,
    "friction": Friction,
    "drive": Drive,
    "sensor": Sensor,
    "limits": Limits,
    "strokes": Strokes,
    "standstill": Standstill,
}
SIGNALS = {"excitation": "w", "input": "u", "output": "velocity"}


class Experiment(BaseModel):
    """A machine, either a belt axis by its constants or a measured one, and the specification of the experiment.

    Parameters
    ----------
    excitation
        The excitation that is designed.
    belt
        A tooth-belt axis by its constants.
    measured
        A plant that a run measured, and the extremes of its motion alone.
    limits
        Limits of the machine. Default: of a belt axis the torque of its drive, and the speed and the travel of its
        limits.
    loop
        The controllers of a measured axis, as in axis.toml. Default: those of the run.
    signals
        Names of the channels in axis.toml. Default: those of the simulated axis or of the run.
    log
        Name of the recording in axis.toml, relative to it.
    source
        The controller on which `livebode measure` plays the excitation, and whose samples it records: [source] of
        axis.toml.
    measure
        How the excitation is played, and what ends it.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    formats: ClassVar[Sequence[str]] = tuple(FORMATS)
    terminal: ClassVar[str] = "livebode_design.design_terminal:show_design"
    picture: ClassVar[str] = "livebode_design.excitation_picture:save_excitation_picture"

    excitation: dict[str, Any]
    belt: dict[str, dict[str, Any]] | None = None
    measured: MeasuredSection | None = None
    limits: dict[str, Any] = {}
    loop: LoopSection | None = None
    signals: dict[str, str] = {}
    log: str = "log.csv"
    source: SourceSettings | None = None
    measure: MeasureSection = MeasureSection()

    @classmethod
    def read(cls, path: Path, over: Mapping[str, Any] | None = None) -> Experiment:
        """The Experiment in a TOML file; `over` replaces keys of its [excitation].

        Raises
        ------
        ConfigError
            If the file cannot be read, is not TOML, or a key or a value is invalid; the message contains it.
        """
        data = read_table(path)
        required, above = data.get("excitation", {}), dict(over or {})
        if isinstance(required, dict):
            data["excitation"] = {key: value for key, value in required.items() if key not in _replaced(above)} | above
        experiment = cls.of(data, str(path))
        if experiment.source is not None:
            experiment = experiment.model_copy(update={"source": experiment.source.beside(path.parent)})
        if experiment.measured is None:
            return experiment
        return experiment.model_copy(
            update={"measured": experiment.measured.model_copy(update={"run": path.parent / experiment.measured.run})}
        )

    @classmethod
    def of(cls, data: Mapping[str, Any], origin: str) -> Experiment:
        """The Experiment in plain data; `origin` names it in messages."""
        try:
            experiment = cls.model_validate(data)
        except ValidationError as error:
            raise first_of(error, {"": Experiment, "measured": MeasuredSection}).at(origin) from None
        if experiment.belt is not None and experiment.loop is not None:
            raise ConfigError(
                "key-conflict", "a [belt] axis has its loop in [belt.drive]", "remove [loop]", key="loop"
            ).at(origin)
        if experiment.belt is None and experiment.measured is None:
            raise ConfigError(
                "key-missing",
                "there is neither [belt] nor [measured], so that it describes no machine",
                "describe a [belt] axis by its constants, or name a run of it in [measured]",
                key="belt",
            ).at(origin)
        if experiment.belt is not None and experiment.measured is not None:
            raise ConfigError(
                "key-conflict",
                "the machine is described twice, by [belt] and by [measured]",
                "remove one of them",
                key="belt",
            ).at(origin)
        return experiment

    def spec(self) -> ExperimentSpec:
        """Specification from [excitation]."""
        given = dict(self.excitation)
        if isinstance(given.get("band_hz"), list):
            given["band_hz"] = tuple(given["band_hz"])
        return made_of(ExperimentSpec, given, "excitation")

    def machine_limits(self) -> MachineLimits:
        """[limits]; for a belt axis its own limits by default."""
        axis = self.axis()
        own = {} if axis is None else {
            "torque_n_m_max": axis.drive.torque_n_m_max,
            "speed_m_per_s_max": axis.limits.speed_m_per_s_max,
            "position_m_min": axis.limits.position_m_min,
            "position_m_max": axis.limits.position_m_max,
        }  # fmt: skip
        return made_of(MachineLimits, own | self.limits, "limits")

    def axis(self) -> BeltAxis | None:
        """The belt axis; None for a measured one."""
        if self.belt is None:
            return None
        if unknown := [name for name in self.belt if name not in BELT]:
            raise ConfigError(
                "key-unknown",
                f"there is no [belt.{unknown[0]}]",
                nearest_name(unknown[0], BELT, "Settings"),
                key=f"belt.{unknown[0]}",
            )
        parts = {name: made_of(BELT[name], given, f"belt.{name}") for name, given in self.belt.items()}
        if "strokes" in parts and "standstill" in parts:
            raise ConfigError(
                "key-conflict",
                "[belt.strokes] and [belt.standstill] exclude each other",
                "remove one of them",
                key="belt.standstill",
            )
        motion = parts.pop("strokes", None) or parts.pop("standstill", None) or Standstill()
        return BeltAxis(motion=motion, **parts)

    def machine(self) -> Machine:
        """The described machine: simulates a cycle for a belt axis, reads a run directory for a measured one."""
        axis = self.axis()
        if axis is not None:
            return belt_machine(axis)
        return self._measured_axis.machine()

    @cached_property
    def _measured_axis(self) -> MeasuredAxis:
        """The run is opened once."""
        assert self.measured is not None
        return MeasuredAxis(self.measured, self.loop)

    def check(self) -> None:
        """Raise the LivebodeError of a value that no experiment can have; the machine is not read."""
        self.spec()
        self.machine_limits()
        self.signal_names()

    def design(self) -> Design:
        """Lines, window, amplitude and hop; DesignError if there is no solution (see `choose`)."""
        return choose(self.spec(), self.machine(), self.machine_limits())

    def axis_text(self, design: Design) -> str:
        """The axis.toml with which `livebode run` tracks a recording of the design."""
        lines, moves = design.waveform.lines, design.machine.stroke_s is not None
        motion = self.motion_table(lines.window / lines.rate_hz)
        tracked: dict[str, Any] = {"estimator": "joint", "hop": design.hop} | self.tracking()
        if design.windows > 1 and not moves:
            tracked |= {"average": True, "forgetting": 1.0}
        if moves and len(lines.quiet) >= DETECTION_LINES_MIN and not motion:
            tracked |= {"noise": "quiet"}
        tables: dict[str, Any] = {
            "source": {"log": self.log},
            "signals": self.signal_names(),
            "lines": {"frequencies": lines.text, "window": lines.window},
            "tracking": tracked,
        }
        tables |= {name: table for name, table in (("motion", motion), ("loop", self.loop_tables())) if table}
        head = f"# Written by `livebode design`; record {design.recording_s:.4g} s or more.\n\n"
        return head + tomli_w.dumps(tables)

    def write(self, path: Path, design: Design, name: str) -> None:
        """Write the excitation in the format of the suffix."""
        write(path, design.waveform, name)

    def left_out(self, design: Design) -> dict[str, str]:
        """The formats that are not possible for a design, with the reason."""
        lines, reasons = design.waveform.lines, {}
        if lines.window > BLOCK_PERIOD_MAX:
            reasons[".st"] = f"no .st: its {lines.window} samples are more than the {BLOCK_PERIOD_MAX} of a PLC's table"
        if lines.rate_hz % 1:
            reasons[".wav"] = f"no .wav: {lines.rate_hz!r} Hz is not a whole number of samples per second"
        return reasons

    def loop_tables(self) -> dict[str, Any]:
        """[loop] of the axis.toml, as in docs/reference/configuration.md."""
        axis = self.axis()
        if axis is None:
            return _finite(self._measured_axis.loop_tables())
        drive = axis.drive
        velocity = {"gain": drive.velocity_gain_n_m_s, "integral_time_s": drive.integral_time_s,
                    "rate_hz": drive.velocity_rate_hz, "rate_divider": drive.velocity_ticks,
                    "delay_ticks": drive.delay_ticks}  # fmt: skip
        position = {"gain": drive.position_gain_per_s, "rate_hz": drive.position_rate_hz,
                    "rate_divider": drive.position_ticks}  # fmt: skip
        differenced = {"velocity_differenced": True} if axis.sensor.velocity_differenced else {}
        return {**differenced, "velocity": velocity, "position": position}

    def motion_table(self, window_s: float) -> dict[str, Any]:
        """[motion] of the axis.toml for a moving belt axis: a chunk is a stroke, at least two windows."""
        axis = self.axis()
        if axis is None or (cycle := axis.motion.cycle(axis.drive.rate_hz)[0].size) == 1:
            return {}
        stroke_s = cycle / 2 / axis.drive.rate_hz
        return {"radius_m": axis.mechanics.radius_m, "chunk_s": max(stroke_s, 2 * window_s)}

    def signal_names(self) -> dict[str, str]:
        """[signals] of the axis.toml; default: those of the simulated axis or of the run."""
        if unknown := [name for name in self.signals if name not in (*SIGNALS, "schedule")]:
            raise ConfigError(
                "key-unknown",
                f"there is no signals.{unknown[0]}",
                nearest_name(unknown[0], (*SIGNALS, "schedule"), "Settings"),
                key=f"signals.{unknown[0]}",
            )
        if self.belt is None:
            own = self._measured_axis.signal_names()
        else:
            own = SIGNALS | ({"schedule": "x"} if "strokes" in self.belt else {})
        names = own | self.signals
        for role, name in names.items():
            if not name or not name.isprintable():
                raise ConfigError(
                    "value-invalid",
                    f"signals.{role} = {name!r} cannot be the name of a channel",
                    "specify its name in the recording",
                    key=f"signals.{role}",
                    value=name,
                )
            if twins := [other for other in names if other != role and names[other] == name]:
                raise ConfigError(
                    "key-conflict",
                    f"signals.{role} and signals.{twins[0]} are both {name!r}",
                    "name two channels",
                    key=f"signals.{role}",
                    value=name,
                )
        return names

    def tracking(self) -> dict[str, Any]:
        """[tracking] of the axis.toml: keys that depend on the recording."""
        return {} if self.belt is not None else self._measured_axis.tracking()


def first_of(error: ValidationError, models: Mapping[str, type[BaseModel]]) -> ConfigError:
    """The first error, with its key and value.

    Parameters
    ----------
    error
        All errors.
    models
        The models of the tables, and under "" that of the file, whose keys are compared with one that does not exist.
    """
    first = min(error.errors(), key=lambda e: e["type"] != "extra_forbidden")  # a typo also causes a missing key
    place = ".".join(map(str, first["loc"]))
    if first["type"] == "extra_forbidden":
        table = str(first["loc"][0])
        if table == "loop":
            meant = nearest(first["loc"])
        else:
            meant = nearest_name(place.split(".")[-1], models.get(table, models[""]).model_fields, "Settings")
        return ConfigError("key-unknown", f"there is no {place!r}", meant, key=place)
    if first["type"] == "missing" and all(isinstance(part, str) for part in first["loc"]):
        return ConfigError("key-missing", f"{place!r} is missing", "add it", key=place)
    return _unusable(place, first["input"], first["msg"])


def _unusable(key: str, value: Any, why: str) -> ConfigError:
    shown = shortened(value)
    message = f"{key} = {shown} is not usable: {_plain(why)}"
    return ConfigError("value-invalid", message, "correct it", key=key, value=shown)


def _plain(why: str) -> str:
    # TOML has only lists; some become tuples here.
    return why.lower().replace("tuple", "list")


def made_of(kind: type[T], given: Mapping[str, Any], section: str) -> T:
    """The dataclass from plain data; ConfigError for an unknown key, or a value of another type."""
    known = get_type_hints(kind)
    for name, value in given.items():
        if name not in known:
            raise ConfigError(
                "key-unknown",
                f"there is no {section}.{name}",
                nearest_name(name, known, "Settings"),
                key=f"{section}.{name}",
            )
        try:
            TypeAdapter(known[name], config=ConfigDict(strict=True)).validate_python(value)
        except ValidationError as error:
            raise _unusable(f"{section}.{name}", value, error.errors()[0]["msg"]) from None
    return kind(**given)


def _finite(table: Mapping[str, Any]) -> dict[str, Any]:
    kept = {name: _finite(v) if isinstance(v, Mapping) else v for name, v in table.items() if v is not None}
    return {name: v for name, v in kept.items() if v != inf}


def _replaced(above: Mapping[str, Any]) -> set[str]:
    """Keys of [excitation] that would contradict those given instead."""
    of_a_band = {"band_hz", "resolution_hz", "order", "rate_divider", "sweep", "window", "kind"}
    gone: set[str] = of_a_band if "lines" in above else set()
    if "band_hz" in above:
        gone |= {"lines"}
    if "resolution_hz" in above or "window" in above:
        gone |= {"resolution_hz", "window", "order"}
    return gone
