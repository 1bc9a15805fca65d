"""The commands of this wing; see `livebode.cli.Command`."""

from __future__ import annotations

from collections.abc import Mapping

from livebode.cli import COMPARE, CONTROL, Command

COMMANDS: Mapping[str, Command] = {
    "margins": Command(
        "Compute gain, phase and delay margin, Ms and bandwidth of the loop, with bounds; propose a filter if needed.",
        "livebode_control.margins.margins_command:margins_command",
        panel=CONTROL,
    ),
    "tune": Command(
        "Propose gains and filters for the described cascade, safe for every plant within bounds; or input shapers.",
        "livebode_control.proposal.tune_command:tune_command",
        panel=CONTROL,
    ),
    "validate": Command(
        "Test the fitted model on another recording, or with --loop the described controllers on the recorded signals.",
        "livebode_control.validation.validate_command:validate_command",
        panel=COMPARE,
    ),
    "friction": Command(
        "Find Coulomb, viscous and Stribeck friction from usual strokes, by direction and position, with bounds.",
        "livebode_control.strokes.friction_command:friction_command",
        panel=CONTROL,
    ),
    "orders": Command(
        "Find torque that repeats with the angle: cogging, eccentricity, gears; write a feedforward table.",
        "livebode_control.strokes.orders_command:orders_command",
        panel=CONTROL,
    ),
}
