"""Evidence for roles that nobody named: what repeats, what follows it directly, and what responds later."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import cached_property

import numpy as np

from livebode.arrays import Complex, Floats
from livebode.core import Lines, LivebodeError
from livebode.dataclass import dataclass
from livebode.estimation import Settings
from livebode.excitation import recognise
from livebode.preparation._role_spectra import role_spectra
from livebode.preparation.roles import direct, lags, limit, mean_deg, slope

_EXACT = 1e-9  # share of the power by which the periods of a computed signal differ
_BANDS, _BINS_MIN = 32, 16  # of a signal that does not repeat: enough for a slope, and for a coherence
_POWER = 1e-4  # of the strongest band: below it is leakage
_APART, _FALLS = 0.5, -0.15  # exponents of frequency: of an input above a share of the excitation, of a response
_LATER_DEG = -10.0  # of a plant that only delays
_FALLS_ITSELF = -0.75  # an excitation does not fall as a response does
_CHANNELS_MAX = 24  # each is compared with each where none repeats


@dataclass(frozen=True, eq=False)
class ChannelAnswer:
    """Response of a channel to a reference, shape (lines,), in the order of the lines' frequency."""

    frequency_hz: Floats
    response: Complex
    direct: bool

    @cached_property
    def slope(self) -> float:
        """Its gain over frequency, as an exponent."""
        return slope(self.frequency_hz, self.response)


class RoleEvidence:
    """What the samples of channels tell about their roles.

    Parameters
    ----------
    samples
        Samples of each channel, shape (samples,), with NaN where some are missing.
    rate_hz
        Samples per second.
    """

    def __init__(self, samples: Mapping[str, Floats], rate_hz: float) -> None:
        self._samples, self._rate_hz = samples, rate_hz
        self._lines: dict[str, tuple[Lines | None, bool]] = {}
        self._answers: dict[str, dict[str, ChannelAnswer]] = {}

    def period(self, name: str) -> tuple[int, bool]:
        """Samples after which a channel repeats, 0 if it does not, and whether only rounding differs."""
        lines, exact = self._repeating(name)
        return (0 if lines is None else lines.window), exact

    def _repeating(self, name: str) -> tuple[Lines | None, bool]:
        if name not in self._lines:
            self._lines[name] = _repeating(self._samples[name], self._rate_hz)
        return self._lines[name]

    def answers(self, reference: str) -> Mapping[str, ChannelAnswer]:
        """The channels that respond to a reference, at its lines."""
        if reference not in self._answers:
            self._answers[reference] = self._responding(reference)
        return self._answers[reference]

    def _responding(self, reference: str) -> dict[str, ChannelAnswer]:
        found: dict[str, ChannelAnswer] = {}
        for name in self._samples:
            spectrum = None if name == reference else self._spectrum(reference, name)
            if spectrum is None:
                continue
            f, response, coherence, windows = spectrum
            responds = coherence > limit(len(f), windows)  # False for NaN, of a line without power
            if np.sum(responds) > 1:
                f, response = f[responds], response[responds]
                found[name] = ChannelAnswer(f, response, direct(response[f >= f[-1] / 2]))
        return found

    def _spectrum(self, reference: str, name: str) -> tuple[Floats, Complex, Floats, int] | None:
        """Frequencies, response and coherence of a channel to a reference, and how many windows were averaged."""
        x, y = self._samples[reference], self._samples[name]
        lines = self._repeating(reference)[0]
        with np.errstate(all="ignore"):  # a signal without power at a line has no response there
            if lines is None:
                return _in_bands(x, y, self._rate_hz)
            settings = Settings(lines=lines, input=reference, output=name, estimator="direct")
            spectra = role_spectra({"input": x, "output": y}, settings)
            if spectra is None:
                return None
            return spectra.frequency_hz, spectra.ratio("output", "input"), spectra.coherence("output"), spectra.windows

    def excitation(self, candidates: Collection[str]) -> str | None:
        """The candidate that one channel follows directly, and others respond to; None where none stands out."""
        exact = [name for name in candidates if self.period(name)[1]]
        others = [] if len(self._samples) > _CHANNELS_MAX else [n for n in candidates if not self._falls(n)]
        # A feedback reduces what follows directly at the lower lines: of two that follow each other, it is the other.
        return max(
            (name for name in exact or others if self._following(name)),
            key=lambda name: (len(self.answers(name)), max(self.answers(name)[f].slope for f in self._following(name))),
            default=None,
        )

    def _following(self, reference: str) -> list[str]:
        return [name for name, answer in self.answers(reference).items() if answer.direct]

    def _falls(self, name: str) -> bool:
        """Whether its own spectrum falls as that of a response."""
        starts, f = _bands(self._samples[name].size, self._rate_hz)
        if len(f) < 2:
            return True
        power = np.add.reduceat(np.abs(_whole_spectrum(self._samples[name])) ** 2, starts)[:-1] / np.diff(starts)
        some = power > _POWER * power.max()
        return bool(np.sum(some) < 2 or slope(f[some], np.sqrt(power[some])) < _FALLS_ITSELF)

    def input(self, reference: str | None, candidates: Collection[str]) -> str | None:
        """The candidate that follows the reference before all others do; without one, that the others respond to."""
        if reference is None:
            responses = {
                name: sum(answer.slope < _FALLS for answer in self.answers(name).values())
                for name in list(candidates)[:_CHANNELS_MAX]
            }
            best = max(responses, key=lambda name: responses[name], default=None)
            return best if best is not None and responses[best] else None
        answers = {name: answer for name, answer in self.answers(reference).items() if name in candidates}
        if not answers:
            return None
        steepest = max(answers, key=lambda name: answers[name].slope)
        level = answers[steepest].slope - _APART
        shares = [name for name, answer in answers.items() if answer.direct and answer.slope > level]
        if not shares and answers[steepest].slope < _FALLS:
            return None
        return min(shares, key=lambda name: abs(mean_deg(answers[name].response)), default=steepest)

    def outputs(self, reference: str, input_: str) -> dict[str, float]:
        """Share of the lines at which each channel lags the input as a velocity does; 0 of one that is only later."""
        answers = self.answers(reference)
        base = None if input_ == reference else answers.get(input_)
        found: dict[str, float] = {}
        for name, answer in answers.items():
            if name == input_:
                continue
            f, response = answer.frequency_hz, answer.response
            if base is not None:
                common = np.isin(f, base.frequency_hz)
                f, response = f[common], response[common] / base.response[np.isin(base.frequency_hz, f[common])]
            falls = len(f) > 1 and slope(f, response) < _FALLS
            if not falls and not (len(f) and mean_deg(response) < _LATER_DEG):
                continue
            angles = np.degrees(np.angle(response))
            # An inverted sensor turns every phase by 180°.
            shares = [np.mean([lags(a) for a in (angles + turn + 180) % 360 - 180]) for turn in (0, 180)]
            found[name] = float(max(shares)) if falls else 0.0
        return found


