"""The commands of this wing and the kinds of files that they read; see `livebode.cli.Command`."""

from __future__ import annotations

from collections.abc import Mapping

from livebode.cli import MEASURE, Command
from livebode.configuration import FileKind

COMMANDS: Mapping[str, Command] = {
    "design": Command(
        "Choose lines, window, amplitude and hop for a machine, with reasons; write the excitation and axis.toml.",
        "livebode_design.design_command:design_command",
        python="livebode_design.designing:design_described",
        panel=MEASURE,
    ),
    "measure": Command(
        "Design an excitation, play it on the controller, record, and track the response; Ctrl-C ramps it down.",
        "livebode_design.measure_command:measure_command",
        panel=MEASURE,
    ),
}

FILES: Mapping[str, FileKind] = {
    "experiment": FileKind(
        "livebode_design.experiment_schema:experiment_schema",
        "an experiment",
        frozenset({"excitation"}),
        "livebode_design.experiment:Experiment",
    ),
    "matrix-experiment": FileKind(
        "livebode_design.experiment_schema:matrix_experiment_schema",
        "an experiment of several motors",
        frozenset({"gantry", "corexy", "modes", "measured_matrix"}),
        "livebode_design.matrix.matrix_experiment:MatrixExperiment",
    ),
}
