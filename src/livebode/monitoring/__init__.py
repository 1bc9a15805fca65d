"""What the healthy machine is like, and the alarm when it changes."""

from livebode.monitoring.evidence import Evidence
from livebode.monitoring.false_alarms import seconds_between
from livebode.monitoring.learning import learn_machine
from livebode.monitoring.machine import Machine
from livebode.monitoring.machine_detector import MachineDetector
from livebode.monitoring.machine_monitor import MachineMonitor

__all__ = ["Evidence", "Machine", "MachineDetector", "MachineMonitor", "learn_machine", "seconds_between"]
