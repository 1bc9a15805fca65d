"""From spectra of several experiments to matrices of responses, in C; `tests/twins/matrices.py` defines it.

Windows of one place in the experiments are `places` rows apart, in a ring of rows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from livebode.arrays import Complex, Flags, Floats, Integers
from livebode.kernel import _native


class MatrixStage(NamedTuple):
    """What all windows have in common.

    Attributes
    ----------
    outputs, inputs, lines
        Up to 8 outputs and 8 inputs.
    beside
        Further signals, which the history retains and nothing is computed from.
    experiments, repetitions, places
        Windows of a repetition, repetitions that are remembered, and rows of an experiment.
    average
        Whether G is that of all complete repetitions, or of the newest one.
    means
        Whether the spectra of an experiment are averaged over the repetitions before G.
    condition_max
        Condition number beyond which a matrix is not sure.
    instruction_set
        Its number (`livebode.kernel._instructions`), which changes no bit; 0 for the widest of this machine.
    """

    outputs: int
    inputs: int
    lines: int
    beside: int
    experiments: int
    repetitions: int
    places: int
    average: bool
    means: bool
    condition_max: float
    instruction_set: int

    @property
    def remembered(self) -> int:
        """Rows that a matrix is computed from, between the oldest and the newest."""
        return self.experiments * self.repetitions * self.places


class MatrixHistory(NamedTuple):
    """Windows so far; `process_matrices` changes them in place.

    Attributes
    ----------
    spectrum
        Real and imaginary parts, shape (rows of the ring, outputs + inputs + beside, 2, lines).
    complete
        Windows without a gap or an excluded sample, shape (rows of the ring,).
    work
        For intermediate results, shape (3, inputs, lines).
    """

    spectrum: Floats
    complete: Flags
    work: Floats

    @classmethod
    def empty(cls, stage: MatrixStage, rows: int) -> MatrixHistory:
        """With no complete window; room for `rows` more than a matrix is computed from."""
        length, signals = stage.remembered + rows, stage.outputs + stage.inputs + stage.beside
        shape = length, signals, 2, stage.lines
        return cls(np.zeros(shape), np.zeros(length, np.bool_), np.zeros((3, stage.inputs, stage.lines)))


class MatrixWindows(NamedTuple):
    """New windows.

    Attributes
    ----------
    first
        Row of the ring for the first one.
    spectrum
        Shape (outputs + inputs + beside, any, lines or more).
    row
        Which row of `spectrum` each window is, shape (rows,).
    clean
        Whether each row of `spectrum` has no gap and no excluded sample.
    """

    first: int
    spectrum: Complex
    row: Integers
    clean: Flags


class MatrixRows(NamedTuple):
    """Results; NaN where a value is not known.

    Attributes
    ----------
    value, noise, spread
        Shape (rows, lines, outputs, inputs), (rows, lines, outputs, outputs) and (rows, lines, inputs, inputs), as in
        `livebode.core.MatrixResponses`.
    coherence
        Shape (rows, lines, outputs).
    condition
        The largest condition number that the Frobenius norms of the scaled inputs and of their inverse permit, shape
        (rows, lines): exact for two inputs, and 1 for orthogonal ones.
    dof, complete
        Degrees of freedom of `noise`, and complete repetitions, shape (rows,).
    sure
        Whether the inputs separate beyond doubt, shape (rows, lines); elsewhere the matrix is not to be used.
    """

    value: Complex
    noise: Complex
    spread: Complex
    coherence: Floats
    condition: Floats
    dof: Floats
    complete: Integers
    sure: Flags

    @classmethod
    def empty(cls, stage: MatrixStage, rows: int) -> MatrixRows:
        shape, o, i = (rows, stage.lines), stage.outputs, stage.inputs
        return cls(
            np.empty((*shape, o, i), np.complex128),
            np.empty((*shape, o, o), np.complex128),
            np.empty((*shape, i, i), np.complex128),
            np.empty((*shape, o)),
            np.empty(shape),
            np.empty(rows),
            np.empty(rows, np.int64),
            np.empty(shape, np.bool_),
        )

    def part(self, rows: slice) -> MatrixRows:
        """Some of the rows, as views."""
        return MatrixRows(
            self.value[rows],
            self.noise[rows],
            self.spread[rows],
            self.coherence[rows],
            self.condition[rows],
            self.dof[rows],
            self.complete[rows],
            self.sure[rows],
        )


def process_matrices(stage: MatrixStage, history: MatrixHistory, windows: MatrixWindows, out: MatrixRows) -> None:
    """A matrix for each window into `out`; the windows are added to the history.

    They are no more than the rows of the ring beside those that a matrix is computed from.
    """
    _native.process_matrices(stage, history, windows, out)
