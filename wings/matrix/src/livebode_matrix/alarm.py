"""A matrix that differs from the baseline: its event, and whether it corrects an earlier one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from livebode.core import Event, MatrixResponses, moment
from livebode.language import Message
from livebode_matrix.change import EntryChange, MatrixPair
from livebode_matrix.gantry_change import CART_PLACE, Cause


@dataclass(frozen=True)
class MatrixAlarm:
    """A matrix that chance does not explain.

    Attributes
    ----------
    first, sample, time_s
        First and newest sample and effective time of the matrix.
    probability
        That chance alone gives as large a difference from the baseline.
    entry
        The entry that changed most.
    causes
        Parts of the described machine that changed; none without a description.
    """

    first: int
    sample: int
    time_s: float
    probability: float
    entry: EntryChange
    causes: tuple[Cause, ...]

    @classmethod
    def of(cls, one: MatrixResponses, pair: MatrixPair, causes: tuple[Cause, ...]) -> MatrixAlarm:
        """Of a matrix, its difference from the baseline, and the causes of that."""
        entry = min(pair.entries(), key=lambda changed: changed.probability)
        return cls(max(int(one.first[0]), 0), int(one.sample[0]), float(one.time_s[0]), pair.probability, entry, causes)

    @property
    def since(self) -> dict[str, Any]:
        """Where the change was first seen."""
        return {"since_s": self.time_s, "since_sample": self.first}

    @property
    def reported(self) -> dict[str, Any]:
        """What a later matrix is compared with: the part, else the line of the entry."""
        if self.causes:
            cause = self.causes[0]
            return {"name": cause.part, "amount": cause.amount, "bound": cause.bound, "frequency_hz": None}
        entry = self.entry
        return {
            "name": _name(entry),
            "amount": entry.share,
            "bound": entry.bound,
            "frequency_hz": entry.frequency_hz,
        }

    def corrects(self, reported: dict[str, Any], pair: MatrixPair) -> bool:
        """Whether it shows another part, or another amount by more than both bounds."""
        if self.causes:
            now = self.reported
            if now["name"] != reported["name"]:
                return True
            amount, bound = now["amount"], now["bound"]
        elif reported["frequency_hz"] is None:
            return False  # The part is known from a better matrix.
        else:
            # At the same line: which entry and line differ most is by chance where several do.
            amount, bound = pair.share(reported["name"], reported["frequency_hz"])
        return bool(abs(amount - reported["amount"]) > bound + reported["bound"])

    def event(self, kind: str, since: dict[str, Any]) -> Event:
        """The change or its correction, first seen there."""
        entry = self.entry
        changes = [_change_of(cause) for cause in self.causes]
        facts = {
            "response": _name(entry),
            "percent": 100 * entry.share,
            "bound": 100 * entry.bound,
            "line_hz": entry.frequency_hz,
        }
        if changes:
            by = Message("the response {response} differs by {percent:.3g} ± {bound:.2g} % at {line_hz:g} Hz", **facts)
        else:
            by = Message(
                "the response {response} differs from the baseline by {percent:.3g} ± {bound:.2g} % at {line_hz:g} Hz",
                **facts,
            )
        changes.append(by)
        message = Message("In the newest matrix {differences}.", differences=changes)
        if kind == "change":
            message = Message("Since {since} {differences}.", since=moment(since["since_s"]), differences=changes)
        details = {
            "what": "matrix",
            "entry": _name(entry),
            "frequency_hz": entry.frequency_hz,
            "amount_percent": 100 * entry.share,
            "bound_percent": 100 * entry.bound,
            "part": self.causes[0].part if self.causes else None,
            "changes": [_change(one) for one in self.causes],
            "probability": self.probability,
        }
        return Event(kind, self.sample, self.time_s, message, details | since)


def cleared(one: MatrixResponses) -> Event:
    """This matrix agrees with the baseline again."""
    time_s = float(one.time_s[0])
    message = Message("At {time} the responses agree with the baseline again.", time=moment(time_s))
    return Event("change-cleared", int(one.sample[0]), time_s, message, {"what": "matrix"})


def _change(cause: Cause) -> dict[str, Any]:
    """As the changes of a table: in percent, or in its unit where that is not known, and of a place."""
    share = cause.before > 0 and cause.part != CART_PLACE
    scale, unit = (100 / cause.before, "%") if share else (1.0, cause.unit)
    return {
        "name": cause.part,
        "of": "value",
        "unit": unit,
        "amount": scale * cause.amount,
        "bound": scale * cause.bound,
    }


def _name(entry: EntryChange) -> str:
    return f"{entry.output}/{entry.input}"


def _change_of(cause: Cause) -> Message:
    """The change of a part, whose name has no article; that of the place names the cart."""
    return cause.sentence if cause.part == CART_PLACE else Message("the {change}", change=cause.sentence)
