"""Change between two matrices: one statistic over all entries, and the entry that changed most."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import CIRCLE_FACTOR, FitError, GridError, MatrixResponses, needing, widened
from livebode.dataclass import dataclass
from livebode.fitting import mean_matrix
from livebode.language import Message
from livebode_matrix.line_correlation import INDEPENDENT, LineCorrelation, RowSteps

ALPHA = 0.01
"""Probability of a change reported where there is none."""


@dataclass(frozen=True)
class EntryChange:
    """How one entry differs between two matrices.

    Attributes
    ----------
    probability
        That chance alone gives as large a difference at all lines together (of this entry by itself).
    frequency_hz
        The line with the largest difference in units of its bound.
    share, bound
        |difference| over |response before| at that line, and its 95 % bound.
    """

    output: str
    input: str
    probability: float
    frequency_hz: float
    share: float
    bound: float

    @property
    def sentence(self) -> str:
        """The change in words."""
        return Message(
            "response {output}/{input} changed at {line_hz:g} Hz by {percent:.3g} ± {bound:.2g} %",
            output=self.output,
            input=self.input,
            line_hz=self.frequency_hz,
            percent=100 * self.share,
            bound=100 * self.bound,
        )


@dataclass(frozen=True)
class MatrixChange:
    """The comparison of two matrices; see `compare_matrices`.

    Attributes
    ----------
    probability
        That chance alone gives as large a difference.
    alpha
        Probability below which a change is reported: the rate of false alarms of a comparison.
    lines
        Number of lines compared.
    entries
        By increasing probability: the first one changed most.
    """

    probability: float
    alpha: float
    lines: int
    entries: tuple[EntryChange, ...]

    @property
    def changed(self) -> bool:
        """Whether chance does not explain the difference."""
        return self.probability < self.alpha

    @property
    def sentence(self) -> str:
        """The result as text."""
        if self.changed:
            return self.entries[0].sentence
        return Message(
            "no entry changed by more than chance explains ({lines} lines, false alarms {false_percent:g} %)",
            lines=self.lines,
            false_percent=100 * self.alpha,
        )


def compare_matrices(
    before: MatrixResponses, after: MatrixResponses, alpha: float = ALPHA, *, steps: RowSteps | None = None
) -> MatrixChange:
    """Whether the matrix of a machine changed, over all entries and lines at once.

    Wilks' Λ = |d·N̂|/|d·N̂ + D·S⁻¹·D*| of the difference D at each line, N̂ the noise of both and S their spread. For
    Gaussian noise −ln Λ is a sum of −ln of Beta variables (Gupta, Ann. Math. Statist. 36(1), 1965, for real ones;
    Beta(d − j + 1, inputs) for complex ones). It is summed over the lines, and its tail is that of the gamma
    distribution with the same first three cumulants, which contain how far the errors of the lines are alike
    (`RowSteps`). False alarms therefore have the rate `alpha` at any number of repetitions. Where noise and spread both
    differ between the two, d is Welch's approximation.

    Delay, bias: none. The two matrices are taken as of different samples. With too few rows to see how far lines are
    alike, half of the noise of each is taken as common to all, so that only large changes are reported.

    Parameters
    ----------
    before, after
        Of the same signals and lines; the mean of the rows of each that share no window (`mean_matrix`).
    alpha
        Rate of false alarms of a comparison.
    steps
        By which errors of the lines are alike. Default: those of both.

    Raises
    ------
    GridError, FitError
        If lines or signals differ, no line has all columns valid in both, or the noise has too few degrees of freedom.

    Examples
    --------
    >>> from livebode_matrix import example_matrix_responses
    >>> responses = example_matrix_responses()
    >>> compare_matrices(responses, responses).sentence
    'no entry changed by more than chance explains (7 lines, false alarms 1 %)'
    """
    if steps is None:
        steps = RowSteps.of(before).joined(RowSteps.of(after))
    pair = MatrixPair.of(mean_matrix(before), mean_matrix(after), steps)
    entries = sorted(pair.entries(), key=lambda entry: entry.probability)
    return MatrixChange(pair.probability, alpha, len(pair.frequency_hz), tuple(entries))


@dataclass(frozen=True, eq=False)
class MatrixPair:
    """The difference of two matrices, after minus before, and its covariance noise ⊗ spread, at common valid lines.

    Attributes
    ----------
    difference
        Shape (lines, outputs, inputs).
    noise, spread
        Shapes (lines, outputs, outputs) and (lines, inputs, inputs).
    dof
        Complex degrees of freedom of the noise.
    size
        |response before|, shape of `difference`.
    use
        Which lines these are, of all.
    steps
        By which errors of the lines are alike, in units of the noise and spread before.
    """

    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    frequency_hz: Floats
    difference: Complex
    noise: Complex
    spread: Complex
    dof: float
    size: Floats
    use: NDArray[np.bool_]
    steps: RowSteps
    before: MatrixResponses

    @classmethod
    def of(cls, before: MatrixResponses, after: MatrixResponses, steps: RowSteps) -> MatrixPair:
        """The difference of two matrices of one row each."""
        same = (before.outputs, before.inputs) == (after.outputs, after.inputs)
        a, b = before.lines, after.lines
        if not same or not a.alike(b):
            raise GridError(
                "not-alike",
                "the matrices have different lines or signals, so their entries cannot be compared",
                "track both with the same lines and signals",
            )
        use = (before.valid[0] & after.valid[0]).all(axis=1)
        if not use.any():
            raise FitError("too-few-lines", "no line has all its columns valid in both matrices",
                           "see why() for the reasons", lines=0)  # fmt: skip
        parts = [
            (responses.noise[0, use], responses.spread[0, use], float(responses.dof[0]))
            for responses in (before, after)
        ]
        scales = [np.einsum("kii->k", spread).real for _, spread, _ in parts]
        noises = [scale[:, None, None] * noise for scale, (noise, _, _) in zip(scales, parts)]
        power = [np.einsum("koo->k", noise).real for noise in noises]
        # Welch's: of the sum of two estimates, by their shares in it.
        share = float(np.median(power[0] / (power[0] + power[1])))
        dof = 1 / (share**2 / parts[0][2] + (1 - share) ** 2 / parts[1][2])
        if dof < len(before.outputs):
            raise FitError(
                "too-few-lines",
                f"the noise has {dof:.3g} degrees of freedom, but {len(before.outputs)} outputs need as many",
                "repeat the experiments more often",
                dof=dof,
            )
        spread = (parts[0][1] + parts[1][1]) / sum(scales)[:, None, None]
        difference = after.value[0, use] - before.value[0, use]
        return cls(
            before.outputs, before.inputs, before.frequency_hz[use], difference, noises[0] + noises[1], spread, dof,
            np.abs(before.value[0, use]), use, steps, before,
        )  # fmt: skip

    @property
    def statistic(self) -> Floats:
        """−ln Λ of each line, shape (lines,)."""
        return _wilks(self.difference, self.noise, self.spread, self.dof)

    @property
    def probability(self) -> float:
        """That chance alone gives as large a difference."""
        lines, alike = len(self.frequency_hz), self._alike(self.steps, slice(None), slice(None))
        return tail(float(self.statistic.sum()), lines, len(self.outputs), len(self.inputs), self.dof, alike)

    def _alike(self, steps: RowSteps, outputs: slice, inputs: slice) -> LineCorrelation:
        noise, spread = self.before.noise[0, self.use], self.before.spread[0, self.use]
        return steps.correlation(self.use, noise[:, outputs, outputs], spread[:, inputs, inputs])

    @property
    def sigma(self) -> Floats:
        """Standard deviation of each difference, shape of `difference`."""
        noise, spread = (np.einsum("kjj->kj", values).real for values in (self.noise, self.spread))
        return np.asarray(np.sqrt(noise[:, :, np.newaxis] * spread[:, np.newaxis, :]))

    def entries(self) -> list[EntryChange]:
        """Each entry by itself."""
        radius = self._radius
        changes = []
        for o, output in enumerate(self.outputs):
            for i, name in enumerate(self.inputs):
                part = (slice(None), slice(o, o + 1), slice(i, i + 1))
                noise, spread = self.noise[:, o : o + 1, o : o + 1], self.spread[:, i : i + 1, i : i + 1]
                total = float(_wilks(self.difference[part], noise, spread, self.dof).sum())
                alike = self._alike(self.steps.entry(o, i), slice(o, o + 1), slice(i, i + 1))
                chance = tail(total, len(self.frequency_hz), 1, 1, self.dof, alike)
                off = np.abs(self.difference[:, o, i])
                index = int(np.argmax(off / radius[:, o, i]))
                size = self.size[index, o, i]
                line = float(self.frequency_hz[index])
                changes.append(EntryChange(output, name, chance, line, off[index] / size, radius[index, o, i] / size))
        return changes

    def share(self, entry: str, frequency_hz: float) -> tuple[float, float]:
        """|change|/|before| of an entry "output/input" at a line, with its bound; NaN where that is not valid."""
        names = [f"{o}/{i}" for o in self.outputs for i in self.inputs]
        o, i = divmod(names.index(entry), len(self.inputs))
        index = np.flatnonzero(self.frequency_hz == frequency_hz)
        if not index.size:
            return np.nan, np.nan
        k = int(index[0])
        size = self.size[k, o, i]
        return float(abs(self.difference[k, o, i]) / size), float(self._radius[k, o, i] / size)

    @property
    def _radius(self) -> Floats:
        """Bound of each difference."""
        return np.asarray(widened(self.sigma, np.full((1, 1, 1), self.dof), CIRCLE_FACTOR))


def _wilks(difference: Complex, noise: Complex, spread: Complex, dof: float) -> Floats:
    """−ln Λ of each line."""
    # Of the covariance E δ(o, i)·conj(δ(p, j)) = N(o, p)·S(i, j) the inputs are whitened by conj(S).
    inner = difference @ np.linalg.inv(spread.conj()) @ np.swapaxes(difference, 1, 2).conj()
    unit = np.eye(noise.shape[1]) + np.linalg.solve(noise, inner) / dof
    return np.asarray(np.linalg.slogdet(unit)[1])


def tail(
    total: float, lines: int, outputs: int, inputs: int, dof: float, alike: LineCorrelation = INDEPENDENT
) -> float:
    """Probability that −ln Λ summed over the lines exceeds this by chance.

    >>> round(tail(2.0, 1, 1, 1, 10.0), 6) == round(float(np.exp(-20.0)), 6)
    True
    """
    with needing("SciPy", "analysis", "a comparison of matrices"):
        from scipy.special import gammaincc, polygamma

    low = dof - np.arange(outputs)
    mean, variance, third = (
        lines * float(np.sum((-1) ** n * (polygamma(n, low) - polygamma(n, low + inputs)) * -1)) for n in range(3)
    )
    variance, third = alike.second * variance, alike.third * third
    shape = 4 * variance**3 / third**2
    scale = third / (2 * variance)
    begin = mean - shape * scale
    return float(gammaincc(shape, max(total - begin, 0.0) / scale))
