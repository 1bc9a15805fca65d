"""All errors that livebode raises on purpose; docs/reference/errors.md lists their codes.

Wrong use by a programmer (a wrong type, a call in the wrong order) is a TypeError, ValueError or RuntimeError instead.
"""

from livebode.core.errors.base import LivebodeError
from livebode.core.errors.computation import (
    BaselineError,
    DesignError,
    FitError,
    GridError,
    MeasurementError,
    SignalError,
    SignalWarning,
    SimulationError,
    TuneError,
)
from livebode.core.errors.inputs import ConfigError, ExtraError, LocationError, RecordingError, SourceError, UsageError
from livebode.core.errors.outputs import (
    ArchiveError,
    DamageWarning,
    FleetError,
    OutputError,
    PublishError,
    RecordError,
    ServerError,
    StateError,
)

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
    "SignalWarning",
    "SimulationError",
    "SourceError",
    "StateError",
    "TuneError",
    "UsageError",
]
