"""From spectra at the lines to frequency responses with bounds: the part of a Tracker after the kernel."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.core import Channel, Event, PlantKinds, Responses, Stage, StatefulBase
from livebode.estimation.bounds import between_periods, contained, power, unbiased
from livebode.estimation.detection import DetectionNoise, beyond
from livebode.estimation.estimators import Role
from livebode.estimation.hann import Hann
from livebode.estimation.moments import Moments, PeriodMoments
from livebode.estimation.movement import Movement
from livebode.estimation.periodicity import Periodicity
from livebode.estimation.quantities import from_plant
from livebode.estimation.repeating import Repeating
from livebode.estimation.settings import Settings
from livebode.estimation.spectra import SpectraRows

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

# A window counts as excited at a line down to this share of the largest power seen: above the rounding of the DFT,
# below any intended excitation.
_EXCITED = 1e-12


@dataclass(frozen=True, eq=False)
class Estimate:
    """What is known of each line: shapes (rows, lines), of `dof` (rows,)."""

    value: Complex
    sigma: Floats
    dof: Floats
    distortion: Floats
    weight: Complex


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

    _stage = Stage("line-stage", 1)
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
        self._moments = PeriodMoments(self._places, len(lines), settings.forgetting, own=settings.average)
        self._movement = Movement(self._places)
        self._periodicity = None
        if settings.method.reference == "input":
            name = settings.input or ""
            self._periodicity = Periodicity(lines, self._places, name, self._events)
        self._moving = 0
        self._largest = 0.0

    def _state(self) -> dict[str, Any]:
        return super()._state() | ({"periodicity": self._periodicity} if self._periodicity else {})

    def _load(self, state: dict[str, Any]) -> None:
        super()._load(state)
        if self._periodicity is not None and "periodicity" in state:  # older states have none
            self._periodicity.restore(state["periodicity"])

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
            share = np.where(np.isfinite(now.dof)[:, np.newaxis], now.repeatability, np.nan)
        return self._over_places(share)

    def _over_places(self, values: Floats) -> Floats:
        seen = self._moments.now.weight > 0
        return values[seen].mean(axis=0) if seen.any() else np.full(values.shape[1], np.nan)

    def process(
        self,
        rows: SpectraRows,
        place: NDArray[np.int64],
        centre: Floats,
        channels: Sequence[Channel],
        repeating: Repeating | None = None,
        ripple: Floats | None = None,
        aside: NDArray[np.bool_] | None = None,
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
            return self._responses(
                rows, place, centre, response_unit(channels, self._settings), repeating, ripple, aside
            )

    def _responses(
        self,
        rows: SpectraRows,
        place: NDArray[np.int64],
        centre: Floats,
        unit: str,
        repeating: Repeating | None,
        ripple: Floats | None,
        aside: NDArray[np.bool_] | None,
    ) -> Responses:
        s = self._settings
        spectrum = self._hann.combine(rows.spectrum, place) if self._hann else rows.spectrum
        signals: dict[Role, Complex] = dict(zip(self._roles, spectrum))
        pair, reference, powers = self._seen(signals)
        excited = self._excited(powers[0], rows.whole)
        usable = rows.clean & excited.any(axis=1)
        if aside is not None:
            usable &= ~aside
        series = int(place[0] // s.step - 1) % self._places if usable.size else 0
        moving = self._moves(series, centre, rows.sample) if usable.size else usable
        first = rows.sample - s.lines.window + 1
        moment = np.concatenate([centre, first[np.newaxis]])
        spectra = np.concatenate([pair, reference[np.newaxis]])
        moments = self._moments.update(series, spectra, powers, moment, usable)
        estimate = self._estimate(pair, powers, moments, moving, repeating, ripple)
        if s.average:
            begun = moments.weight > 0  # until then there is no mean, only the window's own time
            first, moment = np.where(begun, moments.first, first), np.where(begun, moments.moment, moment)
        # An average continues through windows that it excludes.
        seen = rows.whole if s.average else rows.clean
        valid = seen[:, np.newaxis] & excited & np.isfinite(estimate.value)
        distortion = np.where(valid, estimate.distortion, np.nan)
        if repeating is not None:
            against = repeating.invalid & ~moving[:, np.newaxis]
            distortion, valid = np.where(valid & against, np.inf, distortion), valid & ~against
        if self._periodicity is not None:
            leaks = self._periodicity.process(reference, usable, rows.sample, centre[0])
            valid = valid & (moving[:, np.newaxis] | ~leaks)
        several = valid & np.isfinite(moments.dof)[:, np.newaxis]
        return Responses(
            lines=s.lines,
            value=np.where(valid, estimate.value, complex(np.nan, np.nan)),
            sigma=np.where(valid, estimate.sigma, np.nan),
            dof=estimate.dof,
            coherence=np.where(several, unbiased(moments.coherence, moments), np.nan),
            valid=valid,
            first=first,
            sample=rows.sample,
            time_s=moment[0],
            schedule=moment[1],
            quantity=s.quantity,
            unit=unit,
            input_coherence=np.where(several, self._input_coherence(moments), np.nan),
            weight=np.where(valid, estimate.weight, complex(np.nan, np.nan)),
            distortion=distortion,
        )

    def _seen(self, signals: dict[Role, Complex]) -> tuple[Complex, Complex, Floats]:
        """Numerator and denominator times conj(reference) (2, rows, lines), reference, and the powers of moments."""
        method, lines = self._settings.method, slice(0, len(self._settings.lines))
        reference, output = signals[method.reference][:, lines], signals["output"][:, lines]
        denominator = signals[method.denominator][:, lines]
        pair = np.stack([output, denominator]) * reference.conj()
        noise = self._detected(signals, pair)
        return pair, reference, np.stack([power(reference), power(output), noise, power(denominator)])

    def _detected(self, signals: dict[Role, Complex], pair: Complex) -> Floats:
        """Noise of one window by the detection lines, as a power of numerator·conj(reference); zero without them."""
        if self._detection is None:
            return np.zeros(pair.shape[1:])
        method, at, beside = self._settings.method, slice(0, pair.shape[2]), slice(pair.shape[2], None)
        reference = power(signals[method.reference])
        excited = None
        if method.reference == "excitation":
            excited = reference[:, beside] / reference[:, at].mean(axis=1, keepdims=True)
        output, denominator = signals["output"][:, beside], signals[method.denominator][:, beside]
        return self._detection.power(pair[0] / pair[1], output, denominator, excited) * reference[:, at]

    def _moves(self, series: int, centre: Floats, sample: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Windows in which the machine moves; an Event for the first one whose noise is estimated in another way."""
        moving = self._movement.process(series, centre[1])
        if self._detection is None:
            return np.zeros(len(sample), dtype=np.bool_)
        if self._moving == 0 and moving.any():
            at = int(np.argmax(moving))
            self._events.append(
                Event(
                    "noise-from-detection-lines",
                    int(sample[at]),
                    float(centre[0, at]),
                    "the schedule moves: the noise is taken from detection lines (non-excited bins), because the "
                    "scatter between periods contains the motion",
                )
            )
        self._moving += int(np.count_nonzero(moving))
        return moving

    def _input_coherence(self, moments: Moments) -> Floats:
        """γ² of reference and input; NaN where the estimator has no input of its own."""
        if self._settings.method.reference == self._settings.method.denominator:
            return np.full(moments.means.shape[1:], np.nan)
        return unbiased(moments.input_coherence, moments)

    def _estimate(
        self,
        pair: Complex,
        powers: Floats,
        moments: Moments,
        moving: NDArray[np.bool_],
        repeating: Repeating | None,
        ripple: Floats | None,
    ) -> Estimate:
        """Value, sigma, distortion and weight (rows, lines), and the degrees of freedom (rows,)."""
        s, f = self._settings, self._settings.lines.frequency_hz
        numerator, denominator = moments.pair if s.average else pair
        excitation = moments.power[0] if s.average else powers[0]
        value = numerator / denominator
        share = moments.of_mean if s.average else np.ones(len(value))
        noise, dof = self._noise(powers[2], moments, moving, share)
        sigma = np.sqrt(noise * share[:, np.newaxis]) / np.abs(denominator)
        distortion = np.full(value.shape, np.nan)
        if repeating is not None:
            distortion = np.where(moving[:, np.newaxis], np.nan, repeating.distortion)
            sigma, dof = contained(sigma, dof, distortion, repeating.dof)
        if ripple is not None:
            sigma = np.hypot(sigma, np.abs(value) * np.sqrt(ripple / powers[3]))
        slope = np.ones_like(value)
        if s.method.through_loop:
            value, slope = s.loop.plant(value, f)
        # U/W is (Y/W)/G, whatever it is that was divided.
        weight = powers[0] + 0j if s.method.reference == "input" else numerator / excitation / value
        if s.quantity != "plant":
            signals = numerator, denominator, excitation + 0j
            value, by_plant = from_plant(s.quantity, value, s.loop, signals, f)
            slope, weight = slope * by_plant, np.full_like(value, complex(np.nan, np.nan))
        scale = np.abs(slope)
        return Estimate(value, sigma * scale, dof, distortion * scale, weight)

    def _noise(self, now: Floats, moments: Moments, moving: NDArray[np.bool_], share: Floats) -> tuple[Floats, Floats]:
        """Variance of numerator − Ĝ·denominator for one window (rows, lines), and its degrees of freedom (rows,).

        `now` is the power at the detection lines in this window. Where the machine moves, it is used alone, because the
        scatter between periods contains the motion; else the scatter is used, or with "quiet" the larger of the two.
        """
        periods, dof = between_periods(moments), moments.dof
        if self._detection is None:
            return periods, dof
        remembered = moments.power[2]
        beside = remembered if self._settings.average else now
        if self._settings.noise == "quiet":
            periods = np.fmax(periods, np.where(np.isfinite(periods), remembered, beside))
            dof = np.where(np.isfinite(dof), dof, self._detection.dof)
        dof = np.where(moving, self._detection.dof / share, dof)
        return np.where(moving[:, np.newaxis], beside, periods), dof

    def _excited(self, power: Floats, whole: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which lines have a share of the largest excitation so far, shape of `power` (rows, lines)."""
        largest = np.maximum.accumulate(np.r_[self._largest, np.where(whole, power.max(axis=1), 0.0)])
        self._largest = float(largest[-1])
        return np.asarray((power > _EXCITED * largest[1:, np.newaxis]) & (power > 0))


def response_unit(channels: Sequence[Channel], settings: Settings) -> str:
    """Unit of the response where both signals have one; open loop, closed loop and sensitivity have none."""
    output, input = _ends(channels, settings)
    return f"{output.unit}/({input.unit})" if output.unit and input.unit and settings.quantity == "plant" else ""


def plant_kinds(channels: Sequence[Channel], settings: Settings) -> PlantKinds:
    """The kinds of the plant's output, and of the signal that the response refers to."""
    return PlantKinds.of(*_ends(channels, settings))


def _ends(channels: Sequence[Channel], settings: Settings) -> tuple[Channel, Channel]:
    by_name = {channel.name: channel for channel in channels}
    names = settings.output, settings.channel(settings.method.denominator) or ""
    output, input = (by_name.get(name, Channel(name)) for name in names)
    return output, input
