"""Conditions that a recording must meet for valid responses; each one that is not met gives one error message."""

from __future__ import annotations

from typing import Any

import numpy as np

from livebode.core import ANY_EXCITATION, NOT_WHOLE, Block, SignalError, Spectra, Stage, StatefulBase, rms
from livebode.estimation import Follower

# Rounding of a DFT gives 1e-30 of a signal's power at an empty line.
POWERLESS_SHARE = 1e-20
# Power this far below the strongest line is rounding or distortion, not excitation.
_POWERLESS_DB = -80.0
_REPEATS = 0.5  # noise alone repeats by 1/m over m periods
_PERIODS_TO_JUDGE = 4
_LISTED_MAX = 20
_TOGETHER = 16  # Blocks, or spectra in one


class ChannelCheck(StatefulBase):
    """Statistics over all blocks of a run: whether each signal varies and is finite, and the power of the reference."""

    _stage = Stage("channel-check", 1)
    _STATE = ("_unvaried", "_moments")

    def __init__(self, names: tuple[str, ...], reference: str) -> None:
        self._unvaried = dict.fromkeys(names, np.nan)
        self._reference = reference
        self._moments = np.zeros(3)
        self._waiting: list[Spectra] = []  # several cost little more than one

    def take(self, block: Block) -> None:
        """Check the signals that were constant so far."""
        if isinstance(block, Spectra):
            if self._waiting and self._waiting[0].layout is not block.layout:
                self._take_waiting()
            self._waiting.append(block)
            if max(len(self._waiting), len(block)) >= _TOGETHER:
                self._take_waiting()
            return
        x = np.ascontiguousarray(block[self._reference])
        squares = np.dot(x, x)
        if not np.isfinite(squares):  # hardly ever
            x = x[np.isfinite(x)]
            squares = np.dot(x, x)
        self._moments += x.size, x.sum(), squares
        for name, value in list(self._unvaried.items()):
            finite = block[name][np.isfinite(block[name])]
            if not finite.size:
                continue
            if np.isnan(value):
                self._unvaried[name] = value = finite[0]
            if np.any(finite != value):
                del self._unvaried[name]

    def _take_waiting(self) -> None:
        """The same for spectra, where a constant signal has no power at the lines."""
        blocks, self._waiting = self._waiting, []
        if not blocks:
            return
        layout, examined = blocks[0].layout, {self._reference, *self._unvaried}
        at = [row for row, signal in enumerate(layout.signals) if signal.name in examined]
        state = np.concatenate([block.state for block in blocks])
        sums = np.concatenate([block.sums for block in blocks], axis=1)
        for row, level in ((row, rms(sums[row], layout)) for row in at):
            signal = layout.signals[row]
            level = level[(state & NOT_WHOLE == 0) & np.isfinite(level)]
            if signal.name == self._reference:
                self._moments += level.size, 0.0, np.dot(level, level)
            if signal.name in self._unvaried and level.size:
                self._unvaried[signal.name] = 0.0
                if np.any(level > 0):
                    del self._unvaried[signal.name]

    def _state(self) -> dict[str, Any]:
        self._take_waiting()
        return super()._state()

    def _load(self, state: dict[str, Any]) -> None:
        self._waiting.clear()
        super()._load(state)

    @property
    def variance(self) -> float:
        """Variance of the reference over all its finite samples."""
        self._take_waiting()
        count, total, squares = self._moments
        return float(max(squares / count - (total / count) ** 2, 0.0)) if count else 0.0

    def finish(self) -> None:
        """SignalError if a signal had no finite sample, or a constant value."""
        self._take_waiting()
        for name, value in self._unvaried.items():
            if np.isnan(value):
                raise SignalError(
                    "channel-empty",
                    f"channel {name!r} is empty: none of its samples is a finite number",
                    "choose another one",
                    channel=name,
                )
            raise SignalError(
                "channel-constant",
                f"channel {name!r} is constant at {value:g}",
                "choose the channel with the signal",
                channel=name,
                value=float(value),
            )


def check_length(samples: int | None, window: int, hop: int | None = None) -> None:
    """SignalError if the recording is shorter than the window or the hop: it would have no response."""
    for name, size in (("window", window), ("hop", hop or 0)):
        if samples is not None and samples < size:
            raise SignalError(
                "too-short",
                f"the recording has {samples} samples, less than the {name} of {size}",
                f"choose a shorter {name}, or record more",
                samples=samples,
                **{name: size},
            )


