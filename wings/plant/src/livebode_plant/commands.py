"""The commands of many machines: the first sentence of the help of each and its function."""

from __future__ import annotations

from collections.abc import Mapping

from livebode.cli import MANY, Command

_ARCHIVE: Mapping[str, Command] = {
    "run": Command(
        "Track the recordings of an archive that its lake does not have yet.",
        "livebode_plant.cli.archive.run_command:run_command",
    ),
    "list": Command(
        "List the runs of a lake by machine, and the recordings in quarantine; with --sql, query its tables.",
        "livebode_plant.cli.archive.list_command:list_command",
    ),
    "trend": Command(
        "Find how a quantity changes over months, for each machine; without QUANTITY, write all of them as one page.",
        "livebode_plant.cli.archive.trend_command:trend_command",
    ),
    "learn": Command(
        "Learn a baseline of one machine, or of each machine of a hall, from its healthy runs in the lake.",
        "livebode_plant.cli.archive.learn_command:learn_command",
    ),
    "compare": Command(
        "Find the quantities that differ between two axes, or between two spans of one, with bounds.",
        "livebode_plant.cli.archive.compare_command:compare_command",
    ),
}

_FLEET: Mapping[str, Command] = {
    "run": Command(
        "Start the workers of a fleet on this computer, and replace those that die, until Ctrl-C.",
        "livebode_plant.cli.fleet.run_command:run_command",
    ),
    "send": Command(
        "Send the samples of live sources to the log, through a buffer on disk.",
        "livebode_plant.cli.fleet.send_command:send_command",
    ),
    "status": Command(
        "Show partitions, axes, alarms, backlog and losses of a fleet; with --serve a page with a tile for each axis.",
        "livebode_plant.cli.fleet.status_command:status_command",
    ),
    "replay": Command(
        "Compute results again from the log: compare the stored ones bit for bit, or write those of an AXIS.",
        "livebode_plant.cli.fleet.replay_command:replay_command",
    ),
    "sink": Command(
        "Store the results of a fleet in a lake, each once: all of them, their means over minutes "
        "and hours, and events.",
        "livebode_plant.cli.fleet.sink_command:sink_command",
    ),
    "setup": Command(
        "Print the configuration of nats-server for a fleet, or of a leaf node at a site; or make the key of a user.",
        "livebode_plant.cli.fleet.setup_command:setup_command",
    ),
}

COMMANDS: Mapping[str, Command] = {
    "archive": Command(
        "Track every recording of an archive on all cores or a cluster, and keep the results in one lake.",
        commands=_ARCHIVE,
        extra="archive",
        panel=MANY,
    ),
    "fleet": Command(
        "Track the axes of a fleet from a log on several workers: every result once, also when a worker dies.",
        commands=_FLEET,
        extra="fleet",
        panel=MANY,
    ),
}
