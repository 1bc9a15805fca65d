"""The controllers of a matrix of responses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from livebode.core import ConfigError, Model

if TYPE_CHECKING:
    from livebode.configuration.loop_section import ControllerSection, LoopSection
    from livebode.core import MatrixLoop


def check_controllers(loop: LoopSection, outputs: Sequence[str], inputs: Sequence[str]) -> None:
    """ConfigError if a controller joins signals that the matrix does not have."""
    for controller in loop.controllers:
        _check_controller(controller, outputs, inputs)


def _check_controller(controller: ControllerSection, outputs: Sequence[str], inputs: Sequence[str]) -> None:
    for role, name, names in (
        ("output", controller.output, outputs),
        ("input", controller.input, inputs),
    ):
        if name not in names:
            raise ConfigError(
                "value-mismatch",
                f"a controller in [[loop.controllers]] has the {role} {name!r}, which [signals] does not list",
                f"name one of {', '.join(names)}",
                key="loop.controllers",
                value=name,
            )


def matrix_loop(loop: LoopSection, inputs: list[str], outputs: list[str], rate_hz: float) -> MatrixLoop:
    """The loop of these [[loop.controllers]], recorded at `rate_hz`; ConfigError if a controller cannot be built."""
    from livebode.core import MatrixLoop

    feedback: list[list[Model | None]] = [[None] * len(outputs) for _ in inputs]
    for controller in loop.controllers:
        feedback[inputs.index(controller.input)][outputs.index(controller.output)] = controller.build(rate_hz)
    return MatrixLoop(
        feedback=feedback if loop.controllers else None,
        input_logged=loop.input_logged,
        excitation_logged=loop.excitation_logged,
        output_logged=loop.output_logged,
    )
