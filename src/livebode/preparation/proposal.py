"""Proposals for the configuration of a recording: which channel has which role, and why."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import cached_property

import numpy as np

from livebode.arrays import Floats
from livebode.dataclass import dataclass
from livebode.language import Message
from livebode.preparation._role_evidence import RoleEvidence
from livebode.preparation._role_spectra import DRIVING, NAMED_INPUT, NAMED_OUTPUT, ChannelQuantities
from livebode.preparation.contents import ChannelSummary, contents_of
from livebode.preparation.plan import beginnings
from livebode.sources import Log

_SEARCHED = 1 << 18  # samples: enough for some periods of an excitation
_CERTAIN = 3  # score of a proposal
_UNRELATED = -8  # outweighs a name and a unit
_SLOW = 3.0  # a position that travels: its means over pieces scatter this many times more than its samples in them
_PIECES = 50
_COUNTING = 0.99  # of the steps of a counter, which wraps at the others
_LAGS_ALIKE = 0.2  # of the lines: two responses that lag the input so alike cannot be told apart
_EXCITATION = re.compile(r"^(w|exc\w*|dither|inject\w*|multisine|prbs|chirp|sweep|anregung)$")
_COMMAND = re.compile(r"(ref|set|target|cmd|command|soll|demand|desired)")
_SCHEDULE = re.compile(r"^(x|pos\w*|stroke|travel|cart\w*)$")


@dataclass(frozen=True)
class Guess:
    """A channel for a role.

    Attributes
    ----------
    channel
        None where nothing suggests one.
    reason
        Why, in a few words.
    others
        Channels that suit as well.
    """

    channel: str | None
    reason: Message
    others: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Score:
    """Points of a channel by its name and unit, and by its samples; and the reason."""

    named: int
    measured: float
    reason: Message

    @property
    def points(self) -> float:
        return self.named + self.measured

    @property
    def rank(self) -> tuple[bool, int, float]:
        """What a certain name or unit decides is not left to the samples, unless they contradict it."""
        return self.points >= _CERTAIN, self.named if self.named >= _CERTAIN else 0, self.points


_NO_POINTS = _Score(0, 0.0, Message("no channel suggests itself"))


class Proposals:
    """Proposals for the roles of the channels of one recording, by names, units and samples.

    Parameters
    ----------
    log
        The recording. Its beginning is read, 262144 samples.

    Attributes
    ----------
    channels
        The channels without time and counters.
    """

    def __init__(self, log: Log) -> None:
        self.log = log
        names = list(next(log.blocks()).names)  # without the time
        samples = dict(zip(names, beginnings(log, names, _SEARCHED)))
        self._samples = {name: x for name, x in samples.items() if not _counts(x)}
        self.channels: list[ChannelSummary] = contents_of(log, list(self._samples)).channels if self._samples else []

    @cached_property
    def _candidates(self) -> dict[str, ChannelSummary]:
        """Channels that vary."""
        return {channel.name: channel for channel in self.channels if channel.minimum < channel.maximum}

    @cached_property
    def _quantities(self) -> ChannelQuantities:
        return ChannelQuantities(self.log.channels)

    @cached_property
    def _evidence(self) -> RoleEvidence:
        return RoleEvidence({name: self._samples[name] for name in self._candidates}, self.log.rate_hz)

    def roles(self, given: Mapping[str, str | None] | None = None) -> dict[str, Guess]:
        """Proposals for excitation, input, output and schedule.

        Parameters
        ----------
        given
            Channels of roles that are known, None for a role without a channel; the others follow from them.

        Returns
        -------
        dict
            For each role its channel, the reason as a message, and the channels that suit as well.

        Examples
        --------
        >>> import tempfile
        >>> from pathlib import Path
        >>> from livebode.interface import write_examples
        >>> from livebode.sources import open_log
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     _ = write_examples(["standstill"], Path(folder))
        ...     roles = Proposals(open_log(Path(folder) / "standstill.csv")).roles()
        >>> [f"{role}: {guess.channel}" for role, guess in roles.items()]
        ['excitation: w', 'input: u', 'output: velocity', 'schedule: None']
        """
        roles = {role: Guess(name, Message("as specified")) for role, name in (given or {}).items()}
        scored = {
            "excitation": self._excitations,
            "input": self._inputs,
            "output": self._outputs,
            "schedule": self._schedules,
        }
        for role, scores_of in scored.items():
            if role not in roles:
                taken = {guess.channel for guess in roles.values()}
                free = {name: channel for name, channel in self._candidates.items() if name not in taken}
                roles[role] = _best(scores_of(free, roles))
        return {role: roles[role] for role in scored}

    def _recorded(self, name: str | None) -> str | None:
        """The channel itself; None for an expression, and for what does not vary."""
        return name if name in self._candidates else None

    def _excitations(self, free: Mapping[str, ChannelSummary], _: Mapping[str, Guess]) -> dict[str, _Score]:
        scores = {name: score for name, channel in free.items() if (score := self._named_excitation(channel)).named > 0}
        if any(score.points >= _CERTAIN for score in scores.values()):
            return scores
        name = self._evidence.excitation([name for name in free if not self._quantities.moves(name)])
        if name is None:
            return scores
        period, exact = self._evidence.period(name)
        reason = self._repeats(period) if exact else Message("other channels follow it")
        return {name: _Score(0, _CERTAIN, reason)}

    def _named_excitation(self, channel: ChannelSummary) -> _Score:
        name = channel.name.lower()
        named = 4 * bool(_EXCITATION.search(name)) + bool(_COMMAND.search(name)) + (channel.kind in DRIVING)
        named -= 2 * (channel.kind == "position")
        if named <= 0:
            return _NO_POINTS
        period, exact = self._evidence.period(channel.name)
        reason = self._repeats(period) if period else Message("by its name")
        return _Score(named, 3 if exact else bool(period), reason)

    def _repeats(self, period: int) -> Message:
        return Message(
            "repeats every {samples} samples ({seconds:.4g} s)", samples=period, seconds=period / self.log.rate_hz
        )

    def _inputs(self, free: Mapping[str, ChannelSummary], roles: Mapping[str, Guess]) -> dict[str, _Score]:
        reference = self._recorded(roles["excitation"].channel)
        follows = Message("the other channels respond to it")
        if reference is not None:
            follows = Message("follows {excitation} directly", excitation=reference)
        free = {name: channel for name, channel in free.items() if not self._quantities.moves(name)}
        name = self._evidence.input(reference, free)
        return self._scores(free, reference, {} if name is None else {name: (4.0, follows)}, _as_input)

    def _outputs(self, free: Mapping[str, ChannelSummary], roles: Mapping[str, Guess]) -> dict[str, _Score]:
        input_ = self._recorded(roles["input"].channel)
        reference = self._recorded(roles["excitation"].channel) or input_
        shares = {} if reference is None else self._evidence.outputs(reference, input_ or reference)
        responds = Message("responds to {reference}", reference=str(reference))
        measured = {name: (_CERTAIN + share / _LAGS_ALIKE, responds) for name, share in shares.items()}
        free = {name: channel for name, channel in free.items() if not self._quantities.drives(name)}
        return self._scores(free, reference, measured, _as_output)

    def _scores(
        self,
        free: Mapping[str, ChannelSummary],
        reference: str | None,
        measured: Mapping[str, tuple[float, Message]],
        named: Callable[[ChannelSummary], _Score],
    ) -> dict[str, _Score]:
        """Points by name and unit with those by the samples; where nothing answers the reference, names alone."""
        answers = {} if reference is None else self._evidence.answers(reference)
        scores: dict[str, _Score] = {}
        for name, channel in free.items():
            own = named(channel)
            points, reason = measured.get(name, (0.0, own.reason))
            if answers and name not in answers:
                points = _UNRELATED
            scores[name] = _Score(own.named, points, own.reason if own.named >= _CERTAIN else reason)
        return scores

    def _schedules(self, free: Mapping[str, ChannelSummary], _: Mapping[str, Guess]) -> dict[str, _Score]:
        return {name: self._as_schedule(channel) for name, channel in free.items()}

    def _as_schedule(self, channel: ChannelSummary) -> _Score:
        name = channel.name.lower()
        named = 2 * (channel.kind == "position") + 2 * bool(_SCHEDULE.search(name)) - 2 * bool(_COMMAND.search(name))
        if named < _CERTAIN - 1 or not _travels(self._samples[channel.name]):
            return _NO_POINTS
        ends = {"low": channel.minimum, "high": channel.maximum}
        reason = Message("travels from {low:.4g} to {high:.4g}", **ends)
        if channel.unit:
            reason = Message("travels from {low:.4g} to {high:.4g} {unit}", unit=channel.unit, **ends)
        return _Score(named, 1.0, reason)


def _best(scores: Mapping[str, _Score]) -> Guess:
    best = max(scores, key=lambda name: scores[name].rank, default=None)
    if best is None or scores[best].points < _CERTAIN:
        return Guess(None, _NO_POINTS.reason)
    top = scores[best]
    # What names and units do not distinguish, samples alone do not decide; without either, they do if they differ.
    least = _CERTAIN if top.named else top.points - 1
    others = [
        name for name, score in scores.items() if name != best and score.named >= top.named and score.points >= least
    ]
    return Guess(best, top.reason, tuple(others))


def _as_input(channel: ChannelSummary) -> _Score:
    name = channel.name.lower()
    named = bool(NAMED_INPUT.search(name))
    score = 5 * (channel.kind in DRIVING) + 2 * named - 2 * bool(_COMMAND.search(name))  # a reference is an input too
    return _Score(score + named * (channel.kind == "other"), 0.0, _by(channel, channel.kind in DRIVING))


def _as_output(channel: ChannelSummary) -> _Score:
    name = channel.name.lower()
    named = bool(NAMED_OUTPUT.search(name))
    size = {"velocity": 5, "position": 2, "acceleration": 2}.get(channel.kind, 0)
    score = size + 2 * named - 6 * bool(_COMMAND.search(name)) + named * (channel.kind == "other")
    return _Score(score, 0.0, _by(channel, size > 0))


def _by(channel: ChannelSummary, by_kind: bool) -> Message:
    unit = channel.unit
    reasons = {
        "torque": Message("a torque in {unit}", unit=unit),
        "force": Message("a force in {unit}", unit=unit),
        "current": Message("a current in {unit}", unit=unit),
        "velocity": Message("a velocity in {unit}", unit=unit),
        "position": Message("a position in {unit}", unit=unit),
        "acceleration": Message("an acceleration in {unit}", unit=unit),
    }
    return reasons[channel.kind] if by_kind else Message("by its name")


def _counts(samples: Floats) -> bool:
    """Whether it grows by the same step, as a clock or a counter does, which may wrap."""
    known = samples[np.isfinite(samples)]
    steps = np.diff(known)
    grows = steps[steps > 0]
    if not grows.size or not np.allclose(grows, grows[0], rtol=1e-3):
        return False
    whole = grows[0] == 1 and bool(np.all(known == np.round(known)))
    return grows.size == steps.size or (whole and grows.size > _COUNTING * steps.size)


def _travels(samples: Floats) -> bool:
    """Whether its slow part is much larger than what the excitation moves."""
    size = len(samples) // _PIECES
    if size < 2:
        return False
    pieces = samples[: size * _PIECES].reshape(_PIECES, size)
    within = float(np.nanmedian(np.nanstd(pieces, axis=1)))
    return bool(np.nanstd(np.nanmean(pieces, axis=1)) > _SLOW * within)
