"""The commands of this wing; see `livebode.cli.Command`."""

from __future__ import annotations

from collections.abc import Mapping

from livebode.cli import MEASURE, Command

COMMANDS: Mapping[str, Command] = {
    "design": Command(
        "Choose lines, window, amplitude and hop for a machine, with reasons; write the excitation and axis.toml.",
        "livebode_design.design_command:design_command",
        python="livebode_design.experiment_design:design_described",
        panel=MEASURE,
    ),
    "measure": Command(
        "Design an excitation, play it on the controller, record, and track the response; Ctrl-C ramps it down.",
        "livebode_design.measure_command:measure_command",
        panel=MEASURE,
    ),
}
