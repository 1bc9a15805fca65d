"""Several recordings of one machine: whether they can be averaged, and whether their excitations differ."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np

from livebode.arrays import Complex
from livebode.core import RecordingError
from livebode.estimation import Settings
from livebode.preparation.aligned import AlignedLog
from livebode.preparation.plan import beginnings
from livebode.sources import Log

_PERIODS = 16  # that show the phases of an excitation
_SAME_PHASES = 0.95  # share of the amplitudes that add up at the best shift in time


def check_same(first: Log, of_first: Settings, log: Log, settings: Settings) -> None:
    """RecordingError if the rate, the units, the window or the lines differ from those of the first recording.

    Rates that an error of the clock explains are the same (`Lines.alike`).
    """
    used = [name for role in settings.roles if (name := settings.channel(role))]
    one, other = _properties(first, of_first, used), _properties(log, settings, used)
    if of_first.lines.alike(settings.lines):
        other["rate"] = one["rate"]
    for what, remedy in (
        ("rate", "correct the rate"), ("units", "convert it"), ("window", "specify lines.window"),
        ("lines", "specify the lines that all of them have"),
    ):  # fmt: skip
        if one[what] == other[what]:
            continue
        its, own = one[what], other[what]
        if what == "lines":
            its, own = (f"{len(s.lines)}{_only(s, t)}" for s, t in ((of_first, settings), (settings, of_first)))
        raise RecordingError(
            "recordings-differ",
            f"{log.path} differs from {first.path} in its {what}: {own} instead of {its}",
            f"{remedy}, or track it in a run of its own",
            path=str(log.path),
            other=str(first.path),
            what=what,
        )


def _properties(log: Log, settings: Settings, used: Sequence[str]) -> dict[str, str]:
    units = {channel.name: channel.unit or "no unit" for channel in log.channels if channel.name in used}
    return {
        "rate": f"{log.rate_hz:.9g} Hz",
        "units": ", ".join(f"{name} in {unit}" for name, unit in units.items()),
        "window": f"{settings.lines.window} samples",
        "lines": str(settings.lines.bins),
    }


def _only(settings: Settings, others: Settings) -> str:
    """The first lines that only these settings have."""
    lines = settings.lines
    own = [f"{k * lines.resolution_hz:g}" for k in lines.bins if k not in others.lines.bins]
    return f" (only there: {', '.join(own[:5])}{' …' if len(own) > 5 else ''} Hz)" if own else ""


def realisations(sources: Sequence[AlignedLog], settings: Settings) -> bool:
    """Whether the excitation has other phases in each recording, which no shift in time explains.

    Three lines or fewer can be shifted onto almost any phases: then it is False.
    """
    phases = [_phases(source, settings) for source in sources]
    return all(_differ(one, other, settings) for one, other in combinations(phases, 2))


def _phases(source: AlignedLog, settings: Settings) -> Complex:
    """The reference at the lines in the mean of the first periods."""
    window, lines = settings.lines.window, list(settings.lines.bins)
    name: Any = settings.channel(settings.method.reference)
    x = beginnings(source, [name], _PERIODS * window)[0]
    periods = x[: x.size // window * window].reshape(-1, window)
    whole = periods[np.isfinite(periods).all(axis=1)]
    return np.asarray(np.fft.rfft(whole.mean(axis=0))[lines]) if len(whole) else np.zeros(len(lines), np.complex128)


def _differ(one: Complex, other: Complex, settings: Settings) -> bool:
    product = other * one.conj()
    if len(product) <= 3 or not product.any():
        return False
    spectrum = np.zeros(settings.lines.window, dtype=np.complex128)
    spectrum[list(settings.lines.bins)] = product
    together = np.abs(np.fft.ifft(spectrum)).max() * settings.lines.window
    return bool(together < _SAME_PHASES * np.abs(product).sum())