def check_excitation(tracker: Follower, variance: float) -> None:
    """SignalError if a line has no excitation, or the excitation does not repeat from window to window.

    `variance` is that of the reference over the whole recording.

    The input of a direct estimate contains the machine's motion and noise and need not repeat; sigma shows their
    effect.
    """
    settings = tracker.settings
    name, f = settings.channel(settings.method.reference), settings.lines.frequency_hz
    power = tracker.excitation_power()
    if np.isnan(power).all():
        return
    if 2 * power.max() <= POWERLESS_SHARE * variance * settings.lines.window**2:
        raise SignalError(
            "line-not-excited",
            f"{name!r} has no power at {f[0]:g} Hz or any other of these lines",
            "set lines.frequencies to 'auto', or check the recording with `livebode inspect`",
            channel=name,
            frequency_hz=float(f[0]),
        )
    with np.errstate(divide="ignore"):
        level_db = 10 * np.log10(power / power.max()) if power.max() > 0 else np.full(power.shape, -np.inf)
    if np.any(level_db < _POWERLESS_DB):
        worst = int(np.argmin(level_db))
        raise SignalError(
            "line-not-excited",
            f"{name!r} has no power at {f[worst]:g} Hz ({-level_db[worst]:.0f} dB below its strongest line)",
            "remove that line, or set lines.frequencies to 'auto'",
            channel=name,
            frequency_hz=float(f[worst]),
        )
    if settings.method.reference != "excitation" or not settings.periodic:
        return
    repeats = tracker.repeatability()
    if tracker.counts["samples"] >= _PERIODS_TO_JUDGE * settings.lines.window and np.any(repeats < _REPEATS):
        worst = int(np.nanargmin(repeats))
        raise SignalError(
            "not-periodic",
            f"{name!r} does not repeat every {settings.lines.window} samples at {f[worst]:g} Hz "
            f"({100 * repeats[worst]:.0f} % of its power does)",
            f"remove that line, or set lines.window to 'auto'; {ANY_EXCITATION}",
            channel=name,
            frequency_hz=float(f[worst]),
            window=settings.lines.window,
            key="lines.window",
            repeating=float(repeats[worst]),
        )


_SPOILS = {
    "gaps": "gaps", "non-finite": "samples that are not finite", "implausible": "implausibly large samples",
    "spike": "spikes",
}  # fmt: skip


def check_some_valid(responses: int, valid: int, tracker: Follower) -> None:
    """SignalError with the reason if no response of the run is valid."""
    counts, window = tracker.counts, tracker.settings.lines.window
    if responses and not valid and "spectra" in counts:
        raise SignalError(
            "no-valid-response",
            f"none of {responses} responses is valid: of {counts['spectra']} windows {counts['not-whole']} are "
            f"incomplete and {counts['spike']} contain a spike",
            "check the drive's samples, or configure a shorter window in the drive",
            reason="windows-not-whole",
            responses=responses,
            window=window,
        )
    if valid or (not responses and tracker.settings.periodic):
        return
    if judged := tracker.found().get("judged", {}).get("invalid_lines_hz"):
        lines = "; ".join(f"{kind} at {', '.join(f'{f:g}' for f in at)} Hz" for kind, at in judged.items())
        raise SignalError(
            "no-valid-response",
            f"none of {responses} responses is valid, and lines are invalid because a disturbance repeats with the "
            f"excitation: {lines}",
            "see events.jsonl for the remedy at each",
            reason="lines-invalid",
            responses=responses,
            window=window,
        )
    if at := tracker.found().get("judged", {}).get("not_repeating_hz"):
        name = tracker.settings.channel(tracker.settings.method.reference)
        raise SignalError(
            "no-valid-response",
            f"none of {responses} responses is valid: {name!r} does not repeat every {window} samples at "
            f"{', '.join(f'{f:g}' for f in at[:_LISTED_MAX])}{' …' * (len(at) > _LISTED_MAX)} Hz",
            f"set lines.window to its period; {ANY_EXCITATION}",
            reason="not-periodic",
            responses=responses,
            window=window,
        )
    spoiled = [f"{count} {words}" for kind, words in _SPOILS.items() if (count := counts.get(kind, 0))]
    if spoiled:
        raise SignalError(
            "no-valid-response",
            f"none of {responses} responses is valid: no stretch of {window} samples has excitation and is free of the "
            f"{', '.join(spoiled)}",
            "choose a shorter window, or check the recording with `livebode inspect`",
            reason="samples-spoiled",
            responses=responses,
            window=window,
        )
    if responses and tracker.settings.estimator == "lpm":
        name, driven = tracker.settings.channel(tracker.settings.method.reference), tracker.settings.channel("input")
        follows = "" if driven in (None, name) else f"; or {driven!r} does not follow it"
        raise SignalError(
            "no-valid-response",
            f"none of {responses} responses is valid: the power of {name!r} is at single tones, or as smooth over "
            f"frequency as a transient, from which 'lpm' cannot tell it{follows}",
            "check the roles, or record an excitation that repeats, or noise or a chirp that has power in a whole band",
            reason="not-separable",
            responses=responses,
            window=window,
        )
    raise SignalError(
        "no-valid-response",
        f"none of {responses} responses is valid, although no sample is missing or excluded: no window of {window} "
        "samples has excitation at its lines",
        "choose other lines, or check the recording with `livebode inspect`",
        reason="no-excitation",
        responses=responses,
        window=window,
    )
