"""All checks in the order in which a person asks."""

from __future__ import annotations

from pathlib import Path

from livebode.doctor.check import Check
from livebode.doctor.clock import check_clock
from livebode.doctor.configuration import check_configuration, check_run
from livebode.doctor.dashboard_port import check_dashboard_port
from livebode.doctor.disk import check_disk
from livebode.doctor.extras import check_extras
from livebode.doctor.instructions import check_instruction_set
from livebode.doctor.plugins import check_plugins
from livebode.doctor.sources import check_sources
from livebode.doctor.subject import Subject
from livebode.doctor.udp_buffer import check_udp_buffer


def examine(subject: Subject, directory: Path) -> list[Check]:
    """What is right and wrong with this computer, and with the subject.

    Nothing is changed: a nameless file is written to the disk and removed, and connections are opened and closed.

    Parameters
    ----------
    subject
        Configuration and run.
    directory
        Where runs are written.
    """
    axes = subject.axes
    budgets = [axis.record.budget_bytes for axis in axes.values() if axis.record is not None]
    return [
        check_configuration(subject),
        check_run(subject),
        *check_sources(subject.sourced),
        check_extras(),
        check_plugins(),
        check_instruction_set(),
        check_disk(directory, sum(budget or 0 for budget in budgets)),
        check_udp_buffer(axes),
        check_dashboard_port(axes),
        check_clock(),
    ]
