"""livebode: the Bode plot of a machine while the machine works.

The names below are the public face; everything is importable from here and loaded when it is first used.
"""

import logging
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from livebode.core import (
        PID,
        BaselineError,
        Block,
        Cascade,
        Channel,
        ConfigError,
        DesignError,
        Event,
        ExtraError,
        FitError,
        GridError,
        Lines,
        LivebodeError,
        Loop,
        Model,
        OutputError,
        Parameters,
        PositionPD,
        RecordError,
        RecordingError,
        Response,
        Responses,
        ServerError,
        SignalError,
        SimulationError,
        SourceError,
        StateError,
        UsageError,
    )
    from livebode.estimation import Settings, Tracker, welch
    from livebode.excitation import (
        Excitation,
        chirp,
        low_crest_phases,
        multisine,
        odd_lines,
        prbs,
        quantised,
        recognise,
        stepped_sine,
    )
    from livebode.fitting import Fit, Fitter, Parameter, PhysicalModel, Rational, fit, fit_rational
    from livebode.kernel import SlidingDFT
    from livebode.motion import MotionCorrection
    from livebode.simulation import BeltAxis, SimulatedAxis, Strokes
    from livebode.sources import Log, open_log

logging.getLogger(__name__).addHandler(logging.NullHandler())  # quiet, but for a program that wants to hear of it

_HOME = {
    "estimation": ("Settings", "Tracker", "welch"),
    "excitation": (
        "Excitation",
        "chirp",
        "low_crest_phases",
        "multisine",
        "odd_lines",
        "prbs",
        "quantised",
        "recognise",
        "stepped_sine",
    ),
    "fitting": ("Fit", "Fitter", "Parameter", "PhysicalModel", "Rational", "fit", "fit_rational"),
    "kernel": ("SlidingDFT",),
    "motion": ("MotionCorrection",),
    "core": (
        "UsageError",
        "StateError",
        "SourceError",
        "SimulationError",
        "SignalError",
        "ServerError",
        "RecordingError",
        "RecordError",
        "OutputError",
        "LivebodeError",
        "FitError",
        "ExtraError",
        "DesignError",
        "ConfigError",
        "BaselineError",
        "PID",
        "Block",
        "Cascade",
        "Channel",
        "Event",
        "GridError",
        "Lines",
        "Loop",
        "Model",
        "Parameters",
        "PositionPD",
        "Response",
        "Responses",
    ),
    "simulation": ("BeltAxis", "SimulatedAxis", "Strokes"),
    "sources": ("Log", "open_log"),
}
_MODULE = {name: module for module, names in _HOME.items() for name in names}

__all__ = [
    "PID",
    "BaselineError",
    "BeltAxis",
    "Block",
    "Cascade",
    "Channel",
    "ConfigError",
    "DesignError",
    "Event",
    "Excitation",
    "ExtraError",
    "Fit",
    "FitError",
    "Fitter",
    "GridError",
    "Lines",
    "LivebodeError",
    "Log",
    "Loop",
    "Model",
    "MotionCorrection",
    "OutputError",
    "Parameter",
    "Parameters",
    "PhysicalModel",
    "PositionPD",
    "Rational",
    "RecordError",
    "RecordingError",
    "Response",
    "Responses",
    "ServerError",
    "Settings",
    "SignalError",
    "SimulatedAxis",
    "SimulationError",
    "SlidingDFT",
    "SourceError",
    "StateError",
    "Strokes",
    "Tracker",
    "UsageError",
    "chirp",
    "fit",
    "fit_rational",
    "low_crest_phases",
    "multisine",
    "odd_lines",
    "open_log",
    "prbs",
    "quantised",
    "recognise",
    "stepped_sine",
    "welch",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version  # slower to import than the whole of this package

        return version("livebode")
    if name not in _MODULE:
        raise AttributeError(f"module 'livebode' has no attribute {name!r}")
    return getattr(import_module(f"livebode.{_MODULE[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
