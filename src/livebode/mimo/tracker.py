"""MatrixTracker: samples of several inputs and outputs in, matrices of frequency responses with bounds out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Emit, Event, MatrixResponses, SignalError, Stage, StatefulBase, hand_over, ignore
from livebode.estimation.spectra import LineSpectra, SpectraRows
from livebode.estimation.watch import InputStatistics
from livebode.mimo.estimate import Estimate, Windows, estimate
from livebode.mimo.settings import MatrixSettings

Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]

_VALUES_MAX = 1 << 20
"""Complex numbers that are gathered at once: 16 MiB."""


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
    >>> from livebode.mimo import MatrixExcitation, MatrixSettings
    >>> lines = Lines.parse("50:150:50", rate_hz=1000, window=100)
    >>> u = np.tile(MatrixExcitation.orthogonal(lines, 2).samples, 3)
    >>> block = Block(np.vstack([u, np.array([[2.0, 1.0], [0.0, 3.0]]) @ u]), ("u1", "u2", "y1", "y2"), rate_hz=1000)
    >>> settings = MatrixSettings(lines=lines, output=["y1", "y2"], input=["u1", "u2"], estimator="direct", hop=100)
    >>> responses = MatrixTracker(settings).process(block)
    >>> bool(np.allclose(responses.value[-1], [[2.0, 1.0], [0.0, 3.0]]))
    True
    """

    _stage = Stage("matrix-tracker", 1)
    _STATE = ("_spectra", "_watch", "_past", "_complete")

    def __init__(self, settings: MatrixSettings) -> None:
        self.settings = s = settings
        self._events: list[Event] = []
        roles = ["output"] * len(s.output)
        roles += [] if s.estimator == "indirect" else ["input"] * len(s.input)
        roles += ["excitation"] * (len(s.channels) - len(roles))
        advanced = np.array([s.loop.timing.advance_ticks(role) for role in roles])  # type: ignore[arg-type]
        bins = np.array(s.lines.bins)
        plain = np.zeros(len(roles), dtype=np.bool_)
        self._spectra = LineSpectra(s.lines.window, bins, s.step, plain, advanced, None)
        self._watch = InputStatistics(self._events, s.lines.window)
        remembered = s.memory * s.count * s.places
        self._past = np.zeros((len(roles), remembered, len(bins)), dtype=np.complex128)
        self._complete = np.zeros(remembered, dtype=np.bool_)

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
        if abs(block.rate_hz / s.lines.rate_hz - 1) > 1e-9:
            raise SignalError(
                "rate-differs",
                f"the block has {block.rate_hz:g} samples per second, but the lines are for {s.lines.rate_hz:g}",
                "make the lines for the block's rate",
                rate_hz=block.rate_hz,
                lines_rate_hz=s.lines.rate_hz,
            )
        data = block.data[[block.index(name) for name in s.channels]]
        if self._watch.starts(block):
            self._spectra.restart(block.start)
            self._complete[:] = False
        rows = self._spectra.process(data)
        self._watch.take(block, rows)
        found = self._responses(rows, block)
        hand_over(self._events, emit)
        return found

    def _responses(self, rows: SpectraRows, block: Block) -> MatrixResponses:
        s = self.settings
        settled = (rows.sample - s.start) % s.span + 1 >= s.first_place
        sample = rows.sample[settled]
        past = np.concatenate([self._past, rows.spectrum[:, settled]], axis=1)
        complete = np.concatenate([self._complete, rows.clean[settled]])
        remembered = len(self._complete)
        newest = remembered + np.arange(len(sample))
        each = max(1, _VALUES_MAX // (s.memory * s.count * past.shape[0] * past.shape[2]))
        parts = [self._estimate(past, complete, newest[i : i + each]) for i in range(0, max(len(newest), 1), each)]
        self._past, self._complete = past[:, -remembered:].copy(), complete[-remembered:].copy()
        names = Estimate.__dataclass_fields__
        joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
        used = s.memory if s.average else 1
        middle = sample - (s.lines.window - 1) / 2 - s.span * (s.count - 1) / 2
        if s.average:
            middle = middle - s.cycle * (self._repetitions(complete, newest) - 1) / 2
        return MatrixResponses(
            s.lines,
            tuple(s.output),
            s.columns,
            **joined,
            first=sample - s.lines.window + 1 - s.cycle * (used - 1) - s.span * (s.count - 1),
            sample=sample,
            time_s=np.asarray(block.origin_s + middle / block.rate_hz, dtype=np.float64),
            units=(),
        )

    def _before(self, newest: NDArray[np.intp]) -> NDArray[np.intp]:
        """Rows of the windows at the same place, shape (rows, repetitions, experiments), the newest first."""
        s = self.settings
        back = s.places * np.arange(s.memory * s.count).reshape(s.memory, s.count)
        return np.asarray(newest[:, np.newaxis, np.newaxis] - back)

    def _repetitions(self, complete: Flags, newest: NDArray[np.intp]) -> NDArray[np.int64]:
        """How many of the newest repetitions are complete, without one that is not between them."""
        whole = complete[self._before(newest)].all(axis=2)
        return np.asarray(np.logical_and.accumulate(whole, axis=1).sum(axis=1))

    def _estimate(self, past: Complex, complete: Flags, newest: NDArray[np.intp]) -> Estimate:
        s = self.settings
        count = self._repetitions(complete, newest)
        # (signals, rows, repetitions, experiments, lines) to (rows, lines, repetitions, signals, experiments)
        windows = np.ascontiguousarray(past[:, self._before(newest)].transpose(1, 4, 2, 0, 3))
        outputs, columns = len(s.output), len(s.columns)
        denominator = windows[:, :, :, outputs : outputs + columns]
        reference = denominator if s.estimator != "joint" else windows[:, :, :, outputs + columns :]
        these = Windows(windows[:, :, :, :outputs], denominator, reference, count)
        found = estimate(these, s.average, s.condition_max)
        return self._through_loop(found) if s.estimator == "indirect" else found

    def _through_loop(self, found: Estimate) -> Estimate:
        """G = T·(E − F·T)⁻¹, and dG = (1 + G·F)·dT·(E − F·T)⁻¹; invalid unless all columns of T are valid."""
        s = self.settings
        worst = np.broadcast_to(found.reason.max(axis=2, keepdims=True), found.reason.shape).copy()
        whole = worst[:, :, 0] == 0
        feedback = s.loop.feedback_at(s.lines.frequency_hz)
        entry = s.loop.entry_at(s.lines.frequency_hz, len(s.excitation))
        unit = np.eye(len(s.excitation))
        inputs = np.where(whole[..., None, None], entry - feedback @ found.value, unit)
        inverse = np.linalg.inv(inputs)
        value = found.value @ inverse
        closed = np.eye(len(s.output)) + value @ feedback
        noise = closed @ found.noise @ np.swapaxes(closed, 2, 3).conj()
        spread = np.swapaxes(inverse, 2, 3) @ found.spread @ inverse.conj()
        return Estimate(value, noise, spread, found.dof, found.coherence, found.condition, worst)
