"""frf, track: frequency responses of arrays, prepared and tracked as `livebode run` does with a recording."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, get_args, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.configuration import Axis
from livebode.core import (
    LivebodeError,
    NamedSamples,
    RecordingError,
    Response,
    Responses,
    SignalWarning,
    UsageError,
    counted,
    series_of,
)
from livebode.dataclass import dataclass
from livebode.estimation import response_unit, welch
from livebode.fitting import RunningMean
from livebode.preparation import follower_of, make_settings, suitable_estimator
from livebode.runtime import follow_recording
from livebode.sources import ArrayRecording, Column, Log, Recording, log_of, split_unit, time_rank

FRFEstimator = Literal["auto", "joint", "direct", "lpm", "welch"]
FRFLines = str | Sequence[float] | NDArray[np.floating[Any]] | NDArray[np.integer[Any]]
_Signals = ArrayLike | Sequence[ArrayLike]
_EXPECTED = frozenset({"transient", "distortion-levels", "outlying-periods", "best-linear-approximation"})
"""Events that every good measurement may have: what they report is in the response."""
_ARGUMENTS = {
    "lines.frequencies": "lines",
    "lines.window": "window",
    "tracking.estimator": "estimator",
    "set tracking.accept_roles": "pass accept_roles=True",
    "tracking.hop": "hop",
    "signals.excitation": "w",
    "signals.input": "u",
    "signals.output": "y",
    "rate_hz": "fs",
    " (--estimator lpm)": "",
    "; --trend keep leaves it in": "",
    ", or check the recording with `livebode inspect`": "",
    'ignore the column (time = "none")': "give the values alone, as u.to_numpy()",
    "time column": "index",
}
"""The argument of each key of axis.toml that an error may name, and other words that do not fit a call."""


@overload
def frf(  # a list of arrays, which is an array too, means several outputs
    u: ArrayLike, y: Sequence[NDArray[Any]], /, *, fs: float | None = ..., lines: FRFLines = ...,
    window: int | Literal["auto"] = ..., estimator: FRFEstimator = ..., accept_roles: bool = ...,
) -> list[Response]: ...  # fmt: skip
@overload
def frf(
    u: ArrayLike, y: ArrayLike, /, *, fs: float | None = ..., lines: FRFLines = ...,
    window: int | Literal["auto"] = ..., estimator: FRFEstimator = ..., accept_roles: bool = ...,
) -> Response: ...  # fmt: skip
@overload
def frf(
    w: ArrayLike, u: ArrayLike, y: Sequence[NDArray[Any]], /, *, fs: float | None = ..., lines: FRFLines = ...,
    window: int | Literal["auto"] = ..., estimator: FRFEstimator = ..., accept_roles: bool = ...,
) -> list[Response]: ...  # fmt: skip
@overload
def frf(
    w: ArrayLike, u: ArrayLike, y: ArrayLike, /, *, fs: float | None = ..., lines: FRFLines = ...,
    window: int | Literal["auto"] = ..., estimator: FRFEstimator = ..., accept_roles: bool = ...,
) -> Response: ...  # fmt: skip
def frf(
    *signals: _Signals,
    fs: float | None = None,
    lines: FRFLines = "auto",
    window: int | Literal["auto"] = "auto",
    estimator: FRFEstimator = "auto",
    accept_roles: bool = False,
) -> Response | list[Response]:
    """The frequency response from u to y, with bounds: one, averaged over all samples.

    ``frf(w, u, y, fs=4000)`` is for a machine in a control loop: w is the excitation that is added in the loop, u the
    input of the plant, y its output. ``frf(u, y, fs=4000)`` is for an open loop: in a closed one feedback correlates u
    with the noise, and the result is biased by it. The signals are examined and tracked as by `livebode run`: the
    period and the lines of the excitation are found, a transient at the beginning is left out, lines that hum or
    distortion spoils are invalid. What else is found is a `SignalWarning`. `track` gives a response for each moment
    instead.

    Parameters
    ----------
    *signals
        ``(u, y)`` or ``(w, u, y)``. Each is a series of samples, shape (samples,): an array, a list, a column of pandas
        or Polars, an array of xarray. A list of arrays as y: several outputs. NaN: the sample is missing. A unit in the
        name of a column ("torque [N m]"), or in the attributes of xarray, is used.
    fs
        Samples per second. Default: from a DatetimeIndex, or a time coordinate.
    lines
        Frequencies in Hz, as numbers or as "20:140:20, 175"; "auto": those that the excitation contains.
    window
        Samples of a spectrum, a whole number of periods; "auto": one period. It is a number, not the name of a taper.
    estimator
        "joint" (unbiased in closed loop), "direct", or for signals that do not repeat "lpm" or "welch". "auto": "joint"
        with w, "direct" without, and "lpm" where the excitation does not repeat. `Response.estimator` has it.
    accept_roles
        Accept the order of the signals whatever they show.

    Returns
    -------
    Response or list of Response
        `value` of shape (lines,), in the unit of y by that of u; a list if y is a list. `time_s` is the middle of the
        samples used. `bound()` covers the true value with a probability of 95 %.

    Raises
    ------
    UsageError
        If a signal is not a series of real numbers, their lengths differ, or the rate is missing.
    SignalError
        If a signal is constant, nothing repeats, or no line is valid.
    GridError
        If a line is not on the grid of the window.

    Notes
    -----
    Bias: a machine that changes is averaged (`RunningMean` has the rules); "direct" by feedback; "welch" at a lightly
    damped resonance.

    Examples
    --------
    Three arrays to a Bode plot with bounds:

    >>> import livebode
    >>> block, _ = livebode.example_axis().run()
    >>> w, u, y = block["w"], block["u"], block["velocity"]
    >>> response = frf(w, u, y, fs=4000)
    >>> response
    <Response: plant, joint estimate, 13 lines, 20 … 140 Hz, all valid, at 0.50 s>
    >>> magnitude_axes, phase_axes = response.plot()
    """
    given, outputs = _roles("frf", signals)
    settings = _Settings(fs, lines, window, estimator, accept_roles)
    means: list[Response] = []
    for y in outputs:
        recorded = _Recorded.of("frf", given | {"y": y}, settings)
        if recorded.estimator == "welch":
            means.append(recorded.welch())
            continue
        mean = RunningMean()
        recorded.follow(mean.add, apart=True)
        means.append(replace(mean.response()[0], estimator=recorded.estimator))
        _warn_without_bound(means[-1])
    return means if isinstance(outputs, list) else means[0]


def track(
    *signals: ArrayLike,
    fs: float | None = None,
    lines: FRFLines = "auto",
    window: int | Literal["auto"] = "auto",
    hop: int | None = None,
    estimator: FRFEstimator = "auto",
    accept_roles: bool = False,
) -> Responses:
    """The frequency response from u to y at each moment, from a window that slides over the samples.

    Parameters
    ----------
    *signals, fs, lines, window, estimator, accept_roles
        As of `frf`; one output.
    hop
        Samples between responses; default: a quarter of the window, as of a run.

    Returns
    -------
    Responses
        `value` of shape (rows, lines). The effective time of a row is the centre of its window, so that it is half a
        window late; changes within a window are averaged. `mean()` is the response of `frf`.

    Raises
    ------
    UsageError, SignalError, GridError
        As of `frf`.

    Examples
    --------
    >>> import livebode
    >>> block, _ = livebode.example_axis().run()
    >>> responses = track(block["w"], block["u"], block["velocity"], fs=4000)
    >>> responses.value.shape, responses.time_s[[0, -1]].round(2)
    ((40, 13), array([-0.03,  0.95]))
    """
    given, outputs = _roles("track", signals)
    if isinstance(outputs, list):
        raise UsageError(
            "too-many", "track follows one output, and y is a list", "call it for each output", argument="y"
        )
    settings = _Settings(fs, lines, window, estimator, accept_roles, hop)
    recorded = _Recorded.of("track", given | {"y": outputs[0]}, settings)
    parts: list[Responses] = []
    recorded.follow(parts.append)
    return replace(Responses.join(parts), estimator=recorded.estimator)


def _roles(name: str, signals: Sequence[Any]) -> tuple[dict[str, Any], list[Any] | tuple[Any]]:
    """The signals but the output by their role, and the outputs: a list if several were given, else a tuple of one."""
    if len(signals) not in (2, 3):
        raise UsageError(
            "wrong-shape",
            f"{name} got {counted(len(signals), 'signal')} without a keyword",
            f"call {name}(u, y, fs=4000) or, in a control loop, {name}(w, u, y, fs=4000)",
            argument="signals",
        )
    *inputs, y = signals
    given = dict(zip(("w", "u") if len(inputs) == 2 else ("u",), inputs))
    if np.isscalar(y):
        raise UsageError(
            "wrong-shape", f"y is one number, {y!r}", f"if it is the rate, give it by its name: fs={y!r}", argument="y"
        )
    several = isinstance(y, list | tuple) and len(y) > 0 and not np.isscalar(y[0]) and y[0] is not None
    return given, list(y) if several else (y,)


@dataclass(frozen=True)
class _Settings:
    fs: float | None
    lines: FRFLines
    window: int | Literal["auto"]
    estimator: FRFEstimator
    accept_roles: bool
    hop: int | None = None

    def __post_init__(self) -> None:
        if isinstance(self.fs, bool | str) or (self.fs is not None and not np.isscalar(self.fs)):
            raise UsageError(
                "unreadable",
                f"fs={self.fs!r} is not a number",
                "give the samples per second, as fs=4000",
                argument="fs",
            )
        if self.window != "auto" and (isinstance(self.window, bool) or not isinstance(self.window, int | np.integer)):
            raise UsageError(
                "unreadable",
                f"window={self.window!r} is not a number of samples",
                "give a whole number of periods in samples, or 'auto'; what repeats needs no taper, and "
                "estimator='welch' has the one of Hann",
                argument="window",
            )
        if self.estimator not in get_args(FRFEstimator):
            raise UsageError(
                "not-one-of",
                f"estimator={self.estimator!r} is not supported",
                f"choose one of {', '.join(get_args(FRFEstimator))}",
                argument="estimator",
                allowed=list(get_args(FRFEstimator)),
            )

    @property
    def sections(self) -> dict[str, dict[str, Any]]:
        """As in axis.toml."""
        lines = self.lines if isinstance(self.lines, str) else ", ".join(f"{float(f):.12g}" for f in self.lines)
        window = self.window if self.window == "auto" else int(self.window)
        tracking: dict[str, Any] = {"accept_roles": self.accept_roles}
        return {
            "lines": {"frequencies": lines, "window": window},
            "tracking": tracking if self.hop is None else tracking | {"hop": self.hop},
        }


def _recording(name: str, series: Mapping[str, NamedSamples]) -> ArrayRecording:
    """Signals as a recording: channels w, u, y, and the time if there is one."""
    samples = next(iter(series.values())).values.size
    columns = [
        Column(role, one.unit or split_unit(one.name)[1], samples, key=one.values) for role, one in series.items()
    ]
    if timed := next((one.time for one in series.values() if one.time is not None), None):
        heading, values = timed
        time = Column(*split_unit(heading), samples, key=values)
        columns += [time] if time_rank(time) is not None else []
    return ArrayRecording(Path(name), columns)


@dataclass(frozen=True)
class _Recorded:
    """Signals as a recording with its configuration."""

    name: str
    axis: Axis
    log: Log

    @classmethod
    def of(cls, name: str, signals: Mapping[str, Any], settings: _Settings) -> _Recorded:
        roles = {"input": "u", "output": "y"} | ({"excitation": "w"} if "w" in signals else {})
        sections = settings.sections
        estimator: str = settings.estimator
        if estimator == "joint" and "w" not in signals:
            raise UsageError(
                "conflict",
                "estimator='joint' needs the excitation, and there are two signals",
                f"call {name}(w, u, y, …), or for an open loop take 'direct'",
                argument="estimator",
            )
        with _by_argument(name):
            log = _log(_recording(name, series_of(**signals)), settings.fs)
            estimator = suitable_estimator(log, roles)[0] if estimator == "auto" else estimator
            sections["tracking"]["estimator"] = estimator
            axis = Axis.of({"source": {"log": name}, "signals": roles} | sections, name)
        return cls(name, axis, log)

    @property
    def estimator(self) -> str:
        return self.axis.tracking.estimator

    def follow(self, take: Callable[[Responses], None], *, apart: bool = False) -> None:
        """Track it, with windows that overlap or are `apart`; what is found on the way is a warning."""
        with _by_argument(self.name):
            settings = make_settings(self.axis, self.log)
            if apart:
                settings = replace(settings, hop=settings.span)
            events = follow_recording(self.axis, self.log, follower_of(self.axis, settings), take)
        for event in events:
            if event.kind not in _EXPECTED:
                warnings.warn(f"{self.name}: {_as_arguments(event.message)}", SignalWarning, stacklevel=3)

    def welch(self) -> Response:
        """By Welch's method, whose segments are all of the recording."""
        with _by_argument(self.name):
            settings = make_settings(self.axis, self.log)
            lines, signals = settings.lines, [self.log[role] for role in ("w", "u", "y") if self.log.has(role)]
            response = welch(*signals, fs=lines.rate_hz, window=lines.window).sel(frequency_hz=lines.frequency_hz)
        return replace(response, unit=response_unit(self.log.channels, settings))


