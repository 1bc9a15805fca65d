"""The commands: their names, in the order of the help, and the first sentence of the help of each.

Here once more, because a command's module loads what the command needs: the help that lists them all does without.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

SUMMARIES: Mapping[str, str] = {
    "run": "Track the frequency response of a machine in a recording, or live until the source ends or Ctrl-C.",
    "fit": "Fit a model to the response of a run, and print its parameters with bounds.",
    "inspect": "List channels, rate, gaps and samples that are not finite; with --excitation also period, lines and "
    "SNR.",
    "demo": "Track a simulated belt axis during its strokes, live; halfway, the belt loses 10 % of its stiffness.",
    "example": "Write recordings of simulated axes and their configurations, which the documentation uses; or list "
    "them.",
    "new": "Write the configuration of a recording: list its channels, propose their roles, ask, and find lines and "
    "window.",
    "design": "Choose lines, window, amplitude and hop for a machine, with reasons; write the excitation and "
    "axis.toml.",
    "measure": "Design an excitation, play it on the controller, record, and track the response; Ctrl-C ramps it down.",
    "query": "Query the tables of a run with SQL (DuckDB).",
    "export": "Write the responses, the fitted parameters or the model over the position in a format of other "
    "programs.",
    "check-loop": "Compare the described controllers with the recorded signals: as described, or the change that "
    "explains them.",
    "margins": "Compute gain, phase and delay margin, Ms and bandwidth of the loop, with bounds; propose a filter "
    "if needed.",
    "tune": "Propose gains and filters for the described cascade, safe for every plant within the bounds of the run.",
    "shaper": "Propose input shapers for a mode of the fitted model, over its bounds at every place of the run.",
    "friction": "Find Coulomb, viscous and Stribeck friction from usual strokes, by direction and position, with "
    "bounds.",
    "orders": "Find torque that repeats with the angle: cogging, eccentricity, gears; write a feedforward table.",
    "validate": "Simulate the fitted model with another recording and test whether the residual correlates with the "
    "signals.",
    "learn": "Learn a baseline from runs of the healthy machine, for `livebode run --baseline`.",
    "plc": "Write function blocks for the PLC of an axis: excitation, sliding DFT and the ring buffer that "
    "livebode reads.",
    "report": "Write the measurement and its results as report.html and report.pdf, with the verdict on page 1.",
    "compare": "Find the lines, parameters and margins that differ between two runs, with amounts and bounds.",
    "view": "Show runs in a browser as `livebode run --serve` does, until Ctrl-C; follow a run that is still "
    "recording.",
    "archive": "Track every recording of an archive on all cores or a cluster, and keep the results in one lake.",
    "fleet": "Track the axes of a fleet from a log on several workers: every result once, also when a worker dies.",
    "publish": "List the receivers of events and results in a configuration; --test sends a message to each.",
    "doctor": "Check this computer, a configuration and whether its machine can be reached.",
    "schema": "Print the JSON Schema of axis.toml, experiment.toml or archive.toml: an editor uses it to complete "
    "and check the keys.",
}

GROUPS: Mapping[str, Mapping[str, str]] = {
    "archive": {
        "run": "Track the recordings of an archive that its lake does not have yet.",
        "list": "List the runs of a lake by machine, and the recordings in quarantine.",
        "retry": "Track recordings in quarantine again, each in a process of its own.",
        "compact": "Join the small files of a lake, and remove files that belong to no result.",
        "trend": "Find how a quantity changes over months, for each machine: slope, jumps and bends with bounds.",
        "learn": "Learn a baseline of one machine, or of each machine of a hall, from its healthy runs in the lake.",
        "compare": "Find the quantities that differ between two axes, or between two spans of one, with bounds.",
        "report": "Write the trends of all quantities and machines as one page, the worst machine first.",
        "query": "Query the tables of a lake with SQL (DuckDB).",
    },
    "fleet": {
        "run": "Start the workers of a fleet on this computer, and replace those that die, until Ctrl-C.",
        "send": "Send the samples of live sources to the log, through a buffer on disk.",
        "status": "Show partitions, axes, backlog and losses of a fleet.",
        "view": "Show a tile for each axis of a fleet in a browser, with alarms, workers and gaps, until Ctrl-C.",
        "check": "Compute all results of a fleet again from its log, and compare the stored ones bit for bit.",
        "replay": "Compute the responses and fits of an axis again from the log, and write them as tables.",
        "sink": "Store the results of a fleet in a lake, each once: all of them, their means over minutes and hours, "
        "and events.",
        "server": "Write the configuration of nats-server for a fleet.",
        "leaf": "Write the configuration of nats-server as a leaf node: the one way of a site to the log.",
        "credentials": "Make the key of a user of the log of a fleet.",
        "demo": "Start a log, three workers and 20 simulated axes, kill a worker, and check that nothing is lost.",
    },
}
"""The commands with subcommands, and these as above."""


def subcommand(group: str, name: str) -> Callable[..., Any]:
    """The function of a subcommand, from its module `GROUP/NAME_command`."""
    function: Callable[..., Any] = getattr(import_module(f"livebode.cli.{group}.{name}_command"), f"{name}_command")
    return function


def command(name: str) -> Callable[..., Any]:
    """The function of a command, from its module `NAME_command`."""
    name = name.replace("-", "_")
    function: Callable[..., Any] = getattr(import_module(f"livebode.cli.{name}_command"), f"{name}_command")
    return function
