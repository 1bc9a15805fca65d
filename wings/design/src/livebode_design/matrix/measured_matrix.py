"""The machine of a design from a run of several inputs: its matrix, its noise and its controllers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
from annotated_types import Gt
from pydantic import BaseModel, ConfigDict

from livebode.configuration import ControllerSection, recorded_configuration, without_null
from livebode.core import ConfigError, MatrixLoop, Model, split_plant_unit
from livebode.records import RunRecord
from livebode_design.matrix.measured_machine import MeasuredMachine

_Positive = Annotated[float, Gt(0)]
_LOOP = ("input_logged", "excitation_logged", "output_logged")


class MeasuredMatrixSection(BaseModel):
    """[measured_matrix]: a plant that a run of several inputs measured.

    Parameters
    ----------
    run
        Directory of the run, relative to this file: its responses, noise, signals, controllers and settling time.
    torque_constant_n_m_per_a
        Of each motor, for a limit of the current; one for all, or one for each.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    run: Path
    torque_constant_n_m_per_a: _Positive | list[_Positive] | None = None


def measured_machine(section: MeasuredMatrixSection) -> MeasuredMachine:
    """The mean of the valid matrices of a run; of a run with tracking.average the newest one.

    Raises
    ------
    RecordError
        If it is not a run of several inputs, or cannot be read.
    ConfigError
        If no matrix of it is valid at all lines, or it does not describe its controllers.
    """
    record = RunRecord.open(section.run, matrix=True)
    matrix, configuration = record.matrix(), recorded_configuration(record.summary)
    whole = matrix.valid.all(axis=(1, 2)) & np.isfinite(matrix.noise).all(axis=(1, 2, 3))
    if not whole.any():
        raise ConfigError(
            "value-invalid",
            f"no matrix of {str(section.run)!r} is valid at all lines with its noise",
            "choose a run with more repetitions of the experiments",
            key="measured_matrix.run",
            value=str(section.run),
        )
    rows = np.flatnonzero(whole)
    if configuration.get("tracking", {}).get("average", False):
        rows = rows[-1:]
    noise = np.einsum("rkoo->ko", matrix.noise[rows]).real / (rows.size * matrix.lines.window)
    excitations = configuration["signals"].get("excitation", [])
    if not isinstance(excitations, list) or len(excitations) != len(matrix.inputs):
        raise ConfigError(
            "value-invalid",
            f"{str(section.run)!r} does not name one excitation for each input",
            "choose a run with the joint estimator",
            key="measured_matrix.run",
            value=str(section.run),
        )
    units = record.summary["found"]["units"]
    return MeasuredMachine(
        lines=matrix.lines,
        value=matrix.value[rows].mean(axis=0),
        noise_deviation=np.sqrt(noise),
        names=(matrix.inputs, tuple(excitations)),
        output_units=tuple((name, split_plant_unit(row[0])[0]) for name, row in zip(matrix.outputs, units)),
        loop=_loop(loop_of(section), matrix.outputs, matrix.inputs, matrix.lines.rate_hz),
        settle=max(1, int(configuration.get("experiments", {}).get("settle_periods", 1))),
        torque_constant_n_m_per_a=section.torque_constant_n_m_per_a,
    )


def loop_of(section: MeasuredMatrixSection) -> dict[str, Any]:
    """[loop] of the run."""
    loop = recorded_configuration(RunRecord.open(section.run, matrix=True).summary).get("loop", {})
    controllers = [without_null(controller) for controller in loop.get("controllers", [])]
    return {name: loop[name] for name in _LOOP if name in loop} | {"controllers": controllers}


def _loop(described: dict[str, Any], outputs: tuple[str, ...], inputs: tuple[str, ...], rate_hz: float) -> MatrixLoop:
    controllers = [ControllerSection.model_validate(controller) for controller in described.get("controllers", [])]
    if not controllers:
        raise ConfigError(
            "key-missing",
            "the run does not describe its controllers, which distribute the excitations over the inputs",
            "describe them in [[loop.controllers]] of its axis.toml, and run it again",
            key="measured_matrix.run",
        )
    feedback: list[list[Model | None]] = [[None] * len(outputs) for _ in inputs]
    for controller in controllers:
        feedback[inputs.index(controller.input)][outputs.index(controller.output)] = controller.build(rate_hz)
    return MatrixLoop(feedback=feedback)
