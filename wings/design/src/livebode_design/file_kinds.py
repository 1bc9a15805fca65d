"""The kinds of TOML files that the commands of this wing read."""

from __future__ import annotations

from collections.abc import Mapping

from livebode.configuration import FileKind

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
