"""MatrixResponses: frequency responses from several inputs to several outputs, with their covariance."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.core._response import Responses, widened
from livebode.core.errors import GridError, UsageError
from livebode.core.installing import not_installed
from livebode.core.lines import Lines
from livebode.core.rows import RowArrays

if TYPE_CHECKING:
    from xarray import Dataset

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

CHANNELS_MAX = 8
"""Largest number of inputs, and of outputs."""

REASONS = ("", "incomplete", "not excited", "not separated")
"""Why a column is invalid, by its number in `MatrixResponses.reason`; the first is that of a valid one."""


@dataclass(frozen=True, eq=False)
class MatrixResponses(RowArrays):
    """Consecutive matrices of frequency responses, one for each hop.

    Attributes
    ----------
    lines
        Where they were measured.
    outputs, inputs
        Names of the signals.
    value
        Complex, shape (rows, lines, outputs, inputs); NaN in an invalid column.
    noise
        Covariance of the noise in the outputs' spectra of one window, shape (rows, lines, outputs, outputs); NaN where
        not yet known.
    spread
        Covariance of the columns for noise of unit power, shape (rows, lines, inputs, inputs). The covariance of all
        entries is the Kronecker product of these two (`covariance`), because the noise of an output reaches all
        columns through the same spectra of the inputs.
    dof
        Complex degrees of freedom behind `noise`, shape (rows,); bounds widen by it.
    coherence
        Multiple coherence of each output with all inputs, shape (rows, lines, outputs), between 0 and 1.
    condition
        Condition number of the inputs over the experiments, each input scaled to the same power over all lines, shape
        (rows, lines). 1: they are orthogonal; large: they move together.
    reason
        Number in `REASONS`, shape (rows, lines, inputs): 0 where the column is valid.
    first, sample
        Numbers of the oldest sample (of the oldest window) and of the newest one, shape (rows,).
    time_s
        Effective time: mean of the centres of the windows, shape (rows,).

    Examples
    --------
    >>> from livebode.mimo import example_matrix_responses
    >>> responses = example_matrix_responses()
    >>> responses.value.shape, responses.covariance.shape
    ((3, 7, 2, 2), (3, 7, 2, 2, 2, 2))
    >>> responses.entry("velocity1", "u2").magnitude_db.shape
    (3, 7)
    """

    lines: Lines
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    value: Complex
    noise: Complex
    spread: Complex
    dof: Floats
    coherence: Floats
    condition: Floats
    reason: NDArray[np.int8]
    first: NDArray[np.int64]
    sample: NDArray[np.int64]
    time_s: Floats

    _SHARED = ("lines", "outputs", "inputs")

    @property
    def frequency_hz(self) -> Floats:
        """Of the lines, shape (lines,)."""
        return self.lines.frequency_hz

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Whether each column is valid, shape (rows, lines, inputs)."""
        return np.asarray(self.reason == 0)

    @property
    def covariance(self) -> Complex:
        """E δ(o, i)·conj(δ(p, j)) of the errors of entries, shape (rows, lines, outputs, inputs, outputs, inputs)."""
        return np.asarray(np.einsum("rkop,rkij->rkoipj", self.noise, self.spread))

    @property
    def sigma(self) -> Floats:
        """Standard deviation of each entry, E|value − truth|² = sigma², shape of `value`."""
        noise = np.einsum("rkoo->rko", self.noise).real
        spread = np.einsum("rkii->rki", self.spread).real
        return np.asarray(np.sqrt(noise[..., :, np.newaxis] * spread[..., np.newaxis, :]))

    @property
    def singular_values(self) -> Floats:
        """Of each matrix, descending, shape (rows, lines, least of outputs and inputs); NaN where a column is invalid.

        They depend on the units of inputs and outputs: scale these first where the units differ.
        """
        found = np.full((*self.value.shape[:2], min(self.value.shape[2:])), np.nan)
        whole = self.valid.all(axis=2)
        found[whole] = np.linalg.svd(self.value[whole], compute_uv=False)
        return found

    def bound(self, c: float = 2.0) -> Floats:
        """Radius that covers the truth with probability 1 − exp(−c²), for each entry alone, shape of `value`."""
        return widened(self.sigma, self.dof[:, np.newaxis, np.newaxis, np.newaxis], c)

    def entry(self, output: str | int, input: str | int) -> Responses:
        """The response from one input to one output, by name or number, as Responses.

        Its coherence is the multiple coherence of the output.

        Raises
        ------
        UsageError
            If there is no such signal.
        """
        o, i = _at(output, self.outputs, "output"), _at(input, self.inputs, "input")
        return Responses(
            lines=self.lines,
            value=self.value[:, :, o, i],
            sigma=self.sigma[:, :, o, i],
            dof=self.dof,
            coherence=self.coherence[:, :, o],
            valid=self.valid[:, :, i],
            first=self.first,
            sample=self.sample,
            time_s=self.time_s,
            schedule=np.full(len(self), np.nan),
        )

    def why(self, row: int = -1) -> list[str]:
        """Sentences about the columns that are invalid in a row: which, at how many lines, and the reason."""
        found = []
        for i, name in enumerate(self.inputs):
            for number, word in enumerate(REASONS):
                at = self.frequency_hz[self.reason[row, :, i] == number]
                if number and at.size:
                    where = f"{at[0]:g} Hz" if at.size == 1 else f"{at.size} lines from {at[0]:g} to {at[-1]:g} Hz"
                    found.append(_SENTENCES[word].format(name=name, where=where))
        return found

    def transformed(
        self, outputs: ArrayLike, inputs: ArrayLike, names: tuple[tuple[str, ...], tuple[str, ...]]
    ) -> MatrixResponses:
        """A·G·B in other coordinates, with its covariance: y' = A·y, and u = B·u'.

        On a CoreXY printer, for example, both motors move both axes. The multiple coherence is not known afterwards. A
        column is valid where all columns were.

        Parameters
        ----------
        outputs, inputs
            Real A, shape (any, outputs), and invertible B, shape (inputs, inputs).
        names
            Those of the new outputs and inputs.

        Raises
        ------
        UsageError
            If the shapes do not fit.

        Examples
        --------
        The beam of a gantry as its mean and its difference, per mean torque and per difference:

        >>> from livebode.mimo import example_matrix_responses
        >>> half = [[0.5, 0.5], [1.0, -1.0]]
        >>> beam = example_matrix_responses().transformed(half, [[1.0, 0.5], [1.0, -0.5]], (("y", "dy"), ("u", "du")))
        >>> beam.outputs, beam.value.shape
        (('y', 'dy'), (3, 7, 2, 2))
        """
        a, b = np.asarray(outputs, dtype=np.float64), np.asarray(inputs, dtype=np.float64)
        fits = a.ndim == b.ndim == 2 and a.shape[1] == len(self.outputs) and b.shape == (len(self.inputs),) * 2
        if not fits or (len(names[0]), len(names[1])) != (a.shape[0], b.shape[1]):
            raise UsageError(
                "wrong-shape",
                f"matrices of {a.shape} and {b.shape} do not fit {len(self.outputs)} outputs and {len(self.inputs)} "
                "inputs with their new names",
                "give (new outputs, outputs) and (inputs, inputs), and a name for each",
                argument="outputs",
            )
        worst = np.broadcast_to(self.reason.max(axis=2, keepdims=True), self.reason.shape)
        value = np.where(worst[:, :, np.newaxis] == 0, a @ self.value @ b, np.nan)
        return MatrixResponses(
            self.lines,
            names[0],
            names[1],
            value,
            a @ self.noise @ a.T,
            b.T @ self.spread @ b,
            self.dof,
            np.full((*value.shape[:2], len(names[0])), np.nan),
            self.condition,
            worst,
            self.first,
            self.sample,
            self.time_s,
        )

    def to_xarray(self) -> Dataset:
        """A Dataset with the dimensions time_s, frequency_hz, output and input (extra `xarray`).

        Raises
        ------
        ExtraError
            If xarray is not installed.
        """
        four = ("time_s", "frequency_hz", "output", "input")
        variables: dict[str, Any] = {
            "response": (four, self.value),
            "sigma": (four, self.sigma),
            "coherence": (four[:3], self.coherence),
            "condition": (four[:2], self.condition),
            "valid": (("time_s", "frequency_hz", "input"), self.valid),
            "dof": (four[:1], self.dof),
        }
        coords = {
            "time_s": self.time_s,
            "frequency_hz": self.frequency_hz,
            "output": list(self.outputs),
            "input": list(self.inputs),
        }
        found: Dataset = _optional("xarray", "xarray").Dataset(variables, coords)
        return found

    def to_frd(self, row: int = -1) -> Any:
        """python-control's FrequencyResponseData of one row, in rad/s, at lines where all columns are valid.

        Raises
        ------
        ExtraError
            If python-control is not installed (extra `control`).
        """
        control = _optional("control", "python-control")
        whole = self.valid[row].all(axis=1)
        return control.frd(
            np.moveaxis(self.value[row, whole], 0, 2),
            2 * np.pi * self.frequency_hz[whole],
            inputs=list(self.inputs),
            outputs=list(self.outputs),
        )

    def __repr__(self) -> str:
        return (
            f"<MatrixResponses: {len(self)} rows, {len(self.lines)} lines, {len(self.outputs)} outputs × "
            f"{len(self.inputs)} inputs>"
        )

    @classmethod
    def _not_alike(cls, _: object) -> GridError:
        return GridError(
            "not-alike",
            "responses on different lines or of different signals cannot be joined",
            "join responses of one run",
        )


_SENTENCES = {
    "incomplete": "column {name} is invalid at {where}: a window contains a start, a gap or an excluded sample",
    "not excited": "column {name} is invalid at {where}: the input does not move; excite it there",
    "not separated": "column {name} is invalid at {where}: the input moves together with others in all experiments; "
    "use as many different experiments as inputs",
}


def _optional(package: str, shown: str) -> Any:
    """The package of the extra with its name; ExtraError where it is not installed."""
    try:
        return import_module(package)
    except ImportError:
        raise not_installed(f"{shown} is not installed", package=package, extra=package) from None


def _at(which: str | int, names: tuple[str, ...], kind: str) -> int:
    if isinstance(which, str) and which in names:
        return names.index(which)
    if isinstance(which, int) and 0 <= which < len(names):
        return which
    raise UsageError(
        "unknown-name",
        f"{which!r} is not one of the {kind}s",
        f"choose {' or '.join(map(repr, names))}",
        argument=kind,
        value=which,
        allowed=list(names),
    )
