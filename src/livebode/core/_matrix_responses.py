"""MatrixResponses: frequency responses from several inputs to several outputs, with their covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from livebode.arrays import Complex, Floats
from livebode.core._conversion import matrix_dataset, matrix_frd
from livebode.core._response import Responses, widened
from livebode.core.distributions import CIRCLE_FACTOR
from livebode.core.errors import GridError, UsageError
from livebode.core.lines import Lines, ends, position, within
from livebode.core.rows import RowArrays
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.plugins import loaded

if TYPE_CHECKING:
    from xarray import Dataset

Names = str | int | Sequence[str | int] | None

REASONS = ("", Message("incomplete"), Message("not excited"), Message("not separated"))
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
        (rows, lines). 1: they are orthogonal; large: they move together. For more than two inputs it is an upper bound,
        at most inputs / 2 times too large, and exact where a column is invalid.
    reason
        Number in `REASONS`, shape (rows, lines, inputs): 0 where the column is valid.
    first, sample
        Numbers of the oldest sample of the windows that the matrix is computed from, and of the newest one, shape
        (rows,). Where not all experiments are complete, those of the newest window.
    time_s
        Effective time: mean of the centres of the windows, shape (rows,).
    units
        Unit of each entry, a row for each output; empty where not known.
    variation
        Standard deviation of each entry by a change of the machine, shape of `value`; part of `sigma`, and NaN where it
        is not known.

    Examples
    --------
    >>> from livebode_matrix import example_matrix_responses
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
    units: tuple[tuple[str, ...], ...] = ()
    variation: Floats = None  # type: ignore[assignment]

    _SHARED = ("lines", "outputs", "inputs", "units")

    def __post_init__(self) -> None:
        given: object = self.variation
        if given is None:
            object.__setattr__(self, "variation", np.full(self.value.shape, np.nan))

    @property
    def frequency_hz(self) -> Floats:
        """Frequencies of the lines, shape (lines,)."""
        return self.lines.frequency_hz

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Whether each column is valid, shape (rows, lines, inputs)."""
        return np.asarray(self.reason == 0)

    @property
    def covariance(self) -> Complex:
        """E δ(o, i)·conj(δ(p, j)) of the errors of entries by noise, without `variation`.

        The shape is (rows, lines, outputs, inputs, outputs, inputs).
        """
        return np.asarray(np.einsum("rkop,rkij->rkoipj", self.noise, self.spread))

    @property
    def sigma(self) -> Floats:
        """Standard deviation of each entry by noise and variation, E|value − truth|² = sigma², shape of `value`."""
        return np.asarray(np.sqrt(self.noise_variance + np.nan_to_num(self.variation) ** 2))

    @property
    def noise_variance(self) -> Floats:
        """Part of the noise in sigma², shape of `value`."""
        noise = np.einsum("rkoo->rko", self.noise).real
        spread = np.einsum("rkii->rki", self.spread).real
        return np.asarray(noise[..., :, np.newaxis] * spread[..., np.newaxis, :])

    @property
    def singular_values(self) -> Floats:
        """Singular values of each matrix, descending; NaN where a column is invalid.

        The shape is (rows, lines, least of outputs and inputs).

        They depend on the units of inputs and outputs: scale these first where the units differ.
        """
        values = np.full((*self.value.shape[:2], min(self.value.shape[2:])), np.nan)
        whole = self.valid.all(axis=2)
        values[whole] = np.linalg.svd(self.value[whole], compute_uv=False)
        return values

    def singular_value_bound(self, c: float = CIRCLE_FACTOR) -> Floats:
        """Radius around each singular value, shape of `singular_values`.

        To first order an error δ moves the singular value with the vectors u and v by the real part of u*·δ·v
        (Stewart and Sun, Matrix Perturbation Theory, 1990, section IV.4). The radius is that of the complex number
        u*·δ·v, whose variance is u*·noise·u times vᵀ·spread·v̄. Its modulus is at least its real part, so the radius
        covers the true singular value with a probability of 1 − exp(−c²) or more, 95 % by default, also where it is
        zero. All entries may vary together, so `variation` counts with its largest effect, |u|ᵀ·variation·|v|. Biased
        where several differ by less than their radii: they repel each other, and of three the outer ones are covered
        less often. docs/explanation/mimo.md has the measured shares.
        """
        radius = np.full(self.singular_values.shape, np.nan)
        whole = self.valid.all(axis=2)
        left, _, right = np.linalg.svd(self.value[whole], full_matrices=False)
        noise = np.einsum("nok,nop,npk->nk", left.conj(), self.noise[whole], left).real
        spread = np.einsum("nki,nij,nkj->nk", right.conj(), self.spread[whole], right).real
        varied = np.einsum("nok,noi,nki->nk", np.abs(left), np.nan_to_num(self.variation[whole]), np.abs(right))
        radius[whole] = np.sqrt(np.maximum(noise * spread, 0.0) + varied**2)
        return widened(radius, self.dof[:, np.newaxis, np.newaxis], c)

    def bound(self, c: float = CIRCLE_FACTOR) -> Floats:
        """Radius that covers the truth with probability 1 − exp(−c²), 95 % by default, for each entry alone."""
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
            unit=self.units[o][i] if self.units else "",
            variation=self.variation[:, :, o, i],
        )

    def sel(
        self,
        *,
        output: Names = None,
        input: Names = None,
        frequency_hz: slice | ArrayLike = slice(None),
        time_s: slice = slice(None),
    ) -> MatrixResponses:
        """The part of some outputs, inputs, lines and times.

        Names and rules are those of xarray and of the dimensions in `to_xarray`.

        Parameters
        ----------
        output, input
            A name or number, or several; None for all.
        frequency_hz, time_s
            As in `Responses.sel`.

        Raises
        ------
        UsageError
            If there is no such signal.
        GridError
            If no line is within the slice, or a frequency of the list is not a measured line.

        Examples
        --------
        >>> from livebode_matrix import example_matrix_responses
        >>> example_matrix_responses().sel(output="velocity2", frequency_hz=slice(20, 30))
        <MatrixResponses: 3 rows, 3 lines, 1 outputs × 2 inputs>
        """
        o, i = _several(output, self.outputs, "output"), _several(input, self.inputs, "input")
        if isinstance(frequency_hz, slice):
            k = within(self.lines, frequency_hz)
        else:
            k = np.unique(position(self.lines, frequency_hz))
        low, high = ends(time_s, "time_s")
        rows = self[np.flatnonzero((self.time_s >= low) & (self.time_s <= high))]
        return replace(
            rows,
            lines=self.lines.take(k),
            outputs=tuple(self.outputs[n] for n in o),
            inputs=tuple(self.inputs[n] for n in i),
            value=rows.value[:, k][:, :, o][..., i],
            noise=rows.noise[:, k][:, :, o][..., o],
            spread=rows.spread[:, k][:, :, i][..., i],
            coherence=rows.coherence[:, k][..., o],
            condition=rows.condition[:, k],
            reason=rows.reason[:, k][..., i],
            units=tuple(tuple(self.units[m][n] for n in i) for m in o) if self.units else (),
            variation=rows.variation[:, k][:, :, o][..., i],
        )

    def newest(self) -> MatrixResponses:
        """The last row with a valid column; no row if there is none."""
        rows = np.flatnonzero(self.valid.any(axis=(1, 2)))
        return self[rows[-1:]]

    def why(self, row: int = -1) -> list[Message]:
        """Sentences about the columns that are invalid in a row: which, at how many lines, and the reason."""
        sentences = []
        for i, name in enumerate(self.inputs):
            for number, word in enumerate(REASONS):
                at_hz = self.frequency_hz[self.reason[row, :, i] == number]
                if number and at_hz.size:
                    where = Message("{line_hz:g} Hz", line_hz=at_hz[0])
                    if at_hz.size > 1:
                        where = Message(
                            "{lines} lines from {low_hz:g} to {high_hz:g} Hz",
                            lines=at_hz.size,
                            low_hz=at_hz[0],
                            high_hz=at_hz[-1],
                        )
                    sentences.append(
                        Message(
                            "column {column} is invalid at {where}: {why}", column=name, where=where, why=_WHY[word]
                        )
                    )
        return sentences

    def transformed(
        self, outputs: ArrayLike, inputs: ArrayLike, names: tuple[tuple[str, ...], tuple[str, ...]]
    ) -> MatrixResponses:
        """A·G·B in other coordinates, with its covariance: y' = A·y, and u = B·u'.

        On a CoreXY printer, for example, both motors move both axes. The multiple coherence and the
        units are not known afterwards. A
        column is valid where all columns were. Entries may vary together: `variation` is the largest possible.

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

        >>> from livebode_matrix import example_matrix_responses
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
            variation=np.abs(a) @ self.variation @ np.abs(b),
        )

    def plot(
        self,
        *,
        axes: Any = None,
        bounds: bool = True,
        c: float = CIRCLE_FACTOR,
        label: str | None = None,
        color: Any = None,
    ) -> Any:
        """Draw each entry as a Bode plot: outputs down, inputs across, each with magnitude above phase.

        As `Responses.plot`: the newest valid values, and behind them the range of 5–95 % of the others. Use `sel` for
        some of the entries, and `entry(…).plot` for a Nyquist plot or a Nichols chart of one.

        Parameters
        ----------
        axes
            Matplotlib Axes to draw on, an array of shape (2 · outputs, inputs). Default: a new figure of pyplot.
        bounds, c, label, color
            As in `Responses.plot`.

        Returns
        -------
        numpy.ndarray of Axes
            Shape (2 · outputs, inputs).

        Raises
        ------
        UsageError
            If `axes` have another shape.

        Examples
        --------
        >>> from livebode_matrix import example_matrix_responses
        >>> axes = example_matrix_responses().plot()
        >>> axes.shape, axes[0, 1].get_title()
        ((4, 2), 'u2 → velocity1')
        """
        draw = loaded("livebode.pictures:plot_matrix")  # a floor above: pictures need what they show
        return draw(self, axes=axes, c=c if bounds else None, label=label, color=color)

    def to_xarray(self) -> Dataset:
        """A labelled Dataset (extra `xarray`).

        Dimensions ``time_s``, ``frequency_hz``, ``output`` and ``input``; ``first`` and ``sample`` are coordinates
        along time. Variables ``response`` (complex) and ``sigma`` over all four, ``noise`` and ``spread`` with a
        further dimension ``other_output`` and ``other_input``: their product is the covariance of all entries by noise.
        Also ``variation``, ``coherence``, ``condition``, ``valid``, ``reason`` and ``dof``.

        Raises
        ------
        ExtraError
            If xarray is not installed.

        Examples
        --------
        >>> import numpy as np
        >>> from livebode_matrix import example_matrix_responses
        >>> responses = example_matrix_responses()[-1:]
        >>> dataset = responses.to_xarray()
        >>> covariance = (dataset.noise * dataset.spread).transpose(
        ...     "time_s", "frequency_hz", "output", "input", "other_output", "other_input"
        ... )
        >>> bool(np.allclose(covariance, responses.covariance))
        True
        """
        return matrix_dataset(self, REASONS)

    def to_frd(self, row: int = -1) -> Any:
        """python-control's FrequencyResponseData of one row, in rad/s, at lines where all columns are valid.

        Its `frdata` has the shape (outputs, inputs, lines); it has no bounds (extra `control`).

        Raises
        ------
        ExtraError
            If python-control is not installed.
        """
        return matrix_frd(self, row)

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


_WHY = {
    "incomplete": Message("a window contains a start, a gap or an excluded sample"),
    "not excited": Message("the input does not move; excite it there"),
    "not separated": Message(
        "the input moves together with others in all experiments; use as many different experiments as inputs"
    ),
}


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


def _several(which: Names, names: tuple[str, ...], kind: str) -> list[int]:
    if which is None:
        return list(range(len(names)))
    return [_at(name, names, kind) for name in ([which] if isinstance(which, str | int) else which)]
