"""The commands: the first sentence of the help of each and its function, in the order of the help.

The sentence is here once more, because a command's module loads what the command needs: the help that lists them all
does without.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

MEASURE, RESULTS, COMPARE, CONTROL, MANY = "Measure", "Results", "Compare", "Control", "Many machines"
PANELS = (MEASURE, RESULTS, COMPARE, CONTROL, MANY)
"""Titles under which the help lists the commands, in its order; a plug-in may have another one."""


ABOUT = "The Bode plot of a machine while the machine works."
OPTIONS: Mapping[str, str] = {
    "--version": "Print the version and exit.",
    "--log-level LEVEL": "Write a log from this level on: debug, info, warning or error. [default: info with "
    "--log-file]",
    "--log-file FILE": "Write the log there instead of on standard error.",
    "--install-completion": "Install completion for the current shell.",
    "--show-completion": "Show completion for the current shell, to copy it or customize the installation.",
    "--help -h": "Show this message and exit.",
}


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
    python
        "module:name" of the function that a name of the package `livebode` calls to do the same.
    extra
        Extra of livebode with PyArrow, which the modules of a group import.
    panel
        Title under which the help lists the command.
    """

    summary: str
    function: str = ""
    commands: Mapping[str, Command] = MappingProxyType({})
    extra: str = ""
    python: str = ""
    panel: str = "Commands"


def panels(commands: Mapping[str, Command]) -> dict[str, list[tuple[str, str]]]:
    """Names and summaries of commands by panel."""
    titles = dict.fromkeys([*PANELS, *(command.panel for command in commands.values())])
    rows = {title: [(n, c.summary) for n, c in commands.items() if c.panel == title] for title in titles}
    return {title: found for title, found in rows.items() if found}


COMMANDS: Mapping[str, Command] = {
    "run": Command(
        "Track the frequency response of a machine in a recording, or live until the source ends or Ctrl-C.",
        "livebode.cli.run_command:run_command",
        panel=MEASURE,
    ),
    "fit": Command(
        "Fit a model to the response of a run, and print its parameters with bounds.",
        "livebode.cli.fit_command:fit_command",
        panel=RESULTS,
    ),
    "inspect": Command(
        "List channels, rate, gaps and samples that are not finite; with --out propose and write axis.toml.",
        "livebode.cli.inspect_command:inspect_command",
        panel=MEASURE,
    ),
    "demo": Command(
        "Track a simulated belt axis during its strokes, live; halfway, the belt loses 10 % of its stiffness.",
        "livebode.cli.demo_command:demo_command",
        panel=MEASURE,
    ),
    "example": Command(
        "Write recordings of simulated axes and their configurations, which the documentation uses; or list them.",
        "livebode.cli.example_command:example_command",
        panel=MEASURE,
    ),
    "export": Command(
        "Write the responses, the fitted parameters or the model in a format of other programs, or query with SQL.",
        "livebode.cli.export_command:export_command",
        panel=RESULTS,
    ),
    "learn": Command(
        "Learn a baseline from runs of the healthy machine, for `livebode run --baseline`.",
        "livebode.cli.learn_command:learn_command",
        panel=COMPARE,
    ),
    "view": Command(
        "Show runs in a browser as `livebode run --serve` does, until Ctrl-C; follow a run that is still recording.",
        "livebode.cli.view_command:view_command",
        panel=RESULTS,
    ),
    "doctor": Command(
        "Check this computer, a configuration and whether its machine can be reached; its receivers, its schema.",
        "livebode.cli.doctor_command:doctor_command",
        panel=MEASURE,
    ),
}
