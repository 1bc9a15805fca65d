"""Loop and MatrixLoop: the feedback, the injection point of the excitation, and when the signals were logged."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from livebode.arrays import Complex
from livebode.core.errors import UsageError
from livebode.core.model import Model, as_model
from livebode.dataclass import dataclass

Logged = Literal["before", "after"]
Controllers = Sequence[Sequence[object]]
CHANNELS_MAX = 8
"""Largest number of inputs, and of outputs, of a matrix of responses."""


@dataclass(frozen=True)
class Loop:
    """The closed loop u = E·w − F·y around the plant y = G·u, as recorded.

    Parameters
    ----------
    feedback
        F, from the measured output to the plant input with the sign of negative feedback: a Model, a
        python-control system or a number; None where it is not known.
    entry
        E, how the excitation reaches the plant input: 1 for one that is added to the torque reference, the
        velocity controller for one that is added to the velocity reference, −F for one added to the measured
        output.
    input_logged, excitation_logged, output_logged
        Whether each signal was logged before or after the tick's controller update. A drive reads y, computes u
        from it and applies it: the normal record has y before and u and w after the update. A u logged before the
        update is that of the previous tick; if this is not specified, the error is 10 % near a resonance.

    Raises
    ------
    TypeError
        If the feedback or the entry has no frequency response.
    UsageError
        If one of them has several inputs or outputs, or a `logged` word is not supported.

    Examples
    --------
    The loop of a drive: P position control around PI velocity control, and an excitation that is added to the torque.

    >>> from livebode import PID, Cascade
    >>> velocity = PID(gain=0.2308, integral_time_s=0.2, rate_hz=4000)
    >>> loop = Loop(feedback=Cascade(velocity=velocity, position=PID(gain=1.0, rate_hz=2000, rate_divider=2)))
    >>> loop.feedback_at([20.0, 140.0]).shape
    (2,)
    """

    feedback: Model | None = None
    entry: Model | None = None
    input_logged: Logged = "after"
    excitation_logged: Logged = "after"
    output_logged: Logged = "before"

    def __post_init__(self) -> None:
        for name in ("feedback", "entry"):
            if (given := getattr(self, name)) is not None:
                object.__setattr__(self, name, as_model(given))
        for name in ("input_logged", "excitation_logged", "output_logged"):
            if (word := getattr(self, name)) not in ("before", "after"):
                raise UsageError(
                    "not-one-of",
                    f"{name}={word!r} is not supported",
                    "choose 'before' or 'after' (the controller's update)",
                    argument=name,
                    value=word,
                    allowed=["before", "after"],
                )

    def advance_ticks(self, role: Literal["input", "excitation", "output"]) -> int:
        """Ticks by which the signal's spectrum is advanced, so that all spectra refer to the same tick."""
        late = {"input": "before", "excitation": "before", "output": "after"}[role]
        if getattr(self, f"{role}_logged") != late:
            return 0
        return -1 if role == "output" else 1

    def feedback_at(self, frequency_hz: ArrayLike) -> Complex:
        """F at these frequencies; UsageError where the Loop has no description of its feedback."""
        if self.feedback is None:
            raise UsageError(
                "missing",
                "the loop's feedback is missing",
                "describe its controllers, or use the joint estimator",
                argument="feedback",
            )
        return self.feedback.response(frequency_hz)

    def entry_at(self, frequency_hz: ArrayLike) -> Complex:
        """E at these frequencies."""
        if self.entry is None:
            return np.ones(np.shape(frequency_hz), dtype=np.complex128)
        return self.entry.response(frequency_hz)

    def plant(self, closed_loop: Complex, frequency_hz: ArrayLike) -> tuple[Complex, Complex]:
        """G = Gcl/(E − Gcl·F) from Gcl = Y/W, and its derivative dG/dGcl (Nevaranta 2016, eqs. (15), (16))."""
        entry, feedback = self.entry_at(frequency_hz), self.feedback_at(frequency_hz)
        denominator = entry - closed_loop * feedback
        return closed_loop / denominator, entry / denominator**2


@dataclass(frozen=True)
class MatrixLoop:
    """The closed loop u = E·w − F·y around a plant with several inputs and outputs, as recorded.

    Parameters
    ----------
    feedback
        F, one row for each input and one column for each output: Models, python-control systems, numbers, or None where
        an output does not act on an input. Each controller has its own rate (`PID.rate_hz`).
    entry
        E, one row for each input and one column for each excitation; None: each excitation is added to its input.
    input_logged, excitation_logged, output_logged
        As in `Loop`: whether the signals were logged before or after the update of the controllers.

    Raises
    ------
    TypeError
        If a controller has no frequency response.
    UsageError
        If the rows of a matrix are not equally long, or a `logged` word is not supported.

    Examples
    --------
    Two velocity controllers, one for each motor:

    >>> from livebode import PID
    >>> velocity = PID(gain=2.0, integral_time_s=0.1, rate_hz=4000)
    >>> loop = MatrixLoop(feedback=[[velocity, None], [None, velocity]])
    >>> loop.feedback_at([20.0, 40.0, 60.0]).shape
    (3, 2, 2)
    """

    feedback: Controllers | None = None
    entry: Controllers | None = None
    input_logged: Logged = "after"
    excitation_logged: Logged = "after"
    output_logged: Logged = "before"

    def __post_init__(self) -> None:
        for name in ("feedback", "entry"):
            if (given := getattr(self, name)) is not None:
                object.__setattr__(self, name, _models(given, name))
        self.timing  # noqa: B018 - it verifies the words

    @property
    def timing(self) -> Loop:
        """When the signals were logged."""
        return Loop(None, None, self.input_logged, self.excitation_logged, self.output_logged)

    def feedback_at(self, frequency_hz: ArrayLike) -> Complex:
        """F at these frequencies, shape (lines, inputs, outputs); UsageError where it is not described."""
        if self.feedback is None:
            raise UsageError(
                "missing",
                "the loop's feedback is missing",
                "describe its controllers, or use the joint estimator",
                argument="feedback",
            )
        return _response(self.feedback, frequency_hz)

    def entry_at(self, frequency_hz: ArrayLike, inputs: int) -> Complex:
        """E at these frequencies, shape (lines, inputs, excitations)."""
        if self.entry is None:
            return np.tile(np.eye(inputs, dtype=np.complex128), (np.size(frequency_hz), 1, 1))
        return _response(self.entry, frequency_hz)


def _models(given: Controllers, name: str) -> tuple[tuple[Model | None, ...], ...]:
    rows = tuple(tuple(None if cell is None else as_model(cell) for cell in row) for row in given)
    if not rows or len({len(row) for row in rows}) != 1 or not rows[0]:
        raise UsageError(
            "wrong-shape",
            f"{name} has rows of {', '.join(str(len(row)) for row in rows) or 'no'} elements",
            "give each input a row with one element for each column, None where there is no controller",
            argument=name,
        )
    return rows


def _response(models: Controllers, frequency_hz: ArrayLike) -> Complex:
    f = np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
    response = np.zeros((f.size, len(models), len(models[0])), dtype=np.complex128)
    for i, row in enumerate(models):
        for j, model in enumerate(row):
            if isinstance(model, Model):
                response[:, i, j] = model.response(f)
    return response
