"""The types that all other packages use: samples, lines, responses, loops, events, errors."""

from livebode.core.block import Block, Channel, nearest_name
from livebode.core.controllers import PID, Cascade, PositionPD
from livebode.core.errors import (
    BaselineError,
    ConfigError,
    DamageWarning,
    DesignError,
    ExtraError,
    FitError,
    GridError,
    LivebodeError,
    OutputError,
    RecordError,
    RecordingError,
    ServerError,
    SignalError,
    SimulationError,
    SourceError,
    UsageError,
)
from livebode.core.event import Emit, Event, ignore
from livebode.core.lines import Lines
from livebode.core.loop import Loop
from livebode.core.model import Gain, Model, as_model
from livebode.core.parameters import Parameters
from livebode.core.response import PER_LINE, PER_RESPONSE, Quantity, Response, Responses, widened
from livebode.core.spectra import NOT_WHOLE, SPIKE, Spectra, SpectraLayout, rms
from livebode.core.wording import counted, rounded_down

__all__ = [
    "NOT_WHOLE",
    "PER_LINE",
    "PER_RESPONSE",
    "PID",
    "SPIKE",
    "BaselineError",
    "Block",
    "Cascade",
    "Channel",
    "ConfigError",
    "DamageWarning",
    "DesignError",
    "Emit",
    "Event",
    "ExtraError",
    "FitError",
    "Gain",
    "GridError",
    "Lines",
    "LivebodeError",
    "Loop",
    "Model",
    "OutputError",
    "Parameters",
    "PositionPD",
    "Quantity",
    "RecordError",
    "RecordingError",
    "Response",
    "Responses",
    "ServerError",
    "SignalError",
    "SimulationError",
    "SourceError",
    "Spectra",
    "SpectraLayout",
    "UsageError",
    "as_model",
    "counted",
    "ignore",
    "nearest_name",
    "rms",
    "rounded_down",
    "widened",
]
