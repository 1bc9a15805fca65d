"""The Bode plot of a machine while the machine works.

livebode tracks the frequency response of a servo axis in closed loop, sample by sample, with tested error bounds.

Three arrays of a machine in a control loop (its excitation w, input u and output y) to a Bode plot with bounds::

    response = livebode.frf(w, u, y, fs=4000)
    response.plot()

The same without a machine::

    >>> import livebode
    >>> block, _ = livebode.example_axis().run()        # a simulated belt axis, for a second
    >>> response = livebode.frf(block["w"], block["u"], block["velocity"], fs=4000)
    >>> response.magnitude_db.round(1)[:3]
    array([  2.6,  -2.9, -12.7])
    >>> response(60.0).round(2)                         # the value at a measured line
    np.complex128(4.3-1.7j)
    >>> axes = response.plot()                          # Bode; also "nyquist", "nichols"
    >>> frame = response.to_pandas()                    # or to_xarray(), to_frd()

`track` gives a response for each moment. A recording, or a run that `livebode run` recorded::

    log = livebode.open("log.csv")
    response = livebode.frf(log["w"], log["u"], log["velocity"], fs=log.rate_hz)
    run = livebode.open("runs/monday")
    run.plot(), run.fit(), run.margins(), run.events

With a machine, step by step:

1. Excitation: `design` an experiment within the limits of the machine, or make a period yourself with `multisine`,
   `prbs`, `chirp` or `stepped_sine`.
2. Recording: `open_log` reads a file as a `Log`, which yields `Block` objects. `recognise` finds the excitation in it.
3. Responses: a `Tracker` with its `Settings` takes Blocks and returns `Responses`; one of them is a `Response`.
4. Model: `fit` a `PhysicalModel` ("two-mass") or `fit_rational`; a `Fitter` fits every response of a run.
5. Changes: `learn` a `Baseline` from healthy runs; a `Monitor` compares a run with it and yields `Event` objects.

Names by subject:

- Arrays and files to responses: frf, track, welch, open
- Samples and lines: Block, Channel, Lines, Log, open_log
- Responses: Response, Responses, Settings, Tracker, NonPeriodicTracker, MotionCorrection, SlidingDFT
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
  RecordingError, ServerError, SignalError, SimulationError, SourceError, StateError, TuneError, UsageError; a finding
  on signals is a SignalWarning

Units are last in a name (`rate_hz`, `time_s`). A bound of `c` sigma covers the true value with probability
1 − exp(−c²). Every public name loads its part of livebode when it is first used. These names are the public interface,
together with the `__all__` of the packages that docs/reference/python.md lists; other modules may change at any time.
"""

from livebode.on_first_use import on_first_use
from livebode.version import __version__ as __version__

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
