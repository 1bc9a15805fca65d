"""Evidence for the roles of signals: spectra over the windows of the beginning, and the words for quantities."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from livebode.arrays import Complex, Floats
from livebode.core import Channel, QuantityKind
from livebode.dataclass import dataclass
from livebode.estimation import Role, Settings
from livebode.preparation.checks import POWERLESS_SHARE

DRIVING: tuple[QuantityKind, ...] = ("torque", "current", "force")
NAMED_INPUT = re.compile(r"^(u|i_?q|torque|current|force|motor|input|effort|drehmoment|strom|kraft)", re.IGNORECASE)
NAMED_OUTPUT = re.compile(
    r"^(y|vel\w*|speed|omega|theta|angle|phi|pos\w*|acc\w*|gyro\w*|output|drehzahl)", re.IGNORECASE
)
_NAMED_ACCELERATION = re.compile(r"acc(?!e[ps]s?|u)|beschl|adxl", re.IGNORECASE)


class ChannelQuantities:
    """What drives a machine and what is its motion, among some channels.

    Parameters
    ----------
    channels
        Channels with their kinds; a name that is not among them, or whose kind is "other", is judged by itself.

    Examples
    --------
    >>> found = ChannelQuantities([Channel("F", "N"), Channel("sensor 2", "g")])
    >>> found.drives("F"), found.drives("-torque"), found.accelerates("sensor 2"), found.accelerates("Accel_x")
    (True, True, True, True)
    """

    def __init__(self, channels: Iterable[Channel] = ()) -> None:
        self._kinds: Mapping[str, QuantityKind] = {channel.name: channel.kind for channel in channels}

    def drives(self, name: str) -> bool:
        """Whether it is a torque, a current or a force."""
        kind = self._kinds.get(name, "other")
        return kind in DRIVING or (kind == "other" and bool(NAMED_INPUT.search(_unsigned(name))))

    def moves(self, name: str) -> bool:
        """Whether it is a position, a velocity or an acceleration."""
        kind = self._kinds.get(name, "other")
        if kind == "other":
            return bool(NAMED_OUTPUT.search(_unsigned(name)) or _NAMED_ACCELERATION.search(name))
        return kind not in DRIVING

    def accelerates(self, name: str) -> bool:
        """Whether it is an acceleration."""
        kind = self._kinds.get(name, "other")
        return kind == "acceleration" or (kind == "other" and bool(_NAMED_ACCELERATION.search(name)))


def _unsigned(name: str) -> str:
    return name.lstrip("+-( ")


# A window is used if its reference has this share of the strongest window's power: the excitation may begin late.
_RUNS = 1e-3


@dataclass(frozen=True, eq=False)
class RoleSpectra:
    """Line spectra of consecutive complete windows, and properties that do not depend on the lines.

    Attributes
    ----------
    settings
        Names, lines and loop.
    spectra
        Spectra of each role, with the loop's advance, shape (windows, lines).
    neighbours
        True for windows that are followed by the next one of the recording, shape (windows − 1,).
    repeating
        Share of the reference's variance (without a linear trend) that repeats a window later.
    exact
        Whether the reference repeats to twelve digits: it is then a command, not a measurement.
    """

    settings: Settings
    spectra: Mapping[Role, Complex]
    neighbours: NDArray[np.bool_]
    repeating: float
    exact: bool

    @property
    def windows(self) -> int:
        return int(self.neighbours.size) + 1

    @property
    def frequency_hz(self) -> Floats:
        return self.settings.lines.frequency_hz

    def ratio(self, numerator: Role, denominator: Role) -> Complex:
        """Numerator over denominator, both correlated with the reference, shape (lines,)."""
        reference = self.spectra[self.settings.method.reference].conj()
        over, under = (np.sum(self.spectra[role] * reference, axis=0) for role in (numerator, denominator))
        return np.asarray(over / under)

    def coherence(self, role: Role) -> Floats:
        """Coherence of a signal with the reference over the windows, shape (lines,); about 1/windows if unrelated."""
        x, reference = self.spectra[role], self.spectra[self.settings.method.reference]
        powers = np.sum(np.abs(x) ** 2, axis=0) * np.sum(np.abs(reference) ** 2, axis=0)
        return np.asarray(np.abs(np.sum(x * reference.conj(), axis=0)) ** 2 / powers)

    def returns(self, role: Role) -> tuple[Floats, int]:
        """|Σ X_m·conj(X_m+1)|²/(Σ|X_m|²·Σ|X_m+1|²) over neighbouring windows, shape (lines,), and their number.

        Neighbours instead of the average of all: a phase slip affects only one pair.
        """
        x = self.spectra[role]
        first, second = x[:-1][self.neighbours], x[1:][self.neighbours]
        powers = np.sum(np.abs(first) ** 2, axis=0) * np.sum(np.abs(second) ** 2, axis=0)
        return np.abs(np.sum(first * second.conj(), axis=0)) ** 2 / powers, int(self.neighbours.sum())


def role_spectra(signals: Mapping[Role, Floats], settings: Settings) -> RoleSpectra | None:
    """Spectra of the beginning of a recording, NaN for missing samples; None for less than two usable windows.

    From each window the ramp to the next one is subtracted: slow motion would leak into the lines.
    """
    n = settings.lines.window
    count = (min(x.size for x in signals.values()) - 1) // n
    if count < 2:
        return None
    cut = {role: _without_ramp(np.where(np.isfinite(x), x, np.nan), n, count) for role, x in signals.items()}
    bins = np.asarray(settings.lines.bins)
    whole = np.all([np.isfinite(windows).all(axis=1) for windows in cut.values()], axis=0)
    z = settings.lines.z
    with np.errstate(invalid="ignore"):
        found = {
            role: np.fft.rfft(windows, axis=1)[:, bins] * z ** settings.loop.advance_ticks(role)
            for role, windows in cut.items()
        }
    reference = settings.method.reference
    power = np.sum(np.abs(np.where(whole[:, np.newaxis], found[reference], 0.0)) ** 2, axis=1)
    used = np.flatnonzero(power > _RUNS * power.max())
    if used.size < 2:
        return None
    spread = _spread(signals[reference])
    if 2 * power.max() <= POWERLESS_SHARE * spread * n**2:
        return None
    neighbours = np.diff(used) == 1
    windows = cut[reference][used]
    repeating, exact = _repeating(windows[:-1][neighbours], windows[1:][neighbours], spread)
    return RoleSpectra(settings, {role: x[used] for role, x in found.items()}, neighbours, repeating, exact)


def _without_ramp(x: Floats, n: int, count: int) -> Floats:
    windows = x[: count * n].reshape(count, n)
    ramp = (x[n : count * n + 1 : n] - windows[:, 0]) / n
    level = windows - ramp[:, np.newaxis] * np.arange(n)
    return np.asarray(level - level.mean(axis=1, keepdims=True))


def _spread(x: Floats) -> float:
    """Variance about a straight line."""
    known = np.flatnonzero(np.isfinite(x))
    at = known - known.mean()
    rest = x[known] - x[known].mean()
    return float(np.mean((rest - at * (np.dot(at, rest) / np.dot(at, at))) ** 2))


def _repeating(first: Floats, second: Floats, spread: float) -> tuple[float, bool]:
    if not first.size or not spread > 0:
        return 1.0, False
    change = float(np.mean((second - first) ** 2))
    return float(np.mean(first * second)) / spread, change <= 1e-12 * spread
