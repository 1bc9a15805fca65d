"""Learns a baseline of the healthy machine and raises an alarm when the machine changes."""

from livebode.monitoring.baseline import Baseline, signals_of
from livebode.monitoring.baseline_version import BaselineVersion, file_of, retained_file
from livebode.monitoring.evidence import Evidence
from livebode.monitoring.false_alarms import DEFAULT_INTERVAL_S
from livebode.monitoring.learning import learn_machine
from livebode.monitoring.machine import LearnedMachine
from livebode.monitoring.machine_detector import MachineDetector
from livebode.monitoring.machine_monitor import MachineMonitor
from livebode.monitoring.monitor import Monitor
from livebode.monitoring.rows import PLACES, NonOverlappingWindows, WindowRows, places
from livebode.monitoring.table import ScheduleTable
from livebode.monitoring.table_learning import learn_table
from livebode.monitoring.table_monitor import TableMonitor

__all__ = [
    "DEFAULT_INTERVAL_S",
    "PLACES",
    "Baseline",
    "BaselineVersion",
    "Evidence",
    "LearnedMachine",
    "MachineDetector",
    "MachineMonitor",
    "Monitor",
    "NonOverlappingWindows",
    "ScheduleTable",
    "TableMonitor",
    "WindowRows",
    "file_of",
    "learn_machine",
    "learn_table",
    "places",
    "retained_file",
    "signals_of",
]
