"""Tracker: samples in, frequency responses with bounds out, at the pace of the samples."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebode.estimation import snapshots
from livebode.estimation.bounds import between_periods, power
from livebode.estimation.centre import Centre
from livebode.estimation.estimators import Role
from livebode.estimation.hann import Hann
from livebode.estimation.moments import Moments, PeriodMoments
from livebode.estimation.quantities import convert
from livebode.estimation.quiet import NEIGHBOURS, QuietNoise
from livebode.estimation.settings import Settings
from livebode.estimation.spectra import LineSpectra, Rows
from livebode.estimation.spikes import SpikeGate
from livebode.estimation.watch import Watch
from livebode.nouns import Block, Channel, Event, InputError, Responses

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

# A window counts as excited at a line down to this share of the largest power seen: above the rounding of the DFT,
# below any excitation that somebody meant.
_EXCITED = 1e-12


class Tracker:
    """Frequency responses of a machine in closed loop, sample by sample, from a sliding DFT at excited lines.

    Any cutting of the same samples into Blocks gives the same Responses, and a restored Tracker goes on as if it had
    never stopped. A Response speaks for its window's centre: it is (N − 1)/2 samples late, and what changed within the
    window is averaged over it. The first whole one comes N samples after a start, a gap or a sample that is not finite.

    Parameters
    ----------
    settings
        Lines, signals, estimator and options.

    Examples
    --------
    A plant of gain 2 with a sample of delay:

    >>> import numpy as np
    >>> from livebode.nouns import Block, Lines
    >>> w = np.sin(2 * np.pi * 5 * np.arange(400) / 100)
    >>> block = Block(np.array([w, 2 * np.roll(w, 1)]), ("w", "y"), rate_hz=1000)
    >>> lines = Lines.parse("50", rate_hz=1000, window=100)
    >>> tracker = Tracker(Settings(lines=lines, estimator="direct", input="w", output="y"))
    >>> responses = tracker.process(block)
    >>> len(responses), responses.magnitude_db[-1].round(3)
    (80, array([6.021]))
    """

    def __init__(self, settings: Settings) -> None:
        lines = settings.lines
        self.settings = settings
        self._roles = settings.roles
        self._hann = Hann(lines) if settings.hann else None
        self._quiet = QuietNoise(lines) if settings.noise == "quiet" else None
        bins = self._hann.bins if self._hann else np.asarray(lines.bins)
        if self._quiet:
            bins = np.concatenate([bins, lines.quiet])
        self._spectra = LineSpectra(
            lines.window,
            bins,
            settings.step,
            self._named(settings.differenced),
            np.array([settings.loop.advance_ticks(role) for role in self._roles]),
            SpikeGate(self._named(settings.spikes), lines.window) if settings.spikes else None,
            settings.dtype,
        )
        self._nothing: Responses | None = None
        self._places = lines.window // settings.step
        self._moments = PeriodMoments(self._places, len(lines), settings.forgetting, own=settings.average)
        self._centre = Centre(lines.window)
        self._watch = Watch(lines.window)
        self._parts: dict[str, LineSpectra | PeriodMoments | Centre | Watch] = {
            "spectra": self._spectra,
            "moments": self._moments,
            "centre": self._centre,
            "watch": self._watch,
        }

    def _named(self, channels: tuple[str, ...]) -> NDArray[np.bool_]:
        return np.array([self.settings.channel(role) in channels for role in self._roles])

    @property
    def counts(self) -> dict[str, int]:
        """How many samples came, were missing, and were left out for each reason."""
        return self._watch.counts

    def found(self) -> dict[str, Any]:
        """What the responses stand on, as plain data for a record: rate, window, lines, hop."""
        lines = self.settings.lines
        return {
            "rate_hz": lines.rate_hz,
            "window": lines.window,
            "frequency_hz": lines.frequency_hz.tolist(),
            "bins": list(lines.bins),
            "quiet_bins": list(lines.quiet),
            "hop": self.settings.step,
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

    def drain_events(self) -> list[Event]:
        """Events since the last call: gaps and samples that were left out."""
        return self._watch.drain()

    def process(self, block: Block) -> Responses:
        """Responses at the hops of this Block, which follows the one before.

        Raises
        ------
        InputError
            If the rate is not that of the lines, a channel is missing, or samples come twice.
        """
        s = self.settings
        if abs(block.rate_hz / s.lines.rate_hz - 1) > 1e-9:
            raise InputError(
                f"the block has {block.rate_hz:g} samples per second, but the lines are for {s.lines.rate_hz:g}; "
                "make the lines for the block's rate"
            )
        if not len(block):
            raise InputError("the block is empty; leave it out")
        channels = block.data[[block.index(s.channel(role) or "") for role in self._roles]]
        schedule = block[s.schedule] if s.schedule else np.full(len(block), np.nan)
        if self._watch.starts(block):
            self._spectra.restart(block.start)
            self._centre.restart()
        rows = self._spectra.process(channels)
        self._watch.take(block, rows)
        centre_s = block.origin_s + (rows.sample - (s.lines.window - 1) / 2) / block.rate_hz
        moment = np.stack([centre_s, self._centre.at(schedule, rows.sample - block.start)])
        with np.errstate(all="ignore"):  # what is not whole may be anything, and comes out as NaN
            responses = self._responses(rows, moment, response_unit(block.channels, s))
        self._nothing = responses[0:0]
        return responses

    def finish(self) -> Responses | None:
        """What is held back at the end of the samples: nothing, every response has come; None without samples."""
        return self._nothing

    def snapshot(self) -> bytes:
        """Everything that the next sample's result depends on, exact; see `restore`."""
        return snapshots.pack({name: part.state() for name, part in self._parts.items()}, self.settings.identity)

    def restore(self, snapshot: bytes) -> None:
        """Go on from a snapshot of a Tracker with the same settings.

        Raises
        ------
        InputError
            If the snapshot is damaged or belongs to other settings; the Tracker is then as it was.
        """
        for name, state in snapshots.unpack(snapshot, self.settings.identity).items():
            self._parts[name].load(state)

    def _responses(self, rows: Rows, moment: Floats, unit: str) -> Responses:
        s, lines = self.settings, slice(0, len(self.settings.lines))
        spectrum = self._hann.combine(rows.spectrum, rows.sample) if self._hann else rows.spectrum
        signals: dict[Role, Complex] = dict(zip(self._roles, spectrum))
        reference = signals[s.method.reference][:, lines]
        pair = np.stack([signals["output"][:, lines], signals[s.method.denominator][:, lines]]) * reference.conj()
        powers = np.stack([power(reference), power(signals["output"][:, lines]), self._quiet_power(signals, pair)])
        excited = self._watch.excited(powers[0], rows.whole, _EXCITED)
        usable = rows.clean & excited.any(axis=1)
        place = int((rows.sample[0] + 1) % s.lines.window // s.step - 1) % self._places if usable.size else 0
        first = rows.sample - s.lines.window + 1
        moment = np.concatenate([moment, first[np.newaxis]])
        spectra = np.concatenate([pair, reference[np.newaxis]])
        moments = self._moments.update(place, spectra, powers, moment, usable)
        value, sigma, dof = self._estimate(pair, powers, moments)
        if s.average:
            first, moment = moments.first, moments.moment
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
        output, denominator = signals["output"][:, quiet], signals[self.settings.method.denominator][:, quiet]
        return self._quiet.power(pair[0] / pair[1], output, denominator) * power(
            signals[self.settings.method.reference][:, at]
        )

    def _estimate(self, pair: Complex, powers: Floats, moments: Moments) -> tuple[Complex, Floats, Floats]:
        """Value and sigma (rows, lines), and the degrees of freedom (rows,)."""
        s, f = self.settings, self.settings.lines.frequency_hz
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


def response_unit(channels: Sequence[Channel], settings: Settings) -> str:
    """Unit of the response where both signals have one; open loop, closed loop and sensitivity have none."""
    units = {channel.name: channel.unit for channel in channels}
    over, under = (units[name] for name in (settings.output, settings.channel(settings.method.denominator) or ""))
    return f"{over}/({under})" if over and under and settings.quantity == "plant" else ""
