"""All errors that livebode raises on purpose; docs/reference/errors.md lists their codes.

Wrong use by a programmer (a wrong type, a call in the wrong order) is a TypeError, ValueError or RuntimeError instead.
"""

from livebode.core.errors.archive import ArchiveError
from livebode.core.errors.base import LivebodeError
from livebode.core.errors.baseline import BaselineError
from livebode.core.errors.config import ConfigError
from livebode.core.errors.damage import DamageWarning
from livebode.core.errors.design import DesignError
from livebode.core.errors.extra import ExtraError
from livebode.core.errors.fit import FitError
from livebode.core.errors.fleet import FleetError
from livebode.core.errors.grid import GridError
from livebode.core.errors.location import LocationError
from livebode.core.errors.measurement import MeasurementError
from livebode.core.errors.output import OutputError
from livebode.core.errors.publish import PublishError
from livebode.core.errors.record import RecordError
from livebode.core.errors.recording import RecordingError
from livebode.core.errors.server import ServerError
from livebode.core.errors.signal import SignalError
from livebode.core.errors.simulation import SimulationError
from livebode.core.errors.source import SourceError
from livebode.core.errors.state import StateError
from livebode.core.errors.tune import TuneError
from livebode.core.errors.usage import UsageError

__all__ = [
    "ArchiveError",
    "BaselineError",
    "ConfigError",
    "DamageWarning",
    "DesignError",
    "ExtraError",
    "FitError",
    "FleetError",
    "GridError",
    "LivebodeError",
    "LocationError",
    "MeasurementError",
    "OutputError",
    "PublishError",
    "RecordError",
    "RecordingError",
    "ServerError",
    "SignalError",
    "SimulationError",
    "SourceError",
    "StateError",
    "TuneError",
    "UsageError",
]
