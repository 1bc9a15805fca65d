"""The commands: the first sentence of the help of each and its function, in the order of the help.

The sentence is here once more, because a command's module loads what the command needs: the help that lists them all
does without.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Command(NamedTuple):
    """A command, or a group of them.

    Attributes
    ----------
    summary
        First sentence of its help.
    function
        "module:name" of the function whose parameters are its arguments and options, as Typer reads them; empty for a
        group.
    commands
        The commands of a group by name.
    extra
        Extra of livebode with PyArrow, which the modules of a group import.
    schema
        "module:name" of the function with the JSON Schema of the file NAME.toml that a command or a group reads, for
        `livebode schema NAME`.
    """

    summary: str
    function: str = ""
    commands: Mapping[str, Command] = MappingProxyType({})
    extra: str = ""
    schema: str = ""


COMMANDS: Mapping[str, Command] = {
    "run": Command(
        "Track the frequency response of a machine in a recording, or live until the source ends or Ctrl-C.",
        "livebode.cli.run_command:run_command",
    ),
    "fit": Command(
        "Fit a model to the response of a run, and print its parameters with bounds.",
        "livebode.cli.fit_command:fit_command",
    ),
    "inspect": Command(
        "List channels, rate, gaps and samples that are not finite; with --excitation also period, lines and SNR.",
        "livebode.cli.inspect_command:inspect_command",
    ),
    "demo": Command(
        "Track a simulated belt axis during its strokes, live; halfway, the belt loses 10 % of its stiffness.",
        "livebode.cli.demo_command:demo_command",
    ),
    "example": Command(
        "Write recordings of simulated axes and their configurations, which the documentation uses; or list them.",
        "livebode.cli.example_command:example_command",
    ),
    "new": Command(
        "Write the configuration of a recording: list its channels, propose their roles, ask, and "
        "find lines and window.",
        "livebode.cli.new_command:new_command",
    ),
    "design": Command(
        "Choose lines, window, amplitude and hop for a machine, with reasons; write the excitation and axis.toml.",
        "livebode.cli.design_command:design_command",
    ),
    "measure": Command(
        "Design an excitation, play it on the controller, record, and track the response; Ctrl-C ramps it down.",
        "livebode.cli.measure_command:measure_command",
    ),
    "query": Command("Query the tables of a run with SQL (DuckDB).", "livebode.cli.query_command:query_command"),
    "export": Command(
        "Write the responses, the fitted parameters or the model over the position in a format of other programs.",
        "livebode.cli.export_command:export_command",
    ),
    "learn": Command(
        "Learn a baseline from runs of the healthy machine, for `livebode run --baseline`.",
        "livebode.cli.learn_command:learn_command",
    ),
    "report": Command(
        "Write the measurement and its results as report.html and report.pdf, with the verdict on page 1.",
        "livebode.cli.report_command:report_command",
    ),
    "compare": Command(
        "Find the lines, parameters and margins that differ between two runs, with amounts and bounds.",
        "livebode.cli.compare_command:compare_command",
    ),
    "view": Command(
        "Show runs in a browser as `livebode run --serve` does, until Ctrl-C; follow a run that is still recording.",
        "livebode.cli.view_command:view_command",
    ),
    "publish": Command(
        "List the receivers of events and results in a configuration; --test sends a message to each.",
        "livebode.cli.publish_command:publish_command",
    ),
    "doctor": Command(
        "Check this computer, a configuration and whether its machine can be reached.",
        "livebode.cli.doctor_command:doctor_command",
    ),
    "schema": Command(
        "Print the JSON Schema of axis.toml, experiment.toml or archive.toml: an editor uses it to "
        "complete and check the keys.",
        "livebode.cli.schema_command:schema_command",
    ),
}
