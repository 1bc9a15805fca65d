"""All checks in the order in which a person asks."""

from __future__ import annotations

from pathlib import Path

from livebode.doctor.check import Check
from livebode.doctor.computer import check_clock, check_dashboard_port, check_disk, check_udp_buffer
from livebode.doctor.installation import check_extras, check_instruction_set, check_plugins
from livebode.doctor.measurement import check_configuration, check_run, check_sources
from livebode.doctor.subject import Subject


def examine(subject: Subject, directory: Path) -> list[Check]:
    """What is right and wrong with this computer, and with the subject.

    Nothing is changed: a nameless file is written to the disk and removed, and live sources are listened to.

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
