"""MatrixLoop: the closed loop around a plant with several inputs and outputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.core import Loop, Model, UsageError, as_model

Logged = Literal["before", "after"]
Controllers = Sequence[Sequence[object]]


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

    def feedback_at(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """F at these frequencies, shape (lines, inputs, outputs); UsageError where it is not described."""
        if self.feedback is None:
            raise UsageError(
                "missing",
                "the loop's feedback is missing",
                "describe its controllers, or use the joint estimator",
                argument="feedback",
            )
        return _at(self.feedback, frequency_hz)

    def entry_at(self, frequency_hz: ArrayLike, inputs: int) -> NDArray[np.complex128]:
        """E at these frequencies, shape (lines, inputs, excitations)."""
        if self.entry is None:
            return np.tile(np.eye(inputs, dtype=np.complex128), (np.size(frequency_hz), 1, 1))
        return _at(self.entry, frequency_hz)


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


def _at(models: Controllers, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
    f = np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
    found = np.zeros((f.size, len(models), len(models[0])), dtype=np.complex128)
    for i, row in enumerate(models):
        for j, model in enumerate(row):
            if isinstance(model, Model):
                found[:, i, j] = model.response(f)
    return found
