"""MatrixExperiment: a machine with several motors and the requirements of its measurement, from a TOML file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeVar

import tomli_w
from annotated_types import Gt
from pydantic import BaseModel, ConfigDict, ValidationError

from livebode.configuration import read_table
from livebode.core import ConfigError
from livebode.dataclass import dataclass
from livebode.simulation import CoreXY, CoreXYLoop, Gantry, GantryLoop, ModalLoop, ModalMachine, MotorLoop
from livebode_design.experiment import first_of, made_of
from livebode_design.matrix.choose import choose_matrix
from livebode_design.matrix.machine import MatrixLimits, MatrixMachine
from livebode_design.matrix.matrix_files import MATRIX_FORMATS
from livebode_design.matrix.measured_matrix import MeasuredMatrixSection, loop_of, measured_machine
from livebode_design.matrix.mechanism import MechanismMachine
from livebode_design.matrix.result import MatrixDesign
from livebode_design.matrix.spec import MatrixSpec

T = TypeVar("T")
_Positive = Annotated[float, Gt(0)]
MACHINES: Mapping[str, tuple[type[Any], type[MotorLoop], str]] = {
    "gantry": (Gantry, GantryLoop, "gantry"),
    "corexy": (CoreXY, CoreXYLoop, "corexy"),
    "modes": (ModalMachine, ModalLoop, "machine"),
}
"""Description, loop and its field for each table that describes a machine."""
TABLES = (*MACHINES, "measured_matrix")
"""Tables of which an experiment has one: the machine."""
_NEEDED = ("names", "units", "frequency_hz", "damping", "input_shapes", "output_shapes")
_CONTROL = ("rate_hz", "gain_n_m_s", "integral_time_s")


@dataclass(frozen=True, kw_only=True)
class Drives:
    """[drives]: a PI velocity controller for each motor, and what is measured. One value for all, or one for each.

    Parameters
    ----------
    noise
        Standard deviation of white noise on each output, in its unit.
    rate_hz
        Of the controllers and of the recording. Default: 4000.
    gain_n_m_s
        Torque per speed of each motor, N m s. Default: 0.3, of a CoreXY machine 0.004.
    integral_time_s
        Of each motor, seconds. Default: 0.05.
    torque_constant_n_m_per_a
        Of each motor, for a limit of the current.
    """

    noise: _Positive | list[_Positive]
    rate_hz: _Positive | None = None
    gain_n_m_s: _Positive | list[_Positive] | None = None
    integral_time_s: _Positive | list[_Positive] | None = None
    torque_constant_n_m_per_a: _Positive | list[_Positive] | None = None


class MatrixExperiment(BaseModel):
    """A machine with several motors at standstill, its limits, and the required accuracy or the available time.

    Parameters
    ----------
    excitation
        What the experiments must reach.
    drives
        The controllers of the motors and the noise; of a measured machine those of the run.
    gantry
        A beam with a motor at each end.
    corexy
        Two motors whose belts both move the cart in x and y.
    modes
        Any machine by its modes.
    measured_matrix
        A machine that a run of several inputs measured.
    limits
        Limits of all axes at once.
    log
        Name of the recording in axis.toml, relative to it.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    formats: ClassVar[Sequence[str]] = tuple(MATRIX_FORMATS)
    terminal: ClassVar[str] = "livebode_design.matrix.matrix_terminal:show_matrix_design"
    picture: ClassVar[str] = "livebode_design.matrix.matrix_picture:save_matrix_excitation_picture"

    excitation: dict[str, Any]
    drives: dict[str, Any] | None = None
    gantry: dict[str, Any] | None = None
    corexy: dict[str, Any] | None = None
    modes: dict[str, Any] | None = None
    measured_matrix: MeasuredMatrixSection | None = None
    limits: dict[str, Any] = {}
    log: str = "log.csv"

    @classmethod
    def read(cls, path: Path, over: Mapping[str, Any] | None = None) -> MatrixExperiment:
        """The experiment in a TOML file; `over` replaces keys of its [excitation].

        Raises
        ------
        ConfigError
            If the file cannot be read, is not TOML, or a key or a value is invalid; the message contains it.
        """
        data = read_table(path)
        if isinstance(given := data.get("excitation", {}), dict):
            data["excitation"] = given | dict(over or {})
        experiment = cls.of(data, str(path))
        if experiment.measured_matrix is None:
            return experiment
        there = experiment.measured_matrix.model_copy(update={"run": path.parent / experiment.measured_matrix.run})
        return experiment.model_copy(update={"measured_matrix": there})

    @classmethod
    def of(cls, data: Mapping[str, Any], origin: str) -> MatrixExperiment:
        """The experiment in plain data; `origin` names it in messages."""
        try:
            experiment = cls.model_validate(data)
        except ValidationError as error:
            raise first_of(error, {"": MatrixExperiment}).at(origin) from None
        described = [name for name in TABLES if getattr(experiment, name) is not None]
        if len(described) != 1:
            raise ConfigError(
                "key-conflict",
                f"the machine is described by {' and by '.join(f'[{name}]' for name in described) or 'nothing'}",
                f"describe it by one of {', '.join(f'[{name}]' for name in TABLES)}",
                key=(described or ["gantry"])[0],
            ).at(origin)
        if experiment.measured_matrix is None and experiment.drives is None:
            raise ConfigError(
                "key-missing", "[drives] is missing", "describe the controllers and the noise", key="drives"
            ).at(origin)
        if experiment.measured_matrix is not None and experiment.drives is not None:
            raise ConfigError(
                "key-conflict",
                "[drives] and [measured_matrix] both describe the controllers",
                "remove [drives]",
                key="drives",
            ).at(origin)
        return experiment

    def spec(self) -> MatrixSpec:
        """Specification from [excitation]."""
        return _made(MatrixSpec, self.excitation, "excitation", ("lines", "window"))

    def machine_limits(self) -> MatrixLimits:
        """[limits]."""
        return made_of(MatrixLimits, self.limits, "limits")

    def machine(self) -> MatrixMachine:
        """The described machine under its drives, or the measured one."""
        if self.measured_matrix is not None:
            return measured_machine(self.measured_matrix)
        drives = _made(Drives, self.drives or {}, "drives", ("noise",))
        name = next(name for name in MACHINES if getattr(self, name) is not None)
        kind, loop, role = MACHINES[name]
        machine = _made(kind, getattr(self, name), name, _NEEDED if name == "modes" else ())
        control = {key: getattr(drives, key) for key in _CONTROL if getattr(drives, key) is not None}
        return MechanismMachine(
            loop=loop(**{role: machine}, **control),
            noise=drives.noise,
            torque_constant_n_m_per_a=drives.torque_constant_n_m_per_a,
        )

    def check(self) -> None:
        """Raise the LivebodeError of a value that no experiment can have; the machine is not read."""
        self.spec()
        self.machine_limits()

    def design(self) -> MatrixDesign:
        """The experiments; DesignError if there is no solution (see `choose_matrix`)."""
        return choose_matrix(self.spec(), self.machine(), self.machine_limits())

    def axis_text(self, design: MatrixDesign) -> str:
        """The axis.toml with which `livebode run` tracks a recording that begins with the first experiment."""
        used = design.excitation
        tables: dict[str, Any] = {
            "source": {"log": self.log},
            "signals": {
                "output": list(design.outputs),
                "input": list(design.inputs),
                "excitation": list(design.excitations),
            },
            "lines": {"frequencies": used.lines.text, "window": used.lines.window},
            "tracking": {"estimator": "joint", "average": True, "hop": used.lines.window},
            "experiments": {
                "number": len(used.spectra),
                "dwell_periods": used.dwell,
                "settle_periods": used.settle,
                "memory": design.repetitions,
            },
            "loop": self.loop_tables(design.machine),
        }
        head = (
            f"# Written by `livebode design`; play the experiments {design.repetitions} times, "
            f"{design.time_s:.4g} s, and record from the first sample on.\n\n"
        )
        return head + tomli_w.dumps(tables)

    def write(self, path: Path, design: MatrixDesign, name: str) -> None:
        """Write the excitations in the format of the suffix."""
        MATRIX_FORMATS[path.suffix](path, design, name)

    def left_out(self, design: MatrixDesign) -> dict[str, str]:  # noqa: ARG002
        """The formats that are not possible for a design: none."""
        return {}

    def loop_tables(self, machine: MatrixMachine) -> dict[str, Any]:
        """[loop] of the axis.toml."""
        if self.measured_matrix is not None:
            return loop_of(self.measured_matrix)
        assert isinstance(machine, MechanismMachine)
        controllers = [
            {
                "output": output,
                "input": input,
                "velocity": {"gain": pid.gain, "integral_time_s": pid.integral_time_s, "rate_hz": pid.rate_hz},
            }
            for (output, _), input, pid in zip(machine.outputs, machine.inputs, machine.loop.controllers)
        ]
        return {"controllers": controllers}


def _made(kind: type[T], given: Mapping[str, Any], section: str, needed: tuple[str, ...]) -> T:
    if missing := [name for name in needed if name not in given]:
        raise ConfigError(
            "key-missing", f"'{section}.{missing[0]}' is missing", "add it", key=f"{section}.{missing[0]}"
        )
    return made_of(kind, given, section)
