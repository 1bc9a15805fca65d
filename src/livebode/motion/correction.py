"""MotionCorrection: responses of an axis in motion, corrected for the effect of the motion."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import (
    Block,
    Channel,
    Emit,
    Event,
    Responses,
    SignalError,
    Stage,
    StatefulBase,
    UsageError,
    hand_over,
    ignore,
    with_distortion,
)
from livebode.estimation import NOTHING, Settings, Tracker, contains
from livebode.motion.chunk import Chunk, PendingResponses, RecentSamples
from livebode.motion.learner import Learner, ReplayResult, frozen
from livebode.motion.model import MovingModel
from livebode.motion.orders import RippleMonitor
from livebode.motion.replay import Scatter, by_excitation, drive_of, residual
from livebode.motion.residual_distortion import ResidualDistortion
from livebode.motion.standstill import StandstillDetector, without


def check(
    settings: Settings, radius_m: float, chunk_samples: int, driven_by: str, passes: int, splines: tuple[int, int]
) -> None:
    """Raise UsageError for arguments that a correction does not support, with the value and the remedy."""
    if settings.input is None or settings.schedule is None:
        raise UsageError(
            "missing",
            "the correction needs the input (torque) and the schedule (position)",
            "name their channels",
            argument="schedule" if settings.input is not None else "input",
        )
    for name, required in (("quantity", "plant"), ("average", False), ("estimator", "joint")):
        value = getattr(settings, name)
        if value not in (required, "direct"):
            raise UsageError(
                "conflict",
                f"{name}={value!r} cannot be corrected for motion",
                f"take {required!r}, or leave out the correction ([motion])",
                argument=name,
                value=value,
                allowed=[required],
            )
    if not (np.isfinite(radius_m) and radius_m > 0):
        raise UsageError(
            "out-of-range",
            f"{radius_m=} is not a positive number of metres per radian",
            "give the radius of the pulley",
            argument="radius_m",
            value=radius_m,
        )
    _check_lengths(settings.lines.window, settings.step, chunk_samples)
    if driven_by not in ("torque", "excitation"):
        raise UsageError(
            "not-one-of",
            f"{driven_by=} is not supported",
            "choose 'torque' or 'excitation'",
            argument="driven_by",
            value=driven_by,
            allowed=["torque", "excitation"],
        )
    if passes < 1:
        raise UsageError("out-of-range", f"{passes=} is not at least 1", "3 is usual", argument="passes", value=passes)
    for name, many in zip(("stiffness_splines", "damping_splines"), splines):
        if many != 1 and many < 4:
            raise UsageError(
                "out-of-range",
                f"{name}={many} is neither 1 nor at least 4",
                "take 1 for a constant, or 4 or more",
                argument=name,
                value=many,
            )


def _check_lengths(window: int, hop: int, chunk_samples: int) -> None:
    if chunk_samples < 2 * window:
        raise UsageError(
            "out-of-range",
            f"{chunk_samples=} is less than two windows of {window}",
            "take a stroke",
            argument="chunk_samples",
            value=chunk_samples,
            window=window,
        )
    if hop > window:
        raise UsageError(
            "out-of-range",
            f"{hop=} is longer than the window of {window}, but a correction must follow the motion",
            "take a shorter hop",
            argument="hop",
            value=hop,
            window=window,
        )


_LEAD_S = 0.5  # before a chunk, for the model to reach the machine's state; a Q of 10 at 50 Hz decays in 0.06 s


class MotionCorrection(StatefulBase):
    """A Tracker whose Responses are those of the machine at a fixed position, each window's centre.

    The machine changes within a window, and its resonance still rings from earlier positions: in motion a response
    is biased, by an amount odd in speed. Here two masses with Keff(x) and bs(x) are fitted to a chunk of responses, the
    first time from a scan of ten stiffnesses, later from the previous model; the model is driven as the machine was,
    along the measured positions; the residual of the output, r = y − y_model, is analysed in the same windows; and

        Ĝ = G_frozen(x_centre) + R/U = Y/U + G_frozen(x_centre) − Y_model/U

    with G_frozen the model's sampled (zero-order hold) response. The fit is then repeated on Ĝ. Only w, u, y, x, the
    radius and (driven by the excitation) the loop's description are used.

    Driven by "torque", the model moves under the measured u, so that oscillations from accelerations, and the response
    of the controllers to noise, are in y_model as in y. Driven by "excitation", Ĝ = Y/U + G_frozen − Y_model/U_model
    with the described loop simulated under w alone; transients of accelerations then remain in Ĝ for some 0.5 s.

    To first order the same is (Y/U)·G_frozen/(Y_model/U_model) (`quotient`); at a line near the antiresonance, where
    the model's response over the window is much smaller than at its centre, this amplifies the noise.

    `sigma` is that of the corrected response: it is from the scatter of R between periods (or from the detection lines
    of r), without the motion, which is also in y_model. Windows in which the axis is at standstill, reverses or creeps
    while dry friction stops it are invalid, and an Event of kind "held" reports them; an axis at standstill without dry
    friction remains valid. docs/explanation/motion.md gives the detection rate.

    Delay: a response is returned when its chunk and one more window are complete, at most chunk + window samples after
    its newest sample; `finish` returns the rest at once. The results do not depend on how the samples are cut into
    Blocks, and a restored correction continues as if it had never stopped. It stores chunk + window + 0.5 s of samples.

    Bias: where the machine is not two masses, only the part that two masses explain is corrected. A window within 0.5 s
    of a gap, or of a start in motion, is not corrected.

    Parameters
    ----------
    settings
        As for a Tracker; names excitation (joint), input, output (motor velocity, rad/s) and schedule (position, m).
    radius_m
        Pulley's radius: metres of belt per radian; only Keff, bs and mL depend on it, not the correction.
    chunk_samples
        Responses are fitted together over this many samples; by default 4 s. A stroke is a good choice.
    driven_by
        "torque" or "excitation".
    quotient
        Correct by a quotient instead of a difference.
    passes
        Iterations of model and correction after a scan; two fewer from the previous model.
    stiffness_splines, damping_splines
        Number of B-splines of ln Keff(x) and ln bs(x) over a chunk: 1 for a constant, else 4 or more.

    Raises
    ------
    UsageError
        If a signal is missing, the quantity is not the plant, or a number is out of range.
    SimulationError
        If the loop cannot be simulated.

    Examples
    --------
    >>> from livebode.excitation import multisine
    >>> from livebode.core import Lines
    >>> from livebode.simulation import BeltAxis, SimulatedAxis, Strokes
    >>> lines = Lines.parse("20:140:20", rate_hz=4000, window=400)
    >>> axis = BeltAxis(motion=Strokes(), excitation_n_m=multisine(lines), seconds=3)
    >>> settings = Settings(lines=lines, excitation="w", input="u", output="velocity", schedule="x")
    >>> correction = MotionCorrection(settings, radius_m=0.019, chunk_samples=12000)
    >>> parts = [correction.process(block) for block in SimulatedAxis(axis).blocks(["w", "u", "velocity", "x"])]
    >>> responses = Responses.join([*parts, correction.finish()])
    >>> len(responses), round(correction.model.inertia_kg_m2, 5), float(correction.model.stiffness_at(0.8).round(-4))
    (600, 0.0028, 500000.0)
    """

    _stage = Stage("motion-correction", 2)

    def __init__(
        self,
        settings: Settings,
        *,
        radius_m: float,
        chunk_samples: int | None = None,
        driven_by: Literal["torque", "excitation"] = "torque",
        quotient: bool = False,
        passes: int = 3,
        stiffness_splines: int = 8,
        damping_splines: int = 4,
    ) -> None:
        lines = settings.lines
        self._chunk = round(4 * lines.rate_hz) if chunk_samples is None else chunk_samples
        splines = (stiffness_splines, damping_splines)
        check(settings, radius_m, self._chunk, driven_by, passes, splines)
        self.settings = settings
        self._drive = drive_of(settings.loop, lines.rate_hz) if driven_by == "excitation" else None
        self._quotient = quotient
        self._lead = max(round(_LEAD_S * lines.rate_hz), 2 * lines.window)
        self._settings_of_state = repr(
            (settings.identity, radius_m, self._chunk, self._drive, quotient, passes, splines)
        )
        names = [settings.excitation or settings.input, settings.input, settings.output, settings.schedule]
        self._names = [name for name in names if name]
        # Sigma is from the residual of the model, which does not contain the motion.
        own = replace(settings, noise="periods") if settings.noise == "auto" else settings
        self._tracker = Tracker(own, in_motion=False)  # what the model leaves shows distortion better
        self._events: list[Event] = []
        self._recorded = RecentSamples(self._names, lines)
        self._waiting = PendingResponses(lines)
        self._learner = Learner(settings, radius_m, splines, passes)
        self._scatter = Scatter(settings)
        self._standstill = StandstillDetector(settings, self._events)
        self._ripple = RippleMonitor(settings)
        self._distortion = ResidualDistortion(settings, self._events)
        self._from, self._aside = 0, NOTHING
        self._parts: dict[str, StatefulBase] = {
            "tracker": self._tracker,
            "recorded": self._recorded,
            "waiting": self._waiting,
            "learner": self._learner,
            "scatter": self._scatter,
            "standstill": self._standstill,
            "ripple": self._ripple,
            "distortion": self._distortion,
        }

    @property
    def model(self) -> MovingModel | None:
        """The fit of the newest chunk with travel; None before the first."""
        return self._learner.model

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of received, missing, and excluded samples for each reason."""
        return self._tracker.counts

    def found(self) -> dict[str, Any]:
        """Basis of the responses, and the model of the newest chunk: its masses, and its belt at eleven positions."""
        driven_by = "torque" if self._drive is None else "excitation"
        model = None if self.model is None else self.model.plain()
        ripple = [asdict(order) for order in self._ripple.orders]
        return self._tracker.found() | {
            "motion": {"driven_by": driven_by, "chunks": self._learner.chunks, "model": model, "ripple": ripple}
        }

    def excitation_power(self) -> Floats:
        """Power of the excitation, as `Tracker.excitation_power` gives it."""
        return self._tracker.excitation_power()

    def repeatability(self) -> Floats:
        """Repeatability, as `Tracker.repeatability` gives it."""
        return self._tracker.repeatability()

    def process(self, block: Block, emit: Emit = ignore) -> Responses:
        """Responses of the chunks that this Block completes; often none, for a completed chunk many.

        `emit` receives the events of the Tracker in this Block, and those of completed chunks.

        Raises
        ------
        LivebodeError
            As `Tracker.process`.
        """
        for name in self._names:
            block.index(name)
        tracked = self._tracker.process(block, self._events.append)
        done: list[Responses] = []
        if self._recorded and (block.gap or block.start != self._recorded.stop):
            done.append(self._finished())
        if not self._recorded:
            self._from = block.start
        begin, rows = 0, 0
        while begin < len(block):
            required = self._from + self._chunk + self.settings.lines.window
            piece = block.cut(begin, required - block.start)
            self._recorded.append(piece)
            begin += len(piece)
            until = int(np.searchsorted(tracked.sample, piece.stop))
            self._waiting.append(tracked[rows:until])
            rows = until
            if self._recorded.stop == required:
                done.append(self._corrected(self._from + self._chunk))
        hand_over(self._events, emit)
        return Responses.join(done) if done else tracked[0:0]

    def set_aside(self, spans: NDArray[np.int64], /) -> None:
        """See `Tracker.set_aside`; a chunk with these samples is not remembered."""
        self._aside = spans
        self._tracker.set_aside(spans)

    def finish(self, emit: Emit = ignore) -> Responses:
        """Responses of the remaining samples, fitted as a short chunk; the next Block starts a new chunk."""
        if not self._recorded:
            raise SignalError("too-short", "there are no samples to finish", "process a block first", samples=0)
        last = self._finished()
        hand_over(self._events, emit)
        return last

    def _finished(self) -> Responses:
        last = self._corrected(self._recorded.stop)
        self._recorded.forget()
        return last

    @property
    def _identity(self) -> str:
        return self._settings_of_state

    def _state(self) -> dict[str, Any]:
        return self._parts | {"from": self._from}

    def _load(self, state: dict[str, Any]) -> None:
        for name, part in self._parts.items():
            part.restore(state[name])
        self._from = int(state["from"])

    def _corrected(self, stop: int) -> Responses:
        """Responses up to the sample before `stop`, and their fit; drops what no later chunk needs."""
        tracked = self._waiting.pop(stop)
        end = min(stop + self.settings.lines.window, self._recorded.stop)
        chunk = self._recorded.chunk(self._from, stop, end)
        self._from = stop
        self._recorded.drop(stop - self._lead)
        if not len(tracked):
            return tracked
        return self._correct(tracked, chunk.at_rows(self.settings.lines, tracked.sample))

    def _correct(self, tracked: Responses, chunk: Chunk) -> Responses:
        def replay(model: MovingModel) -> ReplayResult:
            return self._replayed(model, tracked, chunk)

        now = self._learner.learn(tracked, chunk, replay)
        if now is None:
            nothing = np.full_like(tracked.value, complex(np.nan, np.nan))
            return replace(tracked, value=nothing, sigma=np.full(nothing.shape, np.nan), valid=tracked.valid & False)
        held = self._standstill.tail(chunk)
        if self._learner.has_travelled and (stretches := self._standstill.stretches(now.left, chunk)):
            wide = replay(self._learner.widened(tracked, chunk, now))
            held += self._standstill.held(stretches, tracked, wide.seen, chunk, wide.model.rigid_kg_m2)
            if not held and self._learner.travels:
                now = self._learner.completed(tracked, chunk, replay, now)
        left = without(now.left.velocity, held, chunk, self.settings.lines.window)
        seen, memory = self._scatter.then(left, chunk)
        aside = contains(self._aside, np.array([chunk.first]), np.array([chunk.stop - 1])).any()
        if not aside:
            self._scatter.keep(memory)
        seen = _rows_of(seen, tracked)
        value = self._value(now, tracked, chunk)
        valid = tracked.valid & seen.valid & np.isfinite(value)
        scale = np.abs(value / np.where(valid, tracked.value, 1.0)) if self._quotient else 1.0
        if not aside:
            self._ripple.process(left, chunk, now.model)
        with np.errstate(invalid="ignore", divide="ignore"):
            ripple = np.abs(value) * np.sqrt(self._ripple.power(chunk, tracked.sample)) / chunk.torque
        moving, against = self._distortion.process(left, chunk, tracked)
        at_standstill = np.isfinite(tracked.distortion)
        distortion = np.where(at_standstill, tracked.distortion, moving)
        valid &= at_standstill | ~against
        if held and self._distortion.is_possible:  # friction contradicts the model, and nothing tells by how much
            valid &= np.isfinite(distortion)
        return replace(
            tracked,
            value=np.where(valid, value, complex(np.nan, np.nan)),
            sigma=np.where(valid, with_distortion(np.hypot(seen.sigma * scale, ripple), distortion), np.nan),
            dof=seen.dof,
            valid=valid,
            distortion=np.where(against & ~at_standstill, np.inf, distortion),
        )

    def _replayed(self, model: MovingModel, tracked: Responses, chunk: Chunk) -> ReplayResult:
        left = residual(model, chunk, self.settings)
        seen = _rows_of(self._scatter.once(left.velocity, chunk), tracked)
        return ReplayResult(model, left, seen, frozen(model, tracked.schedule, self.settings) + seen.value)

    def _value(self, now: ReplayResult, tracked: Responses, chunk: Chunk) -> Complex:
        """The tracked responses plus the model's difference to its frozen response; NaN without a whole window."""
        if self._drive is None and not self._quotient:
            return now.value
        held = frozen(now.model, tracked.schedule, self.settings)
        with np.errstate(invalid="ignore"):  # NaN where a window is not whole
            if self._drive is None:
                moving = tracked.value - now.seen.value
            else:
                moving = self._under_excitation(now.model, tracked, chunk)
            return np.asarray(tracked.value * (held / moving) if self._quotient else tracked.value + (held - moving))

    def _under_excitation(self, model: MovingModel, tracked: Responses, chunk: Chunk) -> Complex:
        s = self.settings
        assert self._drive is not None
        u, y = by_excitation(model, self._drive, chunk.w, chunk.x)
        rows = {s.input: u, s.output: y} | ({s.excitation: chunk.w} if s.excitation else {})
        names = [name for name in rows if name]
        channels = tuple(map(Channel, names))
        block = Block(np.array([rows[n] for n in names]), channels, s.lines.rate_hz, start=chunk.start)
        seen = Tracker(replace(s, schedule=None, spikes=(), ripple=()), repeating=False).process(block)
        return _rows_of(seen, tracked).value


def _rows_of(seen: Responses, tracked: Responses) -> Responses:
    """The rows at the samples of the others."""
    first = int(np.searchsorted(seen.sample, tracked.sample[0]))
    return seen[first : first + len(tracked)]
