"""MotionCorrection: responses of an axis in motion, freed from what the motion does to them."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from livebode.estimation import Settings, Tracker
from livebode.fitting import two_masses
from livebode.motion.drive import drive_of
from livebode.motion.fit import Fit, Rows
from livebode.motion.model import MovingModel
from livebode.motion.replay import by_excitation, by_torque, without_drift
from livebode.motion.steady import steady_rows
from livebode.nouns import Block, Channel, InputError, Responses

Floats = NDArray[np.float64]

_LEAD_S = 0.5  # before a chunk, for the model to come to the machine's state; a Q of 10 at 50 Hz forgets in 0.06 s
_ROWS_MIN = 12
_FLAT_M = 1e-3  # a chunk that travels less has no curves to fit


class MotionCorrection:
    """A Tracker whose Responses are those of the machine held at each window's centre.

    A window sees a machine that changes, and its resonance rings on from where the machine was: in motion a response
    is off, by an amount odd in speed. Here two masses with Keff(x) and bs(x) are fitted to a chunk of responses,
    started by themselves from a scan of ten stiffnesses; the fitted model is driven as the machine was, along the
    measured positions; its signals go through the same windows; what the motion did to the model is taken off the
    machine:

        Ĝ = Y/U + G_frozen(x_centre) − Y_model/U_model

    with G_frozen the model's sampled (zero-order hold) response. The fit is then repeated on Ĝ, `passes` times. Only
    w, u, y, x, the radius and (driven by the excitation) the loop's description are used.

    Driven by "torque", the model moves under the measured u, so that whatever rings from accelerations, and the answer
    of the controllers to noise, is in Y_model as in Y, and U_model is U. Driven by "excitation", the described loop is
    simulated under w alone; what accelerations leave behind then stays in Ĝ for some 0.5 s.

    To first order the same is (Y/U)·G_frozen/(Y_model/U_model) (`quotient`); at a line near the antiresonance, where
    the model's window sees much less than it has at its centre, that multiplies the noise.

    Delay: a response comes out when its chunk and one more window are complete, at most chunk + window samples after
    its newest sample; `finish` hands out the rest at once. Wherever Blocks are cut, the results are the same.

    Bias: where the machine is not two masses, only what it shares with them is corrected. Dry friction at standstill,
    and a window within 0.5 s of a start or a gap, are not; nor is an acceleration's onset where friction lets go.
    `sigma` is the Tracker's (of a quotient, scaled with it); with noise = "periods" it counts the motion as noise.

    Parameters
    ----------
    settings
        As for a Tracker; names excitation (joint), input, output (motor velocity, rad/s) and schedule (position, m).
    radius_m
        Pulley's radius: metres of belt per radian; only Keff, bs and mL are in its units, the correction is the same.
    chunk_samples
        Responses are fitted together over this many samples; by default 4 s. A stroke is a good choice.
    driven_by
        "torque" or "excitation".
    quotient
        Correct by a quotient instead of a difference.
    passes
        How often model and correction are repeated.
    stiffness_splines, damping_splines
        How freely ln Keff(x) and ln bs(x) move over a chunk: 1 for a constant, else 4 or more B-splines.

    Raises
    ------
    InputError
        If a signal is not named, the quantity is not the plant, or the loop cannot be simulated.

    Examples
    --------
    >>> from livebode.excitation import multisine
    >>> from livebode.nouns import Lines
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
        _check(settings, radius_m, passes, stiffness_splines, damping_splines)
        if driven_by not in ("torque", "excitation"):
            raise InputError(f"{driven_by=} is not known; choose 'torque' or 'excitation'")
        lines = settings.lines
        self.settings = settings
        self.model: MovingModel | None = None
        """The fit of the newest chunk; None before the first."""
        self._drive = drive_of(settings.loop, lines.rate_hz) if driven_by == "excitation" else None
        self._quotient = quotient
        self._passes, self._splines, self._radius_m = passes, (stiffness_splines, damping_splines), radius_m
        self._chunk = round(4 * lines.rate_hz) if chunk_samples is None else chunk_samples
        if self._chunk < 2 * lines.window:
            raise InputError(f"chunk_samples={self._chunk} is less than two windows of {lines.window}; take a stroke")
        self._lead = max(round(_LEAD_S * lines.rate_hz), 2 * lines.window)
        self._tracker = Tracker(settings)
        self._names = [n for n in (settings.excitation or settings.input, settings.input, settings.output) if n]
        self._names.append(settings.schedule or "")
        self._forget()

    def _forget(self) -> None:
        self._pending: list[Responses] = []
        self._parts: list[Block] = []
        self._from = -1

    def process(self, block: Block) -> Responses:
        """Responses of the chunks that this Block completes; often none, once a chunk many.

        Raises
        ------
        InputError
            As `Tracker.process`.
        """
        for name in self._names:
            block.index(name)
        done: list[Responses] = []
        if self._parts and (block.gap or block.start != self._parts[-1].stop):
            done.append(self.finish())
        tracked = self._tracker.process(block)
        if self._from < 0:
            self._from = block.start
        self._pending.append(tracked)
        self._parts.append(block)
        while self._parts[-1].stop >= self._from + self._chunk + self.settings.lines.window:
            done.append(self._corrected(self._from + self._chunk))
        return Responses.join(done) if done else tracked[0:0]

    def finish(self) -> Responses:
        """Responses of what is left, fitted as a short chunk; the next Block starts anew."""
        if not self._parts:
            raise InputError("there are no samples to finish; process a block first")
        last = self._corrected(self._parts[-1].stop)
        self._forget()
        return last

    def _corrected(self, stop: int) -> Responses:
        """Responses up to the sample before `stop`, and their fit; forgets what no later chunk needs."""
        pending = Responses.join(self._pending)
        count = int(np.searchsorted(pending.sample, stop))
        tracked, self._pending = pending[:count], [pending[count:]]
        end = min(stop + self.settings.lines.window, self._parts[-1].stop)
        signals = self._signals(end)
        corrected = self._correct(tracked, signals) if count else tracked
        self._from = stop
        self._parts = [part for part in self._parts if part.stop > stop - self._lead]
        return corrected

    def _signals(self, end: int) -> Block:
        """w, u, y, x from the lead on; a sample that is not finite is as the last one before it."""
        begin = max(self._from - self._lead, self._parts[0].start)
        data = np.concatenate([[p.data[p.index(n)] for n in self._names] for p in self._parts], axis=1)
        data = data[:, begin - self._parts[0].start : end - self._parts[0].start]
        if not np.isfinite(data).all():
            known = np.where(np.isfinite(data), np.arange(data.shape[1]), -1)
            last = np.maximum.accumulate(known, axis=1)
            data = np.where(last >= 0, np.take_along_axis(data, last.clip(0), axis=1), 0.0)
        return Block(data, _channels("w", "u", "y", "x"), self.settings.lines.rate_hz, start=begin)

    def _correct(self, tracked: Responses, signals: Block) -> Responses:
        usable = tracked.valid.all(axis=1) & np.isfinite(tracked.schedule)
        steady = usable & steady_rows(tracked.sample, signals, self.settings.lines.window)
        fitted = steady if np.count_nonzero(steady) >= _ROWS_MIN else usable
        if np.count_nonzero(fitted) >= _ROWS_MIN:
            self.model, value = self._fitted(tracked, fitted, signals)
        elif self.model is not None:
            value = self._moved(self.model, tracked, signals)
        else:
            value = np.full_like(tracked.value, np.nan)
        valid = tracked.valid & np.isfinite(value)
        scale = np.abs(value / np.where(valid, tracked.value, 1.0)) if self._quotient else 1.0
        return replace(
            tracked,
            value=np.where(valid, value, complex(np.nan, np.nan)),
            sigma=np.where(valid, tracked.sigma * scale, np.nan),
            valid=valid,
        )

    def _fitted(
        self, tracked: Responses, used: NDArray[np.bool_], signals: Block
    ) -> tuple[MovingModel, NDArray[np.complex128]]:
        lines, at = self.settings.lines, tracked.schedule[used]
        splines = self._splines if np.ptp(at) > _FLAT_M else (1, 1)
        fit = Fit(lines.z, lines.rate_hz, self._radius_m, *splines)
        # The error of a response is n/|U|: white noise on y over the torque at the line.
        weight = self._torque(signals, tracked.sample[used])
        value = tracked.value
        model = fit.start(Rows(value[used], weight, at))
        for _ in range(self._passes):
            model = fit.refine(Rows(value[used], weight, at), model)
            value = self._moved(model, tracked, signals)
            value[used] = np.where(np.isfinite(value[used]), value[used], tracked.value[used])
        return model, value

    def _torque(self, signals: Block, sample: NDArray[np.int64]) -> Floats:
        """|U| at the lines over the windows that end at these samples, (rows, lines)."""
        window, lines = self.settings.lines.window, self.settings.lines
        first = sample - signals.start - window + 1
        wave = np.exp(-2j * np.pi * np.outer(np.arange(window), lines.bins) / window)
        return np.asarray(np.abs(np.lib.stride_tricks.sliding_window_view(signals["u"], window)[first] @ wave))

    def _moved(self, model: MovingModel, tracked: Responses, signals: Block) -> NDArray[np.complex128]:
        """The tracked responses, moved as the model's had to be to its frozen one; NaN where it has no whole window."""
        lines, s = self.settings.lines, self.settings
        if self._drive is None:
            u, y = signals["u"], by_torque(model, lines.rate_hz, signals["u"], signals["x"])
            y = without_drift(y, signals["y"], lines.window)
        else:
            u, y = by_excitation(model, self._drive, signals["w"], signals["x"])
        names = list(dict.fromkeys(n for n in (s.excitation, s.input, s.output) if n))
        rows = {s.input: u, s.output: y} | ({s.excitation: signals["w"]} if s.excitation else {})
        block = Block(np.array([rows[n] for n in names]), _channels(*names), lines.rate_hz, start=signals.start)
        seen = Tracker(replace(s, schedule=None, spikes=())).process(block)
        place = np.searchsorted(seen.sample, tracked.sample)
        at = np.where(np.isfinite(tracked.schedule), tracked.schedule, model.low_m)
        frozen = two_masses.sampled(model.parameters(at), lines.z, lines.rate_hz)
        with np.errstate(invalid="ignore"):  # NaN where a window is not whole
            if self._quotient:
                return np.asarray(tracked.value * (frozen / seen.value[place]))
            return np.asarray(tracked.value + (frozen - seen.value[place]))


def _channels(*names: str) -> tuple[Channel, ...]:
    return tuple(Channel(name) for name in names)


def _check(settings: Settings, radius_m: float, passes: int, stiffness_splines: int, damping_splines: int) -> None:
    if settings.input is None or settings.schedule is None:
        raise InputError("the correction needs the input (torque) and the schedule (position); name their channels")
    if settings.quantity != "plant" or settings.average or settings.estimator == "indirect":
        raise InputError("the correction is of single windows of the plant by the joint or the direct estimator")
    if not (np.isfinite(radius_m) and radius_m > 0):
        raise InputError(f"{radius_m=} is not a positive number of metres per radian")
    if passes < 1:
        raise InputError(f"{passes=} is not at least 1; 3 is usual")
    for name, splines in (("stiffness_splines", stiffness_splines), ("damping_splines", damping_splines)):
        if splines != 1 and splines < 4:
            raise InputError(f"{name}={splines} is neither 1 nor at least 4")
