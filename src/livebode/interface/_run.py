"""Run: a run directory for a Python session."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property, partial
from html import escape
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal

from livebode.analysis import Margins, RunMean, averaged, fit_averaged, loop_report
from livebode.configuration import Axis, FitSection, MachineSection, recorded_configuration, recorded_loop
from livebode.core import (
    CIRCLE_FACTOR,
    Event,
    Lines,
    LivebodeError,
    Loop,
    MatrixResponses,
    PlotKind,
    Response,
    Responses,
    UsageError,
    counted,
    moment,
    moments_by,
)
from livebode.fitting import Fit
from livebode.locations import Url, local_copy, location, shared_copy
from livebode.pictures import picture_html, plot_responses
from livebode.plugins import loaded, named
from livebode.records import PARAMETERS, RunRecord
from livebode.tables import Table

if TYPE_CHECKING:
    import numpy as np


_PICTURED_VALUES_MAX = 1 << 22
"""Responses × lines of a run that are read, in about a second, because a notebook shows it."""


class Run:
    """A run that `livebode run` recorded: its responses, fits and events, and what can be computed from them.

    Only run.json is read at first; everything else is read when it is first used, once. Of a run that is still being
    written, this is what was written by then; open it again for more.

    Parameters
    ----------
    path
        The run directory, or its URL (docs/how-to/remote.md).
    entry
        Of a matrix run: the entry of which this is the view as an ordinary run, as "velocity2/u1". Without it only
        `matrix`, `entries`, `events` and what is in run.json can be read.

    Attributes
    ----------
    path
        Its directory; of a run at a URL that of the downloaded copy, which exists as long as this object.
    summary
        run.json: configuration, versions, counts (docs/run-directory.md).
    lines
        The measured lines.
    finished
        Whether the source ended and everything is written.

    Raises
    ------
    RecordError
        If the directory is not of a run, or run.json cannot be read, or a matrix run has no such entry. A damaged part
        of the tables is skipped with a `DamageWarning`.
    LocationError
        If there is no complete run at the URL, or it cannot be downloaded.

    Examples
    --------
    >>> import livebode, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     run = livebode.example_run(f"{folder}/monday")
    ...     print(livebode.Run(f"{folder}/monday"))
    ...     run.average.frequency_hz[:3], round(run.fit()["resonance"], 1)
    <Run 'monday': velocity from u, excited by w; 13 lines, 20 … 140 Hz; 40 responses in 1 s; 1 event>
    (array([20., 30., 40.]), 59.4)
    """

    def __init__(self, path: str | PathLike[str] | Url, entry: str | None = None) -> None:
        place = location(path)
        self._copy = shared_copy(place) if isinstance(place, Url) else None  # exists as long as this object
        with local_copy(place) as self.path:
            self._record = RunRecord.open(self.path, matrix=True, entry=entry)
        self.summary: Mapping[str, Any] = self._record.summary
        self.lines: Lines = self._record.lines
        self.finished = self._record.finished

    @property
    def machine(self) -> str:
        """The machine as a path, such as "Graz/line 2/press 4/X", from [machine]; empty without one."""
        return MachineSection(**self.summary.get("machine", {})).path

    @property
    def entries(self) -> tuple[str, ...]:
        """Names of the entries of a matrix run, "output/input"; none of an ordinary run."""
        return tuple(self._record.entries)

    @cached_property
    def matrix(self) -> MatrixResponses:
        """All matrices of a matrix run with their covariance, as written.

        Raises
        ------
        RecordError
            If it is not a matrix run, or damage leaves no matrix.
        """
        return self._record.matrix()

    @cached_property
    def responses(self) -> Responses:
        """All responses, as written, in memory: 100 bytes for each value; `batches` reads a long run in parts.

        Raises
        ------
        RecordError
            If it is a matrix run, or damage leaves no response.
        """
        return self._record.responses()

    def batches(self, from_s: float | None = None, to_s: float | None = None) -> Iterator[Responses]:
        """The responses in parts of bounded size; with times, those whose effective time is between them, inclusive."""
        if from_s is None and to_s is None:
            return self._record.batches()
        low, high = (-float("inf") if from_s is None else from_s), (float("inf") if to_s is None else to_s)
        return self._record.between(low, high)

    @cached_property
    def events(self) -> list[Event]:
        """Gaps, spikes, lines that became invalid, alarms, and damage of the record itself, in order."""
        return self._record.events()

    @cached_property
    def parameters(self) -> Table:
        """Parameters and margins that were fitted during the run, a row for each time and name; empty without [fit].

        A table with the columns ``time_s``, ``schedule``, ``model``, ``name``, ``value``, ``sigma``, ``unit``,
        ``status`` and others: ``run.parameters["value"]`` is an array, ``run.parameters.text("name")`` its words, and
        ``polars.DataFrame(run.parameters)`` or ``pyarrow.table(run.parameters).to_pandas()`` a DataFrame.
        RecordError if damage leaves no row.
        """
        parts = self._record.undamaged(self._record.tables("parameters"), "parameters")
        return Table.join([Table.empty(PARAMETERS.schema), *parts])

    @cached_property
    def _averaged(self) -> RunMean:
        return averaged(self._record)

    @property
    def average(self) -> Response:
        """The mean of all valid responses (docs/export.md); for a run with tracking.average the newest valid one.

        Raises
        ------
        SignalError
            If no line is ever valid.
        """
        return self._averaged.response

    def plot(
        self,
        kind: PlotKind = "bode",
        *,
        axes: Any = None,
        ax: Any = None,
        bounds: bool = True,
        c: float = CIRCLE_FACTOR,
        label: str | None = None,
        color: Any = None,
    ) -> Any:
        """Draw the average with its bound, and behind it the responses of the whole run; see `Responses.plot`.

        Examples
        --------
        >>> import livebode, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     axes = livebode.example_run(f"{folder}/monday").plot("nyquist")
        >>> axes.get_legend_handles_labels()[1]
        ['average', 'bound: 95 %']
        """
        average = self._averaged
        words = label or "average"
        bound, axes = c if bounds else None, ax if axes is None else axes
        return plot_responses(
            average.overview, kind, axes=axes, c=bound, label=words, color=color, front=average.response
        )

    bode = plot

    def fit(
        self,
        model: str | None = None,
        *,
        output: Literal["velocity", "position"] | None = None,
        side: Literal["motor", "load"] | None = None,
        radius_m: float | None = None,
        inertia_ratio: float | None = None,
        fixed: Mapping[str, float] | None = None,
        free: Sequence[str] | None = None,
        band_hz: tuple[float, float] | None = None,
        hold: Literal["zero-order", "none"] | None = None,
    ) -> Fit:
        """Fit a model to the average. Defaults are the [fit] of the run; those of `livebode fit` without one.

        Parameters
        ----------
        model
            ``"rigid"``, ``"two-mass"``, ``"three-mass"``, ``"two-mass-gain"`` or ``"auto"``.
        output
            Quantity of y; default: by its unit, without one the better fit.
        side
            Where y is measured.
        radius_m
            Of the pulley, for a load in linear motion.
        inertia_ratio
            Of the load to the motor, if known.
        fixed, free
            Parameters to fix at a value, and to fit although they are fixed by default.
        band_hz
            Lowest and highest frequency to use.
        hold
            Whether the input is constant between samples.

        Returns
        -------
        Fit
            Its `status` is "ok", or the reason why there are no numbers.

        Raises
        ------
        ConfigError, UsageError, FitError
            If an argument is invalid; the message names it.
        """
        given = {
            "model": model,
            "output": output,
            "side": side,
            "radius_m": radius_m,
            "inertia_ratio": inertia_ratio,
            "fixed": None if fixed is None else dict(fixed),
            "free": None if free is None else list(free),
            "band_hz": None if band_hz is None else list(band_hz),
            "hold": hold,
        }
        return fit_averaged(self._averaged, self._section(given))[0]

    def margins(self, fit: Fit | None = None, *, loop: Loop | None = None) -> Margins:
        """Stability margins of the loop around a fit, with bounds; `livebode margins` also proposes a filter.

        Parameters
        ----------
        fit
            The plant; default: that of `fit()`.
        loop
            Controllers; default: the [loop] of the run.

        Returns
        -------
        Margins
            One row.

        Raises
        ------
        UsageError
            If the loop's feedback is not described.
        FitError
            If no model could be fitted.

        Examples
        --------
        >>> import livebode, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     margins = livebode.example_run(f"{folder}/monday").margins()
        >>> margins.of("phase_margin").round(), margins.frequency_hz.shape
        (array([82.]), (1, 6))
        """
        responses = Responses.join(list(self._record.steady_batches()))
        if loop is None:
            loop = recorded_loop(self._record.summary).build(self.lines.rate_hz)
        return loop_report(fit or self.fit(), self._averaged.words, responses, loop).margins

    def widget(self, every_s: float = 1.0) -> Any:
        """A widget of a notebook that follows the run while it is being written (extra `notebook`).

        Parameters
        ----------
        every_s
            Seconds between two looks at the record.

        Returns
        -------
        anywidget.AnyWidget
            The newest response with its bound, in front of those before it.

        Raises
        ------
        ExtraError
            If anywidget is not installed.

        Examples
        --------
        >>> import livebode, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     widget = livebode.example_run(f"{folder}/monday").widget()
        >>> widget.finished, widget.html[:49]
        (True, '<div>Run monday: &lt;Responses: 40 of plant in ra')
        """
        from livebode.interface._widget import RunWidget

        return RunWidget(self.path, every_s)

    def analysis(self, name: str) -> Callable[..., Any]:
        """The analysis of this name that a plug-in adds, to be called with its options (docs/how-to/plugin.md).

        Raises
        ------
        UsageError
            If no installed plug-in has it.
        """
        analyses = named("analyses")
        if name not in analyses:
            known = f"choose {', '.join(analyses)}" if analyses else "install the plug-in that has it"
            raise UsageError(
                "unknown-name",
                f"there is no analysis {name!r}",
                known,
                argument="name",
                value=name,
                allowed=list(analyses),
            )
        return partial(loaded(analyses[name].function), self)

    def _section(self, given: Mapping[str, Any]) -> FitSection:
        data = {"source": {"log": str(self.path)}, "signals": {"output": "y"}}
        own = recorded_configuration(self._record.summary).get("fit", {})
        named = {key: value for key, value in given.items() if value is not None}
        section = Axis.of(data | {"fit": own | named}, "the arguments").fit
        assert section is not None
        return section

    def __fspath__(self) -> str:
        return str(self.path)

    def __repr__(self) -> str:
        return f"<Run {self.path.name!r}: {'; '.join(self._facts())}>"

    def _repr_html_(self) -> str:
        rows = "".join(f"<li>{escape(fact)}</li>" for fact in self._facts())
        return f"<div>Run <b>{escape(self.path.name)}</b><ul>{rows}</ul>{self._picture()}</div>"

    def _picture(self) -> str:
        """The average as HTML; none of a run that is not finished, too long to be read for it, or without one."""
        responses = self.summary.get("counts", {}).get("responses", 0)
        if not self.finished or self.entries or responses * len(self.lines) > _PICTURED_VALUES_MAX:
            return ""
        with suppress(LivebodeError):
            return picture_html(self._averaged.overview, self.average)
        return ""

    def _facts(self) -> list[str]:
        signals = self.summary.get("configuration", {}).get("signals") or {}
        names = f"{_listed(signals.get('output', 'response'))}"
        names += f" from {_listed(signals['input'])}" if signals.get("input") else ""
        names += f", excited by {_listed(signals['excitation'])}" if signals.get("excitation") else ""
        f: np.ndarray = self.lines.frequency_hz
        facts = [names, f"{counted(len(f), 'line')}, {f[0]:g} … {f[-1]:g} Hz", self._extent()]
        try:
            return [*facts, counted(len(self.events), "event")]
        except LivebodeError as error:  # a description never raises, whatever happened to the directory
            return [*facts, f"events unreadable ({error.code})"]

    def _extent(self) -> str:
        """Number of responses, duration and, if the run has a clock, its start."""
        clock = self._record.clock
        with moments_by(clock):
            start = f" from {moment(0.0)}" if clock.pieces and not clock.utc else ""
        if "counts" not in self.summary:
            return f"not finished{start}"
        duration_s = self.summary["counts"]["samples"] / self.lines.rate_hz
        return f"{counted(self.summary['counts']['responses'])} in {duration_s:.4g} s{start}"


def _listed(names: str | list[str]) -> str:
    """One name, or several of a matrix run."""
    return names if isinstance(names, str) else ", ".join(names)
