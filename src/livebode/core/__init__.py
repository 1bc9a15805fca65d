"""The types that all other packages use: samples, lines, responses, loops, events, errors."""

import logging
from typing import TYPE_CHECKING

from livebode.core.errors import (
    ArchiveError,
    BaselineError,
    ConfigError,
    DamageWarning,
    DesignError,
    ExtraError,
    FitError,
    FleetError,
    GridError,
    LivebodeError,
    LocationError,
    MeasurementError,
    OutputError,
    PublishError,
    RecordError,
    RecordingError,
    ServerError,
    SignalError,
    SimulationError,
    SourceError,
    StateError,
    TuneError,
    UsageError,
)
from livebode.on_first_use import on_first_use

if TYPE_CHECKING:
    from livebode.core._block import Block, Channel, nearest_name
    from livebode.core._event import Emit, Event, hand_over, ignore
    from livebode.core._frequency_response import PER_LINE, Quantity
    from livebode.core._kinds import PlotKind
    from livebode.core._loop import Loop
    from livebode.core._matrix_responses import CHANNELS_MAX, REASONS, MatrixResponses
    from livebode.core._plant_kinds import PlantKinds
    from livebode.core._plotting import plot_responses
    from livebode.core._response import PER_RESPONSE, Response, Responses, widened
    from livebode.core._spectra import LEFT_OUT, NOT_WHOLE, SPIKE, Spectra, SpectraLayout, rms
    from livebode.core._unit_reading import QuantityKind, UnitReading, read_unit, split_plant_unit
    from livebode.core._wording import counted, plural, rounded_down
    from livebode.core.controllers import PID, Cascade, PositionPD
    from livebode.core.lines import Lines
    from livebode.core.model import Gain, Model, as_model
    from livebode.core.parameters import Parameters
    from livebode.core.rows import RowArrays
    from livebode.core.state import Stage, Stateful, StatefulBase

_NAMES = {
    "_block": (
        "Block",
        "Channel",
        "nearest_name",
    ),
    "_event": (
        "Emit",
        "Event",
        "hand_over",
        "ignore",
    ),
    "_frequency_response": (
        "PER_LINE",
        "Quantity",
    ),
    "_kinds": ("PlotKind",),
    "_loop": ("Loop",),
    "_matrix_responses": (
        "CHANNELS_MAX",
        "REASONS",
        "MatrixResponses",
    ),
    "_plant_kinds": ("PlantKinds",),
    "_plotting": ("plot_responses",),
    "_response": (
        "PER_RESPONSE",
        "Response",
        "Responses",
        "widened",
    ),
    "_spectra": (
        "LEFT_OUT",
        "NOT_WHOLE",
        "SPIKE",
        "Spectra",
        "SpectraLayout",
        "rms",
    ),
    "_unit_reading": (
        "QuantityKind",
        "UnitReading",
        "read_unit",
        "split_plant_unit",
    ),
    "_wording": (
        "counted",
        "plural",
        "rounded_down",
    ),
    "controllers": (
        "PID",
        "Cascade",
        "PositionPD",
    ),
    "lines": ("Lines",),
    "model": (
        "Gain",
        "Model",
        "as_model",
    ),
    "parameters": ("Parameters",),
    "rows": ("RowArrays",),
    "state": (
        "Stage",
        "Stateful",
        "StatefulBase",
    ),
}
__getattr__ = on_first_use(__name__, _NAMES)

# Here because every module that logs uses this package, and `livebode --version` does not.
logging.getLogger("livebode").addHandler(logging.NullHandler())

__all__ = [
    "CHANNELS_MAX",
    "LEFT_OUT",
    "NOT_WHOLE",
    "PER_LINE",
    "PER_RESPONSE",
    "PID",
    "REASONS",
    "SPIKE",
    "ArchiveError",
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
    "FleetError",
    "Gain",
    "GridError",
    "Lines",
    "LivebodeError",
    "LocationError",
    "Loop",
    "MatrixResponses",
    "MeasurementError",
    "Model",
    "OutputError",
    "Parameters",
    "PlantKinds",
    "PlotKind",
    "PositionPD",
    "PublishError",
    "Quantity",
    "QuantityKind",
    "RecordError",
    "RecordingError",
    "Response",
    "Responses",
    "RowArrays",
    "ServerError",
    "SignalError",
    "SimulationError",
    "SourceError",
    "Spectra",
    "SpectraLayout",
    "Stage",
    "StateError",
    "Stateful",
    "StatefulBase",
    "TuneError",
    "UnitReading",
    "UsageError",
    "as_model",
    "counted",
    "hand_over",
    "ignore",
    "nearest_name",
    "plot_responses",
    "plural",
    "read_unit",
    "rms",
    "rounded_down",
    "split_plant_unit",
    "widened",
]
