"""What a recording must have for its responses to mean anything, said in one sentence where it has not."""

from __future__ import annotations

import numpy as np

from livebode.estimation import Settings, Tracker
from livebode.nouns import Block, InputError

# Excitation this far below the strongest line is rounding or distortion, and no one's design.
_POWERLESS_DB = -80.0
_REPEATS = 0.5  # noise alone repeats by 1/m over m periods
_PERIODS_TO_JUDGE = 4


class ChannelCheck:
    """Whether each signal varies and is finite somewhere, over all blocks of a run."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self._unvaried = dict.fromkeys(names, np.nan)

    def take(self, block: Block) -> None:
        """Look at the signals that have been constant up to here."""
        for name, value in list(self._unvaried.items()):
            finite = block[name][np.isfinite(block[name])]
            if not finite.size:
                continue
            if np.isnan(value):
                self._unvaried[name] = value = finite[0]
            if np.any(finite != value):
                del self._unvaried[name]

    def finish(self) -> None:
        """InputError where a signal held no number, or always the same one."""
        for name, value in self._unvaried.items():
            if np.isnan(value):
                raise InputError(
                    f"channel {name!r} is empty: none of its samples is a finite number; choose another one"
                )
            raise InputError(f"channel {name!r} is constant at {value:g}; choose one that carries the signal")


def check_length(samples: int | None, settings: Settings) -> None:
    """InputError where the recording is known to be shorter than the window."""
    window = settings.lines.window
    if samples is not None and samples < window:
        raise InputError(
            f"the recording has {samples} samples, less than the window of {window}; take a shorter window or more data"
        )


def check_excitation(tracker: Tracker) -> None:
    """InputError where a line has no excitation, or the excitation does not repeat from window to window.

    The input of a direct estimate carries the machine's motion and noise and is not asked to repeat; sigma tells.
    """
    settings = tracker.settings
    name, f = settings.channel(settings.method.reference), settings.lines.frequency_hz
    power = tracker.excitation_power()
    if np.isnan(power).all():
        return
    with np.errstate(divide="ignore"):
        level_db = 10 * np.log10(power / power.max()) if power.max() > 0 else np.full(power.shape, -np.inf)
    if np.any(level_db < _POWERLESS_DB):
        worst = int(np.argmin(level_db))
        raise InputError(
            f"{name!r} has no power at {f[worst]:g} Hz ({level_db[worst]:.0f} dB against its strongest line); "
            "leave out that line, or take --lines auto"
        )
    if settings.method.reference != "excitation":
        return
    repeats = tracker.repeatability()
    if tracker.counts["samples"] >= _PERIODS_TO_JUDGE * settings.lines.window and np.any(repeats < _REPEATS):
        worst = int(np.nanargmin(repeats))
        raise InputError(
            f"{name!r} does not repeat every {settings.lines.window} samples at {f[worst]:g} Hz "
            f"({100 * repeats[worst]:.0f} % of its power does); leave out that line, or take --window auto"
        )
