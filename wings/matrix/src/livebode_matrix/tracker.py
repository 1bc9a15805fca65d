"""MatrixTracker: samples of several inputs and outputs in, matrices of frequency responses with bounds out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Integers
from livebode.core import (
    Block,
    Emit,
    Event,
    MatrixResponses,
    SignalError,
    Stage,
    StatefulBase,
    hand_over,
    ignore,
    same_rate,
)
from livebode.estimation import NOTHING, InputStatistics, LineSpectra, SpectraRows, contains
from livebode.kernel import (
    MatrixHistory,
    MatrixRows,
    MatrixStage,
    MatrixWindows,
    chosen_instruction_set,
    process_matrices,
)
from livebode_matrix.estimate import MatrixEstimate, Windows, estimate, separates
from livebode_matrix.settings import MatrixSettings

_AT_ONCE = 128
"""Rows that are computed at once; the ring of windows has room for them."""
_VALUES_MAX = 1 << 21
"""Numbers that are gathered at once for singular values: 16 MiB."""


class MatrixTracker(StatefulBase):
    """Matrices of frequency responses in closed loop, sample by sample, from one sliding DFT of all signals.

    A window ends at every hop in the settled part of an experiment. A matrix is computed from it and from the windows
    at the same place in the n − 1 experiments before it. It is the same for any way of cutting the samples into Blocks,
    and a restored tracker continues as if it had never stopped. The effective time is the mean of the windows' centres:
    half of the n experiments late. A matrix is invalid until n experiments are complete after a start or a gap, and its
    bounds are known after two repetitions of them, three without `average`.

    Parameters
    ----------
    settings
        Lines, signals, estimator and experiments.

    Examples
    --------
    A plant without dynamics, whose two inputs are excited by orthogonal multisines:

    >>> import numpy as np
    >>> from livebode.core import Block, Lines
    >>> from livebode.excitation import MatrixExcitation
    >>> from livebode_matrix import MatrixSettings
    >>> lines = Lines.parse("50:150:50", rate_hz=1000, window=100)
    >>> u = np.tile(MatrixExcitation.orthogonal(lines, 2).samples, 3)
    >>> block = Block(np.vstack([u, np.array([[2.0, 1.0], [0.0, 3.0]]) @ u]), ("u1", "u2", "y1", "y2"), rate_hz=1000)
    >>> settings = MatrixSettings(lines=lines, output=["y1", "y2"], input=["u1", "u2"], estimator="direct", hop=100)
    >>> responses = MatrixTracker(settings).process(block)
    >>> bool(np.allclose(responses.value[-1], [[2.0, 1.0], [0.0, 3.0]]))
    True
    """

    _stage = Stage("matrix-tracker", 2)
    _STATE = ("_spectra", "_watch", "_past", "_complete", "_next", "_apart")

    def __init__(self, settings: MatrixSettings) -> None:
        self.settings = s = settings
        self._events: list[Event] = []
        outputs, inputs = len(s.output), len(s.columns)
        # With as many experiments as inputs, the estimate does not depend on the reference (`Windows`), which then
        # shows whether the experiments are different; of one input there is nothing to show.
        self._referenced = s.estimator == "joint" and s.count != inputs
        self._channels = s.channels if self._referenced or inputs > 1 else s.channels[: outputs + inputs]
        roles = ["output"] * outputs + ["excitation" if s.estimator == "indirect" else "input"] * inputs
        roles += ["excitation"] * (len(self._channels) - len(roles))
        advanced = np.array([s.loop.timing.advance_ticks(role) for role in roles])  # type: ignore[arg-type]
        bins = np.array(s.lines.bins)
        plain = np.zeros(len(roles), dtype=np.bool_)
        self._spectra = LineSpectra(s.lines.window, bins, s.step, plain, advanced, None)
        self._watch = InputStatistics(self._events, s.lines.window)
        self._matrices = MatrixStage(
            outputs,
            inputs,
            len(bins),
            len(roles) - outputs - inputs,
            s.count,
            s.memory,
            s.places,
            s.average,
            s.estimator != "direct",
            s.condition_max,
            chosen_instruction_set(),
        )
        self._past, self._complete, self._work = MatrixHistory.empty(self._matrices, _AT_ONCE)
        self._next = 0
        self._apart = np.ones(len(bins), dtype=np.bool_)
        self._aside = NOTHING

    def set_aside(self, spans: Integers, /) -> None:
        """First sample of each stretch, and the one after its last, shape (spans, 2), as far as the next Block.

        The machine is off, or another one, there. Windows with these samples do not count, and neither do those within
        `settle` periods after them.
        """
        self._aside = spans

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of received and missing samples, and of excluded ones for each reason."""
        return self._watch.counts

    @property
    def _identity(self) -> str:
        return self.settings.identity

    def process(self, block: Block, emit: Emit = ignore) -> MatrixResponses:
        """Matrices at the hops of this Block, which follows the previous one; `emit` receives each event in it.

        Raises
        ------
        SignalError
            If the rate is not that of the lines, a channel is missing, or samples come twice.
        """
        s = self.settings
        if not len(block):
            raise SignalError("empty", "the block is empty", "leave it out")
        if not same_rate(block.rate_hz, s.lines.rate_hz):
            raise SignalError(
                "rate-differs",
                f"the block has {block.rate_hz:g} samples per second, but the lines are for {s.lines.rate_hz:g}",
                "make the lines for the block's rate",
                rate_hz=block.rate_hz,
                lines_rate_hz=s.lines.rate_hz,
            )
        data = block.data[[block.index(name) for name in self._channels]]
        if self._watch.starts(block):
            self._spectra.restart(block.start)
            self._complete[:] = False
        rows = self._spectra.process(data)
        self._watch.count(block, rows)
        if len(self._aside):
            not_ready = contains(self._aside, rows.sample - s.settled_window + 1, rows.sample)
            rows = replace(rows, clean=rows.clean & ~not_ready)
        result = self._responses(rows, block)
        hand_over(self._events, emit)
        return result

    def _responses(self, rows: SpectraRows, block: Block) -> MatrixResponses:
        s = self.settings
        settled = np.flatnonzero((rows.sample - s.start) % s.span + 1 >= s.first_place)
        sample = rows.sample[settled]
        rows_estimate, count = self._estimate(rows, settled)
        used = np.maximum(count, 1) if s.average else np.ones_like(count)
        extent = s.lines.window + np.where(count > 0, s.span * (s.count - 1) + s.cycle * (used - 1), 0)
        middle = sample - (s.lines.window - 1) / 2 - s.span * (s.count - 1) / 2 - s.cycle * (used - 1) / 2
        return MatrixResponses(
            s.lines,
            tuple(s.output),
            s.columns,
            **vars(rows_estimate),
            first=sample - extent + 1,
            sample=sample,
            time_s=np.asarray(block.origin_s + middle / block.rate_hz, dtype=np.float64),
            units=(),
        )

    def _estimate(self, rows: SpectraRows, settled: NDArray[np.intp]) -> tuple[MatrixEstimate, NDArray[np.int64]]:
        """Matrices of some rows, and how many repetitions each has."""
        stage, history = self._matrices, MatrixHistory(self._past, self._complete, self._work)
        result = MatrixRows.empty(stage, len(settled))
        reason = np.zeros((*result.sure.shape, stage.inputs), dtype=np.int8)
        for begin in range(0, len(settled), _AT_ONCE):
            part = slice(begin, begin + _AT_ONCE)
            place, some = settled[part].astype(np.int64), result.part(part)
            process_matrices(stage, history, MatrixWindows(self._next, rows.spectrum, place, rows.clean), some)
            known = some.complete[:, np.newaxis] > 0
            reason[part][~known[:, 0]] = 1
            apart = self._excited_apart(rows.sample[settled[part]], some.complete)
            unsure = known & (~some.sure | ~apart | self._referenced)
            if unsure.any():
                self._replace(some, reason[part], unsure)
            self._next = (self._next + len(place)) % len(self._complete)
        values = result.value, result.noise, result.spread, result.dof, result.coherence, result.condition
        own = MatrixEstimate(*values, reason)
        return (self._through_loop(own) if self.settings.estimator == "indirect" else own), result.complete

    def _excited_apart(self, sample: NDArray[np.int64], complete: NDArray[np.int64]) -> Flags:
        """Whether the excitations are different experiments, shape (rows, lines), by the first row of each experiment.

        The estimate of as many experiments as inputs does not depend on them. But where `dwell` or `start` is not that
        of the recording, transients could separate the inputs.
        """
        s, stage = self.settings, self._matrices
        if not stage.beside or self._referenced:
            return np.ones((len(sample), stage.lines), dtype=np.bool_)
        begins = np.flatnonzero(((sample - s.start) % s.span + 1 == s.first_place) & (complete > 0))
        excitation = self._windows(begins, 1)[:, :, 0, stage.outputs + stage.inputs :]
        known = np.concatenate([self._apart[np.newaxis], separates(excitation, s.condition_max)])
        sampled = known[np.searchsorted(begins, np.arange(len(sample)), side="right")]
        self._apart = known[-1]
        return np.asarray(sampled)

    def _replace(self, estimates: MatrixRows, reason: NDArray[np.int8], unsure: Flags) -> None:
        """By the estimate with singular values, where it is not sure that the inputs separate."""
        stage = self._matrices
        rows = np.flatnonzero(unsure.any(axis=1))
        each = max(1, _VALUES_MAX // (stage.experiments * stage.repetitions * self._past[0].size))
        for part in (rows[i : i + each] for i in range(0, len(rows), each)):
            exact = self._exact(part, estimates.complete[part])
            which = np.zeros_like(unsure)
            which[part] = unsure[part]
            for name in ("value", "noise", "spread", "coherence", "condition"):
                getattr(estimates, name)[which] = getattr(exact, name)[unsure[part]]
            reason[which] = exact.reason[unsure[part]]

    def _exact(self, rows: NDArray[np.intp], complete: NDArray[np.int64]) -> MatrixEstimate:
        """The estimate with singular values of rows, counted from the next place in the ring."""
        s, stage = self.settings, self._matrices
        spectra = self._windows(rows, s.memory)
        output, denominator, given = np.split(spectra, (stage.outputs, stage.outputs + stage.inputs), axis=3)
        reference = given if self._referenced else denominator if s.estimator == "direct" else None
        excitation = given if stage.beside else None
        return estimate(Windows(output, denominator, reference, complete, excitation), s.average, s.condition_max)

    def _windows(self, rows: NDArray[np.intp], repetitions: int) -> Complex:
        """Spectra of rows, counted from the next place in the ring.

        Shape (rows, lines, repetitions, signals, experiments), the newest first.
        """
        s = self.settings
        back = s.places * np.arange(repetitions * s.count).reshape(repetitions, s.count)
        past = self._past[(self._next + rows[:, np.newaxis, np.newaxis] - back) % len(self._complete)]
        return np.asarray((past[:, :, :, :, 0] + 1j * past[:, :, :, :, 1]).transpose(0, 4, 1, 3, 2))

    def _through_loop(self, estimate: MatrixEstimate) -> MatrixEstimate:
        """G = T·(E − F·T)⁻¹, and dG = (1 + G·F)·dT·(E − F·T)⁻¹; invalid unless all columns of T are valid."""
        s = self.settings
        worst = np.broadcast_to(estimate.reason.max(axis=2, keepdims=True), estimate.reason.shape).copy()
        whole = worst[:, :, 0] == 0
        feedback = s.loop.feedback_at(s.lines.frequency_hz)
        entry = s.loop.entry_at(s.lines.frequency_hz, len(s.excitation))
        unit = np.eye(len(s.excitation))
        inputs = np.where(whole[..., None, None], entry - feedback @ estimate.value, unit)
        inverse = np.linalg.inv(inputs)
        value = estimate.value @ inverse
        closed = np.eye(len(s.output)) + value @ feedback
        noise = closed @ estimate.noise @ np.swapaxes(closed, 2, 3).conj()
        spread = np.swapaxes(inverse, 2, 3) @ estimate.spread @ inverse.conj()
        return MatrixEstimate(value, noise, spread, estimate.dof, estimate.coherence, estimate.condition, worst)
