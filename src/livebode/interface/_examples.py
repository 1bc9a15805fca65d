"""A simulated axis to try livebode on: every example of the documentation runs without a machine."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from livebode.configuration import Axis
from livebode.core import Lines, Responses
from livebode.estimation import Settings, Tracker
from livebode.excitation import multisine
from livebode.interface._run import Run
from livebode.runtime import Destination, run
from livebode.simulation import BeltAxis, Sensor, SimulatedAxis
from livebode.tables import Table, write_parquet

_RATE_HZ, _WINDOW, _HOP = 4000.0, 400, 100
_RUN_IN_S = 0.5  # until the response to the excitation repeats
_AMPLITUDE_N_M = 0.3  # of each line
_NOISE_RAD_PER_S = 0.05
_CONFIGURATION = {
    "signals": {"output": "velocity", "input": "u", "excitation": "w"},
    "lines": {"frequencies": "20:140:10", "window": _WINDOW},
    "tracking": {"hop": _HOP},
    "loop": {
        "velocity": {"gain": 0.2308, "integral_time_s": 0.2, "rate_hz": _RATE_HZ},
        "position": {"gain": 1.0, "rate_hz": _RATE_HZ / 2, "rate_divider": 2},
    },
    "fit": {"model": "two-mass"},
}


def example_axis(seconds: float = 1.0) -> SimulatedAxis:
    """A belt axis (Nevaranta 2016, Table I) at standstill, with 13 lines of excitation.

    Parameters
    ----------
    seconds
        Duration.

    Returns
    -------
    SimulatedAxis
        Sampled at 4 kHz; among its channels the excitation ``w``, the torque ``u`` (N m) and the motor's
        ``velocity`` (rad/s). The same samples at each call.

    Examples
    --------
    >>> axis = example_axis()
    >>> axis.samples, axis.rate_hz
    (4000, 4000.0)
    """
    lines = Lines.parse("20:140:10", _RATE_HZ, _WINDOW)
    return SimulatedAxis(
        BeltAxis(
            excitation_n_m=multisine(lines, _AMPLITUDE_N_M),
            sensor=Sensor(noise_rad_per_s=_NOISE_RAD_PER_S),
            run_in_s=_RUN_IN_S,
            seconds=seconds,
        )
    )


def example_responses(seconds: float = 1.0) -> Responses:
    """Responses of the plant of `example_axis`, 40 per second, tracked by the joint estimator.

    Parameters
    ----------
    seconds
        Duration.

    Returns
    -------
    Responses
        In rad/s/(N m), at 13 lines from 20 to 140 Hz.

    Examples
    --------
    >>> responses = example_responses()
    >>> responses.magnitude_db.shape
    (40, 13)
    """
    block, _ = example_axis(seconds).run()
    lines = Lines.parse("20:140:10", _RATE_HZ, _WINDOW)
    tracker = Tracker(Settings(lines=lines, excitation="w", input="u", output="velocity", hop=_HOP))
    return tracker.process(block)


def example_run(directory: str | PathLike[str], seconds: float = 1.0) -> Run:
    """Track the recording of `example_axis`, as `livebode run` does, with a fit and the description of the loop.

    Parameters
    ----------
    directory
        The new run directory; the recording is written beside it, as ``DIRECTORY.parquet``.
    seconds
        Duration.

    Raises
    ------
    OutputError
        If the directory exists already.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     run = example_run(f"{folder}/monday")
    ...     sorted(path.name for path in run.path.iterdir())
    ['events.jsonl', 'manifest.jsonl', 'parameters.parquet', 'responses.parquet', 'run-copy.json', 'run.json']
    """
    place = Path(directory)
    place.parent.mkdir(parents=True, exist_ok=True)
    log = place.with_name(f"{place.name}.parquet")
    block, _ = example_axis(seconds).run()
    names = {f"{channel.name} [{channel.unit}]": channel.name for channel in block.channels}
    write_parquet(log, Table.of({column: block[name] for column, name in names.items()}))
    axis = Axis.of(_CONFIGURATION | {"source": {"log": str(log), "rate_hz": _RATE_HZ}}, "the example")
    return Run(run(axis, Destination(place, lambda *_: None)).directory)
