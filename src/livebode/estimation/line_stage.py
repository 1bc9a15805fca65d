"""From spectra at the lines to frequency responses with bounds: all of a Tracker that comes after the kernel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.estimation.bounds import between_periods, power
from livebode.estimation.estimators import Role
from livebode.estimation.hann import Hann
from livebode.estimation.moments import Moments, PeriodMoments
from livebode.estimation.quantities import convert
from livebode.estimation.quiet import NEIGHBOURS, QuietNoise
from livebode.estimation.settings import Settings
from livebode.estimation.spectra import Rows
from livebode.nouns import Channel, Responses

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

# A window counts as excited at a line down to this share of the largest power seen: above the rounding of the DFT,
# below any excitation that somebody meant.
_EXCITED = 1e-12


class LineStage:
    """Responses from spectra, wherever these were computed: here by the kernel, or in the drive.

    Spectra are told apart by their place in the period, so that each hop has its own past of whole periods; spectra
    further apart than a window are one series.

    Parameters
    ----------
    settings
        Lines, signals, estimator and options.
    """

    def __init__(self, settings: Settings) -> None:
        lines = settings.lines
        self._settings, self._roles = settings, settings.roles
        self._hann = Hann(lines) if settings.hann else None
        self._quiet = QuietNoise(lines) if settings.noise == "quiet" else None
        self._places = max(1, lines.window // settings.step)
        self._moments = PeriodMoments(self._places, len(lines), settings.forgetting, own=settings.average)
        self._largest = 0.0

    @property
    def bins(self) -> NDArray[np.int64]:
        """The bins that it needs, in the order in which it takes them."""
        lines = self._settings.lines
        bins = self._hann.bins if self._hann else np.asarray(lines.bins)
        return np.concatenate([bins, lines.quiet]).astype(np.int64) if self._quiet else bins

    def state(self) -> dict[str, NDArray[np.generic]]:
        return self._moments.state() | {"largest": np.array([self._largest])}

    def load(self, state: dict[str, NDArray[np.generic]]) -> None:
        self._moments.load(state)
        self._largest = float(state["largest"][0])

    def found(self) -> dict[str, Any]:
        """What the responses stand on, as plain data for a record: rate, window, lines, hop."""
        lines = self._settings.lines
        return {
            "rate_hz": lines.rate_hz,
            "window": lines.window,
            "frequency_hz": lines.frequency_hz.tolist(),
            "bins": list(lines.bins),
            "quiet_bins": list(lines.quiet),
            "hop": self._settings.step,
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

    def process(self, rows: Rows, place: NDArray[np.int64], centre: Floats, channels: Sequence[Channel]) -> Responses:
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
        """
        with np.errstate(all="ignore"):  # what is not whole may be anything, and comes out as NaN
            return self._responses(rows, place, centre, response_unit(channels, self._settings))

    def _responses(self, rows: Rows, place: NDArray[np.int64], centre: Floats, unit: str) -> Responses:
        s, lines = self._settings, slice(0, len(self._settings.lines))
        spectrum = self._hann.combine(rows.spectrum, place) if self._hann else rows.spectrum
        signals: dict[Role, Complex] = dict(zip(self._roles, spectrum))
        reference = signals[s.method.reference][:, lines]
        pair = np.stack([signals["output"][:, lines], signals[s.method.denominator][:, lines]]) * reference.conj()
        powers = np.stack([power(reference), power(signals["output"][:, lines]), self._quiet_power(signals, pair)])
        excited = self._excited(powers[0], rows.whole)
        usable = rows.clean & excited.any(axis=1)
        series = int(place[0] // s.step - 1) % self._places if usable.size else 0
        first = rows.sample - s.lines.window + 1
        moment = np.concatenate([centre, first[np.newaxis]])
        spectra = np.concatenate([pair, reference[np.newaxis]])
        moments = self._moments.update(series, spectra, powers, moment, usable)
        value, sigma, dof = self._estimate(pair, powers, moments)
        if s.average:
            begun = moments.weight > 0  # until then there is no mean, only the window's own moment
            first, moment = np.where(begun, moments.first, first), np.where(begun, moments.moment, moment)
        # An average goes on through windows that it leaves out.
        seen = rows.whole if s.average else rows.clean
        valid = seen[:, np.newaxis] & excited & np.isfinite(value)
        several = np.isfinite(moments.dof)[:, np.newaxis]
        return Responses(
            lines=s.lines,
            value=np.where(valid, value, complex(np.nan, np.nan)),
            sigma=np.where(valid, sigma, np.nan),
            dof=dof,
            coherence=np.where(valid & several, moments.coherence, np.nan),
            valid=valid,
            first=first,
            sample=rows.sample,
            time_s=moment[0],
            schedule=moment[1],
            quantity=s.quantity,
            unit=unit,
        )

    def _quiet_power(self, signals: dict[Role, Complex], pair: Complex) -> Floats:
        """Noise of one window by the quiet bins, as a power of numerator·conj(reference); zero without them."""
        if self._quiet is None:
            return np.zeros(pair.shape[1:])
        at, quiet = slice(0, pair.shape[2]), slice(pair.shape[2], None)
        output, denominator = signals["output"][:, quiet], signals[self._settings.method.denominator][:, quiet]
        return self._quiet.power(pair[0] / pair[1], output, denominator) * power(
            signals[self._settings.method.reference][:, at]
        )

    def _estimate(self, pair: Complex, powers: Floats, moments: Moments) -> tuple[Complex, Floats, Floats]:
        """Value and sigma (rows, lines), and the degrees of freedom (rows,)."""
        s, f = self._settings, self._settings.lines.frequency_hz
        numerator, denominator = moments.pair if s.average else pair
        ratio = numerator / denominator
        share = moments.of_mean if s.average else np.ones(len(ratio))
        if self._quiet:
            noise = moments.power[2] if s.average else powers[2]
            dof = NEIGHBOURS / share
        else:
            noise, dof = between_periods(moments), moments.dof
        sigma = np.sqrt(noise * share[:, np.newaxis]) / np.abs(denominator)
        if s.method.through_loop:
            ratio, slope = s.loop.plant(ratio, f)
            sigma = sigma * np.abs(slope)
        if s.quantity != "plant":
            entered = s.loop.entry_at(f) * (moments.power[0] if s.average else powers[0])
            # Without a description of the controller the signals tell what it did: F·y = E·w − u.
            known = s.loop.feedback is not None
            feedback = s.loop.feedback_at(f) if known else (entered - denominator) / numerator
            ratio, slope = convert(s.quantity, ratio, feedback)
            sigma = sigma * np.abs(slope)
        return ratio, sigma, dof

    def _excited(self, power: Floats, whole: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which lines have a share of the largest excitation so far, shape of `power` (rows, lines)."""
        largest = np.maximum.accumulate(np.r_[self._largest, np.where(whole, power.max(axis=1), 0.0)])
        self._largest = float(largest[-1])
        return np.asarray((power > _EXCITED * largest[1:, np.newaxis]) & (power > 0))


def response_unit(channels: Sequence[Channel], settings: Settings) -> str:
    """Unit of the response where both signals have one; open loop, closed loop and sensitivity have none."""
    units = {channel.name: channel.unit for channel in channels}
    over, under = (units[name] for name in (settings.output, settings.channel(settings.method.denominator) or ""))
    return f"{over}/({under})" if over and under and settings.quantity == "plant" else ""
