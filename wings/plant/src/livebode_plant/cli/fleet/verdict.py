"""The result of a check as a person reads it."""

from __future__ import annotations

from livebode.core import FleetError
from livebode_plant.fleet.check import CheckResult


def verdict(result: CheckResult) -> str:
    """One sentence with all figures."""
    total = result.total
    other = f", {total.other_recipe} with another configuration were not compared" if total.other_recipe else ""
    return (
        f"{total.responses:,} responses (axes: {len(result.axes)}): {total.missing} missing, {total.doubled} doubled, "
        f"{total.different + total.unexpected} different from one uninterrupted computation{other}"
        + _others(total.parameters, "parameters", total.parameters_missing, total.parameters_unexpected)
        + _others(total.events, "events", total.events_missing, total.events_unexpected)
    )


def _others(count: int, what: str, missing: int, unexpected: int) -> str:
    """Words about what many fleets have none of."""
    if not (count or unexpected):
        return ""
    return f"; {count:,} {what}: {missing} missing, {unexpected} doubled or different"


def require_exact(result: CheckResult) -> None:
    """FleetError with the figures if a response is missing, doubled or different."""
    if not result.exact:
        wrong = [path for path, axis in result.axes.items() if not axis.exact]
        raise FleetError(
            "not-exactly-once",
            f"{verdict(result)}; the axes are {', '.join(wrong[:5])}",
            "keep the log, and report this with `livebode doctor --bundle`",
            axes=wrong,
        )
