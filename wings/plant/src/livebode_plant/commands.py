"""The commands of many machines: the first sentence of the help of each and its function."""

from __future__ import annotations

from collections.abc import Mapping

from livebode.cli import Command

_ARCHIVE: Mapping[str, Command] = {
    "run": Command(
        "Track the recordings of an archive that its lake does not have yet.",
        "livebode_plant.cli.archive.run_command:run_command",
    ),
    "list": Command(
        "List the runs of a lake by machine, and the recordings in quarantine.",
        "livebode_plant.cli.archive.list_command:list_command",
    ),
    "retry": Command(
        "Track recordings in quarantine again, each in a process of its own.",
        "livebode_plant.cli.archive.retry_command:retry_command",
    ),
    "compact": Command(
        "Join the small files of a lake, and remove files that belong to no result.",
        "livebode_plant.cli.archive.compact_command:compact_command",
    ),
    "trend": Command(
        "Find how a quantity changes over months, for each machine: slope, jumps and bends with bounds.",
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
    "report": Command(
        "Write the trends of all quantities and machines as one page, the worst machine first.",
        "livebode_plant.cli.archive.report_command:report_command",
    ),
    "query": Command(
        "Query the tables of a lake with SQL (DuckDB).", "livebode_plant.cli.archive.query_command:query_command"
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
        "Show partitions, axes, backlog and losses of a fleet.",
        "livebode_plant.cli.fleet.status_command:status_command",
    ),
    "view": Command(
        "Show a tile for each axis of a fleet in a browser, with alarms, workers and gaps, until Ctrl-C.",
        "livebode_plant.cli.fleet.view_command:view_command",
    ),
    "check": Command(
        "Compute all results of a fleet again from its log, and compare the stored ones bit for bit.",
        "livebode_plant.cli.fleet.check_command:check_command",
    ),
    "replay": Command(
        "Compute the responses and fits of an axis again from the log, and write them as tables.",
        "livebode_plant.cli.fleet.replay_command:replay_command",
    ),
    "sink": Command(
        "Store the results of a fleet in a lake, each once: all of them, their means over minutes "
        "and hours, and events.",
        "livebode_plant.cli.fleet.sink_command:sink_command",
    ),
    "server": Command(
        "Write the configuration of nats-server for a fleet.", "livebode_plant.cli.fleet.server_command:server_command"
    ),
    "leaf": Command(
        "Write the configuration of nats-server as a leaf node: the one way of a site to the log.",
        "livebode_plant.cli.fleet.leaf_command:leaf_command",
    ),
    "credentials": Command(
        "Make the key of a user of the log of a fleet.",
        "livebode_plant.cli.fleet.credentials_command:credentials_command",
    ),
    "demo": Command(
        "Start a log, three workers and 20 simulated axes, kill a worker, and check that nothing is lost.",
        "livebode_plant.cli.fleet.demo_command:demo_command",
    ),
}

COMMANDS: Mapping[str, Command] = {
    "archive": Command(
        "Track every recording of an archive on all cores or a cluster, and keep the results in one lake.",
        commands=_ARCHIVE,
        extra="archive",
        schema="livebode_plant.archive.archive_settings:archive_schema",
    ),
    "fleet": Command(
        "Track the axes of a fleet from a log on several workers: every result once, also when a worker dies.",
        commands=_FLEET,
        extra="fleet",
    ),
}
