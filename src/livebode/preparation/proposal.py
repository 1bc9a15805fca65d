"""Proposals for the configuration of a recording: which channel has which role, and why."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from livebode.arrays import Floats
from livebode.core import LivebodeError
from livebode.excitation import recognise
from livebode.preparation._role_spectra import DRIVING, NAMED_INPUT, NAMED_OUTPUT
from livebode.preparation.contents import ChannelSummary, contents_of
from livebode.preparation.plan import beginnings
from livebode.sources import Log

_SEARCHED = 1 << 18  # samples: enough for some periods of an excitation
_CERTAIN = 3  # score of a proposal
_EXACT = 1e-9  # share of the power by which the periods of a computed signal differ
_SLOW = 3.0  # a position that travels: its means over pieces scatter this many times more than its samples in them
_PIECES = 50
_EXCITATION = re.compile(r"^(w|exc\w*|dither|inject\w*|multisine|prbs|chirp|sweep)$")
_COMMAND = re.compile(r"(ref|set|target|cmd|command|soll|demand|desired)")
_SCHEDULE = re.compile(r"^(x|pos\w*|stroke|travel|cart\w*)$")


@dataclass(frozen=True)
class Guess:
    """A channel for a role, and the reason; None where nothing suggests one."""

    channel: str | None
    reason: str


class Proposals:
    """Proposals for one recording.

    Parameters
    ----------
    log
        The recording.
    """

    def __init__(self, log: Log) -> None:
        self.log = log
        names = [channel.name for channel in log.channels]
        self.channels: list[ChannelSummary] = contents_of(log, names).channels

    @cached_property
    def _samples(self) -> dict[str, Floats]:
        names = [channel.name for channel in self.channels]
        return dict(zip(names, beginnings(self.log, names, _SEARCHED)))

    @cached_property
    def _candidates(self) -> list[ChannelSummary]:
        """Channels that vary and are not a clock or a counter."""
        return [
            channel
            for channel in self.channels
            if channel.minimum < channel.maximum and not _counts(self._samples[channel.name])
        ]

    def of(self, role: str, taken: Sequence[str]) -> Guess:
        """A channel for excitation, input, output or schedule that has no other role yet."""
        judged = {
            "excitation": self._as_excitation,
            "input": _as_input,
            "output": _as_output,
            "schedule": self._as_schedule,
        }
        return self._best(taken, judged[role])

    def _best(self, taken: Sequence[str], judged: Callable[[ChannelSummary], tuple[int, str]]) -> Guess:
        found = [(*judged(channel), channel.name) for channel in self._candidates if channel.name not in taken]
        score, reason, name = max(found, key=lambda each: each[0], default=(0, "", ""))
        return Guess(name, reason) if score >= _CERTAIN else Guess(None, "no channel suggests itself")

    def _as_excitation(self, channel: ChannelSummary) -> tuple[int, str]:
        score, reason = 0, ""
        if _EXCITATION.search(channel.name.lower()):
            score, reason = 4, "by its name"
        score += bool(_COMMAND.search(channel.name.lower())) + (channel.kind in DRIVING)
        score -= 2 * (channel.kind == "position")
        if score + 3 < _CERTAIN:
            return 0, ""
        period, exact = self._period(channel.name)
        if period:
            score += 3 if exact else 1
            reason = f"repeats every {period} samples ({period / self.log.rate_hz:.4g} s)"
        return score, reason

    def _period(self, name: str) -> tuple[int, bool]:
        """The period of a channel, 0 if it does not repeat, and whether its last two are equal but for rounding."""
        samples = self._samples[name]
        try:
            found = recognise(samples, self.log.rate_hz)
        except LivebodeError:
            return 0, False
        last = samples[found.stop - found.period : found.stop]
        before = samples[found.stop - 2 * found.period : found.stop - found.period]
        with np.errstate(invalid="ignore"):
            exact = len(last) == len(before) and np.nanvar(last - before) <= _EXACT * np.nanvar(last)
        return found.period, bool(exact)

    def _as_schedule(self, channel: ChannelSummary) -> tuple[int, str]:
        name = channel.name.lower()
        score = 2 * (channel.kind == "position") + 2 * bool(_SCHEDULE.search(name)) - 2 * bool(_COMMAND.search(name))
        if score < _CERTAIN - 1 or not _travels(self._samples[channel.name]):
            return 0, ""
        return score + 1, f"travels from {channel.minimum:.4g} to {channel.maximum:.4g} {channel.unit}".rstrip()


def _as_input(channel: ChannelSummary) -> tuple[int, str]:
    name = channel.name.lower()
    named = bool(NAMED_INPUT.search(name))
    score = 5 * (channel.kind in DRIVING) + 2 * named - 2 * bool(_COMMAND.search(name))  # a reference is an input too
    return score + named * (channel.kind == "other"), _by(channel, channel.kind in DRIVING)


def _as_output(channel: ChannelSummary) -> tuple[int, str]:
    name = channel.name.lower()
    named = bool(NAMED_OUTPUT.search(name))
    size = {"velocity": 5, "position": 2, "acceleration": 2}.get(channel.kind, 0)
    score = size + 2 * named - 6 * bool(_COMMAND.search(name)) + named * (channel.kind == "other")
    return score, _by(channel, size > 0)


def _by(channel: ChannelSummary, by_kind: bool) -> str:
    return f"a {channel.kind} in {channel.unit}" if by_kind else "by its name"


def _counts(samples: Floats) -> bool:
    """Whether it grows by the same step, as a clock or a counter does."""
    steps = np.diff(samples[np.isfinite(samples)])
    return bool(steps.size and steps[0] > 0 and np.allclose(steps, steps[0], rtol=1e-3))


def _travels(samples: Floats) -> bool:
    """Whether its slow part is much larger than what the excitation moves."""
    size = len(samples) // _PIECES
    if size < 2:
        return False
    pieces = samples[: size * _PIECES].reshape(_PIECES, size)
    within = float(np.nanmedian(np.nanstd(pieces, axis=1)))
    return bool(np.nanstd(np.nanmean(pieces, axis=1)) > _SLOW * within)
