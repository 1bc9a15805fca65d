"""From spectra at the lines to frequency responses with bounds: the part of a Tracker after the kernel."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Flags, Floats, Integers
from livebode.core import Channel, Event, PlantKinds, Responses, SourceUnit, Stage, StatefulBase
from livebode.estimation.detection import DetectionNoise, beyond
from livebode.estimation.implausible import FACTOR, PlausibleRange
from livebode.estimation.lasting_change import LastingChange
from livebode.estimation.movement import Movement
from livebode.estimation.periodic_variation import PeriodicVariation
from livebode.estimation.periods import PeriodMoments
from livebode.estimation.products import power, times
from livebode.estimation.quantities import LineEstimates
from livebode.estimation.repeating import RepeatingVerdicts
from livebode.estimation.spectra import Hann, SpectraRows, check_instruction_set
from livebode.estimation.tracker_settings import Role, Settings
from livebode.kernel import (
    NOISE_LARGER,
    NOISE_MOVING,
    NOISE_SCATTER,
    LineRows,
    LineSettings,
    LineWindows,
    MachineLines,
    NewestWindows,
    chosen_instruction_set,
    process_lines,
    process_newest,
)
from livebode.language import Message


class LineStage(StatefulBase):
    """Responses from spectra that were computed by the kernel here or in the drive.

    Spectra are sorted by their place in the period, so that each hop has its own history of whole periods; spectra
    further apart than a window are one series.

    Parameters
    ----------
    settings
        Lines, signals, estimator and options.
    sent
        The available bins; None where all are available.
    """

    _stage = Stage("line-stage", 2)
    _STATE = ("_moments", "_movement", "_moving", "_largest")

    def __init__(
        self, settings: Settings, sent: Collection[int] | None = None, *, events: list[Event] | None = None
    ) -> None:
        lines = settings.lines
        self._settings, self._roles = settings, settings.roles
        self._events = [] if events is None else events
        self._hann = Hann(lines) if settings.hann else None
        self._detection = None
        if settings.uses_detection_lines:
            # Only if the reference is the excitation itself does it show that these bins are not excited.
            outside = beyond(lines) if settings.method.reference == "excitation" else ()
            self._detection = DetectionNoise(lines, tuple(k for k in outside if sent is None or k in sent))
        self._places = max(1, lines.window // settings.step)
        self._moments = PeriodMoments(self._places, len(lines), settings.forgetting)
        self._kernel_settings = self._for_kernel()
        self._unit: tuple[Sequence[Channel], str] = ((), "")  # of the newest channels
        self._converts = settings.method.through_loop or settings.quantity != "plant"
        self._movement = Movement(self._places)
        self._periodicity = None
        if settings.method.reference == "input":
            from livebode.estimation.periodicity import Periodicity

            name = settings.input or ""
            self._periodicity = Periodicity(lines, self._places, name, self._events)
        self._change = self._variation = None
        if settings.average and settings.forgetting < 1:  # an average that remembers all is judged at its end
            self._change = LastingChange(lines, self._events)
            self._variation = PeriodicVariation(lines, max(lines.window, settings.step), self._events)
        self._moving = 0
        self._largest = 0.0

    def _for_kernel(self) -> LineSettings:
        s, weights = self._settings, self._moments.weights
        noise, noise_dof = NOISE_SCATTER, np.inf
        if self._detection is not None:
            noise, noise_dof = NOISE_LARGER if s.noise == "quiet" else NOISE_MOVING, self._detection.dof
        _, denominator, reference = s.signals
        weighting = weights.forgetting, weights.table
        check_instruction_set()
        return LineSettings(*weighting, s.average, denominator, reference, noise, noise_dof, chosen_instruction_set())

    def _state(self) -> dict[str, Any]:
        parts = {"periodicity": self._periodicity, "change": self._change, "variation": self._variation}
        return super()._state() | {name: part for name, part in parts.items() if part is not None}

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        if self._periodicity is not None and "periodicity" in state:  # older states have none
            self._periodicity.restore(state["periodicity"])
        for name, part in (("change", self._change), ("variation", self._variation)):
            if part is not None:
                part.restore(state[name])

    @property
    def bins(self) -> NDArray[np.int64]:
        """The required bins, in the order of the input."""
        lines = self._settings.lines
        bins = self._hann.bins if self._hann else np.asarray(lines.bins)
        return np.concatenate([bins, self._detection.bins]).astype(np.int64) if self._detection else bins

    def found(self) -> dict[str, Any]:
        """The basis of the responses as plain data for a record: rate, window, lines, hop, the noise's origin."""
        lines, ripple = self._settings.lines, [asdict(order) for order in self._settings.ripple]
        return {
            "rate_hz": lines.rate_hz,
            "window": lines.window,
            "frequency_hz": lines.frequency_hz.tolist(),
            "bins": list(lines.bins),
            "quiet_bins": list(lines.quiet),
            "hop": self._settings.step,
            **({"forgetting": self._settings.forgetting} if self._settings.average else {}),
            "judged": {"noise": self._settings.noise, "noise_from_detection_lines": self._moving}
            | ({"ripple": ripple} if ripple else {})
            | ({"not_repeating_hz": self._periodicity.not_repeating_hz()} if self._periodicity else {}),
        }

    def excitation_power(self) -> Floats:
        """Mean |R|² of the reference at each line over the remembered windows, shape (lines,); NaN before the first."""
        return self._over_places(self._moments.now.power[0])

    def repeatability(self) -> Floats:
        """Share of the reference's power that repeats from period to period, shape (lines,): 1 for a periodic one.

        About 1/m over m periods at a line where there is only noise, or where the window is not a whole number of
        periods; NaN before the second window.
        """
        now = self._moments.now
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(np.isfinite(now.weights.dof)[:, np.newaxis], now.repeatability, np.nan)
        return self._over_places(share)

    def _over_places(self, values: Floats) -> Floats:
        seen = self._moments.now.weights.one > 0
        return values[seen].mean(axis=0) if seen.any() else np.full(values.shape[1], np.nan)

    def process(
        self,
        rows: SpectraRows,
        place: NDArray[np.int64],
        centre: Floats,
        channels: Sequence[Channel],
        repeating: RepeatingVerdicts | None = None,
        ripple: Floats | None = None,
        aside: Flags | None = None,
    ) -> Responses:
        """Responses of consecutive spectra.

        Parameters
        ----------
        rows
            Spectra of the estimator's signals at `bins`.
        place
            Number of each window's newest sample, plus one, modulo N, as the spectra's phase counts it.
        centre
            Time and schedule at each window's centre, shape (2, rows).
        channels
            Names and units of the signals.
        repeating
            Errors that repeat with the excitation, from the previous periods; None where there are no samples.
        ripple
            Largest power of a ripple that is added to the input, at each line, (rows, lines); None where none is known.
        aside
            Windows that do not enter the moments of later ones, (rows,); None for none.
        """
        with np.errstate(all="ignore"):  # an incomplete window has no defined value, so it becomes NaN
            return self._responses(rows, place, centre, self._unit_of(channels), repeating, ripple, aside)

    def _unit_of(self, channels: Sequence[Channel]) -> str:
        if self._unit[0] != channels:
            self._unit = channels, response_unit(channels, self._settings)
        return self._unit[1]

    def _responses(
        self,
        rows: SpectraRows,
        place: NDArray[np.int64],
        centre: Floats,
        unit: str,
        repeating: RepeatingVerdicts | None,
        ripple: Floats | None,
        aside: Flags | None,
    ) -> Responses:
        s, lines = self._settings, len(self._settings.lines)
        spectrum = self._hann.combine(rows.spectrum, place) if self._hann else rows.spectrum
        signals: dict[Role, Complex] = dict(zip(self._roles, spectrum))
        series = int(place[0] // s.step - 1) % self._places if place.size else 0
        moving = self._moves(series, centre, rows.sample)
        first = rows.sample - s.lines.window + 1
        noise = self._detected(signals)
        distortion, against, invalid, verdict, dof_repeating = None, None, None, None, np.inf
        if repeating is not None:
            distortion, against, verdict = repeating.of(moving)
            dof_repeating, invalid = repeating.dof, None if self._converts else against
        windows = LineWindows(
            self._largest,
            series,
            np.ascontiguousarray(spectrum),
            noise,
            rows.whole,
            rows.clean,
            aside,
            moving,
            distortion,
            invalid,
            verdict,
            dof_repeating,
            np.concatenate([centre, first[np.newaxis]]),
        )
        results, self._largest = process_lines(self._kernel_settings, self._moments.arrays, windows)
        if self._change is not None and self._variation is not None:
            self._look_for_change(self._change, self._variation, series, signals, results.usable, centre, rows.sample)
        estimates = LineEstimates.of(results)
        if ripple is not None:
            estimates = estimates.with_ripple(ripple, power(signals[s.method.denominator][:, :lines]))
        if self._converts:
            estimates = estimates.converted(s)
            if against is not None:
                estimates = estimates.without(against[verdict])
        if self._periodicity is not None:
            input_ = signals["input"][:, :lines]
            leaks = self._periodicity.process(input_, results.usable, rows.sample, centre[0])
            estimates = estimates.only(estimates.valid & ~_where_not(leaks, moving))
        return _as_responses(s, results, estimates, rows.sample, unit)

    @property
    def is_plain(self) -> bool:
        """Whether a response follows from the spectrum and the moments alone, so that `process_each` supports it."""
        others = self._hann, self._detection, self._periodicity, self._change
        return not (self._converts or self._settings.ripple or any(others))

    @staticmethod
    def process_each(
        stages: Sequence[LineStage],
        ranges: Sequence[PlausibleRange],
        sums: Complex,
        chosen: tuple[Integers, Integers],
        sample: Integers,
        place: Integers,
        centre: Floats,
        due: Flags,
        channels: Sequence[Channel],
    ) -> tuple[Responses | None, Flags]:
        """One response of each of several stages with equal settings that are `is_plain`: a row for each stage.

        The bits are those of `process` for each stage alone. Where this raises, no stage has changed.

        Parameters
        ----------
        stages
            Different ones.
        ranges
            Of each stage, that of the magnitudes of its spectra.
        sums, chosen, due
            As in `NewestWindows`.
        sample, place, centre, channels
            As in `process`, with a row for each stage.

        Returns
        -------
        responses, taken
            Rows of the stages that took their spectrum, None without one, and which these are, (stages,). The spectra
            of others are not due, not finite or implausible; they have not changed.
        """
        example = stages[0]
        s = example._settings
        moment = np.empty((len(stages), 3))
        moment[:, :2], moment[:, 2] = centre.T, sample - (s.lines.window - 1)
        largest, places = np.array([stage._largest for stage in stages]), (place // s.step - 1) % example._places
        machines = [MachineLines(stage._moments.arrays, *own.newest) for stage, own in zip(stages, ranges)]
        windows = NewestWindows(largest, places, sums, chosen, moment, due)
        results, largest, taken = process_newest(example._kernel_settings, machines, windows, FACTOR)
        for stage, own, power_max, is_taken in zip(stages, ranges, largest.tolist(), taken.tolist()):
            if is_taken:
                stage._largest = power_max
                own.count()
        if not len(results.dof):
            return None, taken
        if len(results.dof) < len(stages):
            sample = sample[taken]
        return _as_responses(s, results, LineEstimates.of(results), sample, example._unit_of(channels)), taken

    def _look_for_change(
        self,
        change: LastingChange,
        variation: PeriodicVariation,
        series: int,
        signals: dict[Role, Complex],
        usable: Flags,
        centre: Floats,
        sample: NDArray[np.int64],
    ) -> None:
        """Test the windows at the first place of a period, which do not overlap."""
        chosen = np.arange(-series % self._places, len(usable), self._places)
        chosen = chosen[usable[chosen]]
        if not chosen.size:
            return
        method, lines = self._settings.method, len(self._settings.lines)
        output, denominator, reference = (
            signals[role][chosen, :lines] for role in ("output", method.denominator, method.reference)
        )
        pair = np.stack([times(output, reference.conj()), times(denominator, reference.conj())])
        for test in (change, variation):
            test.process(pair, centre[0, chosen], centre[1, chosen], sample[chosen])

    def _detected(self, signals: dict[Role, Complex]) -> Floats | None:
        """Noise of one window by the detection lines, as a power of numerator·conj(reference); None without them."""
        if self._detection is None:
            return None
        method, lines = self._settings.method, len(self._settings.lines)
        excited_part, beside = slice(0, lines), slice(lines, None)
        every = power(signals[method.reference])
        excited = None
        if method.reference == "excitation":
            excited = every[:, beside] / every[:, excited_part].mean(axis=1, keepdims=True)
        output, denominator = signals["output"], signals[method.denominator]
        conjugate = signals[method.reference][:, excited_part].conj()
        ratio = times(output[:, excited_part], conjugate) / times(denominator[:, excited_part], conjugate)
        noise = self._detection.power(ratio, output[:, beside], denominator[:, beside], excited)
        return np.ascontiguousarray(noise * every[:, excited_part])

    def _moves(self, series: int, centre: Floats, sample: NDArray[np.int64]) -> Flags | None:
        """Windows in which the machine moves; an Event for the first one whose noise is estimated in another way.

        None where noise is not taken from detection lines, so that it makes no difference.
        """
        if self._detection is None:
            return None
        if not sample.size:
            return np.zeros(0, dtype=np.bool_)
        moving = self._movement.process(series, centre[1])
        if self._moving == 0 and moving.any():
            first = int(np.argmax(moving))
            self._events.append(
                Event(
                    "noise-from-detection-lines",
                    int(sample[first]),
                    float(centre[0, first]),
                    Message(
                        "the schedule moves: the noise is taken from detection lines (non-excited bins), because the "
                        "scatter between periods contains the motion"
                    ),
                )
            )
        self._moving += int(np.count_nonzero(moving))
        return moving


def _as_responses(
    settings: Settings, results: LineRows, estimates: LineEstimates, sample: NDArray[np.int64], unit: str
) -> Responses:
    return Responses(
        lines=settings.lines,
        value=estimates.value,
        sigma=estimates.sigma,
        dof=results.dof,
        coherence=estimates.coherence,
        valid=estimates.valid,
        first=results.moment[2].astype(np.int64) if settings.average else sample - settings.lines.window + 1,
        sample=sample,
        time_s=results.moment[0],
        schedule=results.moment[1],
        quantity=settings.quantity,
        unit=unit,
        input_coherence=estimates.input_coherence,
        weight=estimates.weight,
        distortion=estimates.distortion,
        variation=estimates.variation,
    )


def _where_not(these: Flags, moving: Flags | None) -> Flags:
    """Only in windows in which the machine does not move."""
    return these if moving is None else these & ~moving[:, np.newaxis]


def response_unit(channels: Sequence[Channel], settings: Settings) -> str:
    """Unit of the response where both signals have one; open loop, closed loop and sensitivity have none."""
    output, input = _ends(channels, settings)
    return f"{output.unit}/({input.unit})" if output.unit and input.unit and settings.quantity == "plant" else ""


def source_unit(channels: Sequence[Channel], settings: Settings) -> SourceUnit | None:
    """Unit of the response in the units of the source; None if it is the same, or the response has none."""
    return SourceUnit.of(*_ends(channels, settings)) if response_unit(channels, settings) else None


def plant_kinds(channels: Sequence[Channel], settings: Settings) -> PlantKinds:
    """The kinds of the plant's output, and of the signal that the response refers to."""
    return PlantKinds.of(*_ends(channels, settings))


def _ends(channels: Sequence[Channel], settings: Settings) -> tuple[Channel, Channel]:
    by_name = {channel.name: channel for channel in channels}
    names = settings.output, settings.channel(settings.method.denominator) or ""
    output, input = (by_name.get(name, Channel(name)) for name in names)
    return output, input
