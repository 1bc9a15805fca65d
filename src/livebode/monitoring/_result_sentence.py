"""The result of the monitoring of a run as a sentence."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from livebode.core import Tone
from livebode.language import Message


def result_sentence(summary: Mapping[str, Any], together: Sequence[Message] = ()) -> Message:
    """Sentence of judged time and changes as in run.json; `together` has the amounts of the active ones."""
    return Message.sentences([_changes(summary, together), *_torque(summary), *_not_monitored(summary)])


def result_tone(monitoring: Mapping[str, Any], *, active: bool) -> Tone:
    """Tone of the sentence: whether a change is active, something is to be looked at, or nothing was judged."""
    if monitoring.get("baseline") is None or not (monitoring.get("judged_s") or active):
        return "open"
    look = monitoring.get("changes") or monitoring.get("not_monitored") or monitoring.get("places_not_monitored_m")
    return "alarm" if active else "check" if look else "ok"


def _changes(summary: Mapping[str, Any], together: Sequence[Message]) -> Message:
    judged_s, changes = summary["judged_s"], summary["changes"]
    if not judged_s and not changes:
        return _nothing(summary)
    if not changes:
        return Message("No change against the baseline ({judged_s:.1f} s of the run judged).", judged_s=judged_s)
    result = Message(
        "{changes}, {active} of them active at the end ({judged_s:.1f} s of the run judged)",
        changes=Message("1 change against the baseline")
        if changes == 1
        else Message("{changes} changes against the baseline", changes=changes),
        active=len(summary["standing"]) or Message("none"),
        judged_s=judged_s,
    )
    if not together:
        return Message("{result}.", result=result)
    return Message("{result}: {amounts}.", result=result, amounts=together)


def _nothing(summary: Mapping[str, Any]) -> Message:
    """Why no window was judged; friction and orders need no windows."""
    weak = summary.get("not_monitored_s")
    if _torque(summary):
        if weak:
            return Message("No response could be judged: the windows of the run do not show enough of the machine.")
        return Message("No response could be judged: the baseline does not cover what the machine did.")
    if weak:
        return Message("Nothing of the run could be judged: its windows do not show enough of the machine.")
    return Message("Nothing of the run could be judged: the baseline does not cover what the machine did.")


def _torque(summary: Mapping[str, Any]) -> list[Message]:
    """How long friction and orders were judged."""
    judged_s = max((result["judged_s"] for result in summary.get("torque", {}).values()), default=0.0)
    if not judged_s:
        return []
    if "orders" in summary["torque"]:
        return [Message("Friction and orders judged in {judged_s:.0f} s.", judged_s=judged_s)]
    return [Message("Friction judged in {judged_s:.0f} s.", judged_s=judged_s)]


def _not_monitored(summary: Mapping[str, Any]) -> list[Message]:
    """Sentences on what a change would not have been found in."""
    sentences = []
    if summary.get("idle_s"):
        sentences.append(
            Message("Not monitored for {idle_s:.1f} s: the axis did not move steadily.", idle_s=summary["idle_s"])
        )
    if named := summary.get("not_monitored"):
        longest = max(named.values())
        parts = [Message(name) for name, seconds in named.items() if seconds > longest / 2]
        sentences.append(
            Message(
                "Not monitored for {not_monitored_s:.1f} s: too little information about {parts}.",
                not_monitored_s=longest,
                parts=parts,
            )
        )
    if places := summary.get("places_not_monitored_m"):
        sentences.append(not_passed(places))
    return sentences


def not_passed(places_m: Iterable[Sequence[float]]) -> Message:
    """Places that would not be monitored, from and to each."""
    places = [Message("{low:.3g} … {high:.3g}", low=low, high=high) for low, high in places_m]
    return Message("Places not monitored, because the axis did not pass them: {places}.", places=places)
