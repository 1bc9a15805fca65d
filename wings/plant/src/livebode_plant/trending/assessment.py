"""Assessment: the trends of a quantity on all machines, ranked, and what could not be assessed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from livebode_plant.trending.fleet import Ranked, discoveries, months_to_limit, urgency
from livebode_plant.trending.quantity_history import History
from livebode_plant.trending.trend import NotAssessed, Trend

SILENT_S = 28 * 86400.0
"""A machine without a run for so long before the newest run of all is reported."""
LIMIT_PERCENT = 10.0


@dataclass(frozen=True, eq=False)
class Assessment:
    """A quantity of all machines.

    Attributes
    ----------
    history
        The runs.
    ranked
        The machines with a trend, the worst first.
    not_assessed
        Why the others have none, by machine.
    silent
        Last run of machines that have sent nothing for four weeks before the newest run, s since 1970.
    """

    history: History
    ranked: tuple[Ranked, ...]
    not_assessed: Mapping[str, str]
    silent: Mapping[str, float]


def assess(found: Sequence[History], limit_percent: float = LIMIT_PERCENT) -> list[Assessment]:
    """Trends of one or several quantities, with the false discoveries of all together limited.

    Parameters
    ----------
    found
        The quantities.
    limit_percent
        Change that needs maintenance; see `ranking`.
    """
    trends: list[tuple[int, str, Trend]] = []
    refused: list[dict[str, str]] = [{} for _ in found]
    for number, one in enumerate(found):
        for machine, runs in one.machines.items():
            trend = runs.trend()
            if isinstance(trend, NotAssessed):
                refused[number][machine] = trend.reason
            else:
                trends.append((number, machine, trend))
    significant = discoveries([trend.p for *_, trend in trends])
    ranked: list[list[Ranked]] = [[] for _ in found]
    for (number, machine, trend), own in zip(trends, significant):
        months = months_to_limit(trend, limit_percent, found[number].unit_of(machine))
        ranked[number].append(Ranked(machine, trend, own, months))
    return [
        Assessment(one, tuple(sorted(ranked[number], key=urgency)), refused[number], silent_since(one))
        for number, one in enumerate(found)
    ]


def silent_since(found: History) -> dict[str, float]:
    """Last run of the machines that have sent nothing for four weeks before the newest run of all."""
    last = {machine: float(runs.time_s[-1]) for machine, runs in found.machines.items()}
    newest = max(last.values(), default=0.0)
    return {machine: time_s for machine, time_s in last.items() if newest - time_s > SILENT_S}
