"""The Bode plot of a machine while the machine works.

livebode tracks the frequency response of a servo axis in closed loop, sample by sample, with tested error bounds.

Quick start, without a machine::

    >>> import livebode
    >>> responses = livebode.example_responses()        # a simulated belt axis, tracked for a second
    >>> response = responses[-1]                        # the newest
    >>> response.magnitude_db.round(1)[:3]
    array([  2.6,  -2.9, -13.3])
    >>> response(60.0).round(2)                         # the value at a measured line
    np.complex128(4.27-1.64j)
    >>> axes = response.plot()                          # Bode; also "nyquist", "nichols"
    >>> frame = response.to_pandas()                    # or to_xarray(), to_frd()

A run that `livebode run` recorded::

    run = livebode.Run("runs/monday")
    run.plot(), run.fit(), run.margins(), run.events

With a machine, in this order:

1. Excitation: `design` an experiment within the limits of the machine, or make a period yourself with `multisine`,
   `prbs`, `chirp` or `stepped_sine`.
2. Recording: `open_log` reads a file as a `Log`, which yields `Block` objects. `recognise` finds the excitation in it.
3. Responses: a `Tracker` with its `Settings` takes Blocks and returns `Responses`; one of them is a `Response`.
4. Model: `fit` a `PhysicalModel` ("two-mass") or `fit_rational`; a `Fitter` fits every response of a run.
5. Changes: `learn` a `Baseline` from healthy runs; a `Monitor` compares a run with it and yields `Event` objects.

Names by subject:

- Samples and lines: Block, Channel, Lines, Log, open_log
- Responses: Response, Responses, Settings, Tracker, NonPeriodicTracker, MotionCorrection, SlidingDFT, welch
- Runs: Run
- Excitation: design, Excitation, chirp, low_crest_phases, multisine, odd_lines, prbs, quantised, recognise,
  stepped_sine
- Loop and controllers: Loop, Cascade, Model, PID, PositionPD
- Fits: Fit, Fitter, Parameter, Parameters, PhysicalModel, Rational, fit, fit_rational
- Monitoring: Baseline, Event, Monitor, learn
- Simulation: BeltAxis, SimulatedAxis, Strokes
- Examples: example_axis, example_responses, example_run
- Errors: LivebodeError (a ValueError) and its kinds ArchiveError, BaselineError, ConfigError, DesignError, ExtraError,
  FitError, FleetError, GridError, LocationError, MeasurementError, OutputError, PublishError, RecordError,
  RecordingError, ServerError, SignalError, SimulationError, SourceError, StateError, TuneError, UsageError

Units are last in a name (`rate_hz`, `time_s`). A bound of `c` sigma covers the true value with probability
1 − exp(−c²). Every public name loads its part of livebode when it is first used. These names are the public interface,
together with the `__all__` of the packages that docs/reference/python.md lists; other modules may change at any time.
"""

from typing import TYPE_CHECKING

from livebode.on_first_use import on_first_use
from livebode.version import __version__ as __version__

if TYPE_CHECKING:
    from livebode.analysis.learning import learn
    from livebode.core import (
        PID,
        ArchiveError,
        BaselineError,
        Block,
        Cascade,
        Channel,
        ConfigError,
        DesignError,
        Event,
        ExtraError,
        FitError,
        FleetError,
        GridError,
        Lines,
        LivebodeError,
        Loop,
        MeasurementError,
        Model,
        OutputError,
        Parameters,
        PositionPD,
        PublishError,
        RecordError,
        RecordingError,
        Response,
        Responses,
        ServerError,
        SignalError,
        SimulationError,
        SourceError,
        StateError,
        TuneError,
        UsageError,
    )
    from livebode.estimation import NonPeriodicTracker, Settings, Tracker, welch
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
    from livebode.interface._examples import example_axis, example_responses, example_run
    from livebode.interface._experiment import design
    from livebode.interface._run import Run
    from livebode.kernel import SlidingDFT
    from livebode.monitoring import Baseline, Monitor
    from livebode.motion import MotionCorrection
    from livebode.simulation import BeltAxis, SimulatedAxis, Strokes
    from livebode.sources import Log, open_log

_HOME = {
    "analysis.learning": ("learn",),
    "estimation": ("NonPeriodicTracker", "Settings", "Tracker", "welch"),
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
    "interface._examples": ("example_axis", "example_responses", "example_run"),
    "interface._experiment": ("design",),
    "interface._run": ("Run",),
    "kernel": ("SlidingDFT",),
    "monitoring": ("Baseline", "Monitor"),
    "motion": ("MotionCorrection",),
    "core": (
        "UsageError",
        "StateError",
        "TuneError",
        "SourceError",
        "SimulationError",
        "SignalError",
        "ServerError",
        "RecordingError",
        "RecordError",
        "MeasurementError",
        "MeasurementError",
        "OutputError",
        "PublishError",
        "LivebodeError",
        "LocationError",
        "FitError",
        "FleetError",
        "ExtraError",
        "DesignError",
        "ConfigError",
        "ArchiveError",
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
__getattr__ = on_first_use(__name__, _HOME)

__all__ = [
    "PID",
    "ArchiveError",
    "Baseline",
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
    "FleetError",
    "GridError",
    "Lines",
    "LivebodeError",
    "LocationError",
    "Log",
    "Loop",
    "MeasurementError",
    "Model",
    "Monitor",
    "MotionCorrection",
    "NonPeriodicTracker",
    "OutputError",
    "Parameter",
    "Parameters",
    "PhysicalModel",
    "PositionPD",
    "PublishError",
    "Rational",
    "RecordError",
    "RecordingError",
    "Response",
    "Responses",
    "Run",
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
    "TuneError",
    "UsageError",
    "chirp",
    "design",
    "example_axis",
    "example_responses",
    "example_run",
    "fit",
    "fit_rational",
    "learn",
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


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