def _log(recording: Recording, fs: float | None) -> Log:
    try:
        return log_of(recording, rate_hz=None if fs is None else float(fs))
    except RecordingError as error:
        if error.code != "recording.rate-missing":
            raise
    raise UsageError(
        "missing",
        "the rate of the signals is not known: fs is missing",
        "give the samples per second, as fs=4000, or signals with a DatetimeIndex",
        argument="fs",
    )


def _warn_without_bound(response: Response) -> None:
    if not np.isfinite(response.bound()[response.valid]).any():
        warnings.warn(
            f"frf: the signals are so short that no bound is known, and the period of {response.lines.window} samples "
            "may be a wrong one; give three periods or more",
            SignalWarning,
            stacklevel=3,
        )


@contextmanager
def _by_argument(name: str) -> Iterator[None]:
    """Errors inside name the arguments of the function instead of keys of axis.toml."""
    try:
        yield
    except LivebodeError as error:
        error.message, error.remedy = _as_arguments(error.message), _as_arguments(error.remedy)
        if error.code == "signal.no-line-above-noise":
            error.remedy += '; window="auto" finds the period'
        error.place = "" if error.place == name else error.place
        raise


def _as_arguments(text: str) -> str:
    """
    >>> _as_arguments("set lines.window to 'auto'; to keep these roles, set tracking.accept_roles")
    "set window to 'auto'; to keep these roles, pass accept_roles=True"
    """
    for key, argument in _ARGUMENTS.items():
        text = text.replace(key, argument)
    return text