def _in_bands(x: Floats, y: Floats, rate_hz: float) -> tuple[Floats, Complex, Floats, int] | None:
    """Response and coherence of signals that do not repeat, over the bins of each band of the whole stretch."""
    starts, f = _bands(x.size, rate_hz)
    if len(f) < 2:
        return None
    of_input, of_output = _whole_spectrum(x), _whole_spectrum(y)
    cross = np.add.reduceat(of_output * of_input.conj(), starts)[:-1]
    of_x, of_y = (np.add.reduceat(np.abs(z) ** 2, starts)[:-1] for z in (of_input, of_output))
    density = of_x / np.diff(starts)
    coherence = np.where(density > _POWER * density.max(), np.abs(cross) ** 2 / (of_x * of_y), 0.0)
    return f, np.asarray(cross / of_x, np.complex128), coherence, int(np.diff(starts).min())


def _repeating(samples: Floats, rate_hz: float) -> tuple[Lines | None, bool]:
    try:
        found = recognise(samples, rate_hz)
    except LivebodeError:
        return None, False
    last = samples[found.stop - found.period : found.stop]
    before = samples[found.stop - 2 * found.period : found.stop - found.period]
    with np.errstate(invalid="ignore"):
        exact = len(last) == len(before) and np.nanvar(last - before) <= _EXACT * np.nanvar(last)
    return found.lines, bool(exact)


def _bands(samples: int, rate_hz: float) -> tuple[np.ndarray, Floats]:
    """First bins of bands at about equal ratios, and of the rest above them; and the middle of each band in Hz."""
    edges = np.geomspace(_BINS_MIN, max(_BINS_MIN, samples // 4), _BANDS + 1).astype(int)
    edges = edges[np.concatenate(([True], np.diff(edges) >= _BINS_MIN))]
    return edges, np.sqrt(edges[:-1] * edges[1:]) * rate_hz / max(samples, 1)


def _whole_spectrum(x: Floats) -> Complex:
    known = np.where(np.isfinite(x), x, np.nanmean(x))
    return np.asarray(np.fft.rfft((known - known.mean()) * np.hanning(x.size)))
