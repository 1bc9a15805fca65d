"""Fitter: responses in, parameters with bounds out, at the rate of the responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import (
    OK,
    Emit,
    Event,
    FitError,
    GridError,
    Lines,
    Parameters,
    Responses,
    SignalError,
    Stage,
    StatefulBase,
    ignore,
)
from livebode.fitting.delays import DelayChoice
from livebode.fitting.models import model_named
from livebode.fitting.physical import DELAY, EvaluationGrid, Hold, PhysicalModel
from livebode.fitting.problem import MeasuredRows, Problem
from livebode.fitting.rows import FRICTION, NO_RESPONSE, SENTENCES, FittedRows, fit_rows
from livebode.fitting.weights import epsilon_for, squares


class FitTask(NamedTuple):
    """Rows that share a start and an ε: the Responses, the problem, the lines in use with the degrees of freedom of
    their sigmas, the values from which each row starts, and its ε. None: a scan, and an ε of its own."""

    responses: Responses
    problem: Problem
    measured: MeasuredRows
    noise_dof: Floats
    start: Floats | None
    epsilon: Floats | None

    def fitted(self) -> FittedRows:
        """The rows fitted by themselves."""
        return fit_rows(self.problem, self.measured, self.noise_dof, self.start, self.epsilon)

    @property
    def kind(self) -> tuple[object, ...]:
        """Equal for tasks that one computation can fit."""
        return *self.problem.identity, self.start is None, self.epsilon is None


def fitted_together(tasks: Sequence[FitTask]) -> list[FittedRows]:
    """The rows of each task; in NumPy, tasks of one kind are one computation."""
    kinds: dict[tuple[object, ...], list[int]] = {}
    rows: dict[int, FittedRows] = {}
    for i, task in enumerate(tasks):
        if task.problem.native is not None:  # to join the arrays would cost more than it saves
            rows[i] = task.fitted()
        else:
            kinds.setdefault(task.kind, []).append(i)
    for members in kinds.values():
        rows.update(zip(members, _fitted_alike([tasks[i] for i in members])))
    return [rows[i] for i in range(len(tasks))]


def _fitted_alike(tasks: Sequence[FitTask]) -> list[FittedRows]:
    first = tasks[0]
    if len(tasks) == 1:
        return [first.fitted()]
    start, epsilon = _joined([task.start for task in tasks]), _joined([task.epsilon for task in tasks])
    noise_dof = np.concatenate([task.noise_dof for task in tasks])
    every = fit_rows(first.problem, MeasuredRows.join([task.measured for task in tasks]), noise_dof, start, epsilon)
    ends = np.cumsum([len(task.noise_dof) for task in tasks])[:-1]
    return [FittedRows(*parts) for parts in zip(*(np.split(column, ends) for column in every))]


def _joined(parts: Sequence[Floats | None]) -> Floats | None:
    """The rows of all; tasks of one kind have them all, or none has."""
    there = [part for part in parts if part is not None]
    return np.concatenate(there) if there else None


_GROUP = 16  # rows that share a start and an ε, however they arrive
_MEMORY = 64  # rows that ε is taken from
_KNOWN = 4  # rows that ε is taken from at least


class Fitter(StatefulBase):
    """Fits a model to each Response on arrival, starting from the last valid fits.

    Rows are processed in groups of sixteen: a row starts from the last valid fit of the previous groups, and uses the ε
    of their newest 64 valid rows, so that ε is constant within a group; only the rows of the first group find their
    own. The results do not depend on how the responses are cut into batches (to rounding). A row whose fit fails from
    this start is scanned again (docs/explanation/fits.md).

    Delay: none beyond that of the Responses.

    Bias: an incomplete model has an error beyond noise that is the same in neighbouring rows; ε covers its size, but
    averaging does not remove it. Responses of a moving axis contain the motion (see `MotionCorrection`).

    Parameters
    ----------
    model
        A PhysicalModel, or the name of one ("two-mass") with `options`.
    fixed, free
        Parameters fixed at a value; names of those that the model fixes by default (delay, friction) and that are to be
        fitted.
    band_hz
        Lowest and highest frequency of the lines that are used; all by default.
    hold
        "zero-order": the input is held between samples, as in a drive; "none": the continuous response.

    Raises
    ------
    UsageError
        If model, parameter names or bounds are invalid.
    FitError
        If the band has too few lines.

    Examples
    --------
    >>> from livebode.fitting import TwoMass
    >>> fitter = Fitter(TwoMass(radius_m=0.019))
    >>> fitter.names[:4]
    ('Js', 'mL', 'Keff', 'bs')
    """

    _stage = Stage("fitter", 1)

    def __init__(
        self,
        model: PhysicalModel | str,
        *,
        fixed: Mapping[str, float] | None = None,
        free: Sequence[str] = (),
        band_hz: tuple[float, float] | None = None,
        hold: Hold = "zero-order",
        **options: object,
    ) -> None:
        self.model = model_named(model, **options) if isinstance(model, str) else model
        self._fixed, self._free = dict(fixed or {}), tuple(free)
        self._band, self._hold = band_hz, hold
        Problem(
            self.model, EvaluationGrid(np.ones(1), 1.0, hold), self._fixed, self._free
        )  # rejected before anything starts
        self._lines: Lines | None = None
        self._word: str = NO_RESPONSE
        self._seen = 0
        self._start: Floats | None = None
        self._next: Floats | None = None
        self._epsilon: float | None = None
        self._rows: list[tuple[Floats, Floats, Floats]] = []
        self._unread: list[tuple[MeasuredRows, Complex, NDArray[np.int64]]] = []
        self._delay = DelayChoice()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, including fixed ones."""
        return self.model.names

    @property
    def identity(self) -> str:
        """Equal for fitters with the same settings."""
        return self._identity

    @property
    def derived_names(self) -> tuple[str, ...]:
        """Names of the quantities of `derived`."""
        return self.model.derived_names

    def process(self, responses: Responses, emit: Emit = ignore) -> Parameters:
        """Parameters of each Response, in order.

        `emit` receives an event where fits begin to fail ("fit-failed") and where they are valid again ("fit-resumed").

        Raises
        ------
        SignalError
            If the Responses are not of a plant.
        GridError
            If they are on other lines than the previous ones.
        """
        parts: list[Parameters] = []
        first = 0
        while not parts or first < len(responses):
            task = self.task(responses[first:] if first else responses)
            parts.append(self.finish(task, task.fitted(), emit))
            first += len(task.responses)
        return parts[0] if len(parts) == 1 else Parameters.join(parts)

    def task(self, responses: Responses) -> FitTask:
        """The fit of the first of these Responses, as many as the group still lacks; `finish` accepts its result.

        The errors are those of `process`. See `fit_each`, which fits the tasks of several fitters at once.
        """
        if responses.quantity != "plant":
            raise SignalError(
                "wrong-quantity",
                f"a model is fitted to the plant, and these responses are of {responses.quantity!r}",
                "track the plant",
                quantity=responses.quantity,
            )
        use = self._prepare(responses.lines)
        lacking = _GROUP - self._seen % _GROUP
        part = responses if len(responses) <= lacking else responses[:lacking]
        problem, rows = self._delay.problem, len(part)
        epsilon = None if self._epsilon is None else np.full(rows, self._epsilon)
        start = None if self._start is None else np.repeat(problem.with_held(self._start)[np.newaxis], rows, axis=0)
        return FitTask(part, problem, *measured_of(part, use), start, epsilon)

    def finish(self, task: FitTask, rows: FittedRows, emit: Emit = ignore) -> Parameters:
        """Parameters of a task from its fitted rows; the next task starts from them."""
        rows = self._delay.weigh(self._seen // _GROUP, task.measured, task.noise_dof, rows)
        good = np.flatnonzero(rows.status == OK)
        near = np.flatnonzero((rows.status == OK) | (rows.status == FRICTION))
        if good.size:
            self._unread.append((task.measured, rows.response, good))
        if near.size:
            self._next = rows.ended[near[-1]]
        self._seen += len(task.responses)
        if len(task.responses) and self._seen % _GROUP == 0:
            self._finish_group(task.problem)
            self._delay.decide()
        parameters = self._parameters(task.responses, rows)
        self._report(parameters, emit)
        return parameters

    def derived(self, parameters: Parameters) -> Parameters:
        """Derived quantities with bounds: resonances, damping ratios, quality factors, ratios."""
        return parameters.derived(self.model.derived_names, self.model.derived_units, self.model.derived)

    @property
    def held(self) -> dict[str, float]:
        """Parameters that are not fitted, and their values."""
        return Problem(self.model, EvaluationGrid(np.ones(1), 1.0, self._hold), self._fixed, self._free).held

    def start_of(self, responses: Responses, parameters: Parameters) -> tuple[Problem, MeasuredRows, Floats]:
        """The basis of one row's fit: the problem, the lines in use, and the degrees of freedom of its sigmas."""
        measured, noise_dof = measured_of(responses, self._prepare(responses.lines))
        late = DELAY in parameters.names and parameters.sigma[0, parameters.index(DELAY)] > 0
        return self._delay.freed if late else self._delay.held, measured, noise_dof

    @property
    def problem(self) -> Problem:
        """Problem as the user specified it."""
        return self._delay.held

    @property
    def fixed(self) -> frozenset[str]:
        """Names of the parameters that the user fixes."""
        return frozenset(self._fixed)

    def may_take_delay(self) -> bool:
        """Whether a delay is fixed by default, not by the user."""
        return DELAY in self.held and DELAY not in self._fixed

    @property
    def grid(self) -> EvaluationGrid:
        """The lines of the band; RuntimeError before the first responses, which define them."""
        if self._lines is None:
            raise RuntimeError("the fitter has processed no responses, so its lines are not known; process some first")
        return self._delay.problem.grid

    def _state(self) -> dict[str, Any]:
        self._read_rows()
        rows = {f"rows {i}": np.array(part) for i, part in enumerate(zip(*self._rows))}
        arrays = {"start": self._start, "next": self._next} | rows
        return {"seen": self._seen, "word": self._word, "epsilon": self._epsilon, "delay": self._delay} | arrays

    def _load(self, state: dict[str, Any]) -> None:
        self._delay.restore(state["delay"])
        self._seen, self._word, self._epsilon = int(state["seen"]), str(state["word"]), state["epsilon"]
        self._start, self._next = state["start"], state["next"]
        self._unread = []
        self._rows = list(zip(state["rows 0"], state["rows 1"], state["rows 2"])) if "rows 0" in state else []

    @property
    def _identity(self) -> str:
        parts = (self.model, sorted(self._fixed.items()), self._free, self._band, self._hold)
        return f"{type(self.model).__qualname__} {parts!r}"

    def _prepare(self, lines: Lines) -> NDArray[np.bool_]:
        """Which lines are used."""
        if self._lines is None:
            grid = EvaluationGrid.of(lines, self._hold)
            low, high = self._band or (0.0, np.inf)
            use = (grid.frequency_hz >= low) & (grid.frequency_hz <= high)
            problem = Problem(self.model, grid._replace(frequency_hz=grid.frequency_hz[use]), self._fixed, self._free)
            if 2 * np.count_nonzero(use) <= problem.size:
                band = f"the band {low:g} … {high:g} Hz has" if self._band else "there are"
                raise FitError(
                    "too-few-lines",
                    f"{band} {np.count_nonzero(use)} lines, too few for {problem.size} free parameters of "
                    f"{self.model.name!r}",
                    "take more lines, or hold parameters",
                    lines=int(np.count_nonzero(use)),
                    parameters=problem.size,
                    model=self.model.name,
                )
            self._lines, self._use = lines, use
            self._delay.begin(problem, may_free=DELAY not in self._fixed)
        elif lines != self._lines:
            raise GridError(
                "not-alike",
                "these responses are on other lines than the previous ones",
                "use a new Fitter for them",
                bins=list(lines.bins),
                window=lines.window,
            )
        return self._use

    def _read_rows(self) -> None:
        """Squares of the rows that ε is taken from: at once for a group, and not for each response."""
        for measured, response, good in self._unread:
            parts = squares(measured, response)
            self._rows += [(parts[0][i], parts[1][i], parts[2][i]) for i in good]
        self._unread = []

    def _finish_group(self, problem: Problem) -> None:
        self._read_rows()
        self._rows = self._rows[-_MEMORY:]
        self._start = self._next
        if len(self._rows) >= _KNOWN:
            residual, noise, size = (np.concatenate(part)[np.newaxis] for part in zip(*self._rows))
            dof = 2.0 * np.count_nonzero(size) - problem.size * len(self._rows)
            self._epsilon = float(epsilon_for(residual, noise, size, np.array([dof]))[0])

    def _parameters(self, responses: Responses, rows: FittedRows) -> Parameters:
        return Parameters(
            model=self.model.name, names=self.model.names, units=self.model.units, value=rows.values,
            covariance=rows.covariance, status=rows.status, epsilon=rows.epsilon, chi2=rows.chi2, dof=rows.dof,
            sample=responses.sample, time_s=responses.time_s, schedule=responses.schedule,
        )  # fmt: skip

    def _report(self, parameters: Parameters, emit: Emit) -> None:
        for i, word in enumerate(parameters.status):
            if word == self._word:
                continue
            self._word, sample, time_s = str(word), int(parameters.sample[i]), float(parameters.time_s[i])
            kind = "fit-resumed" if word == OK else "fit-failed"
            emit(Event(kind, sample, time_s, SENTENCES[self._word], {"status": self._word}))


def measured_of(responses: Responses, use: NDArray[np.bool_]) -> tuple[MeasuredRows, Floats]:
    """The lines in use as rows to fit, and the degrees of freedom of their sigmas."""
    value, sigma, valid = responses.value, responses.sigma, responses.valid
    if not use.all():
        value, sigma, valid = value[:, use], sigma[:, use], valid[:, use]
    usable = valid & np.isfinite(value)
    # If sigma is known at some lines only, the others would count as free of noise.
    known = np.isfinite(sigma) | ~usable
    if not known.all():
        sigma = np.where(known.all(axis=1, keepdims=True), sigma, np.nan)
    return MeasuredRows(value, sigma, usable), responses.dof
