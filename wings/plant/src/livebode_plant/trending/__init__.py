"""Quantities over months and machines: trends with bounds, changes, and the ranking of a fleet."""

from livebode.core import needing

with needing("PyArrow", "archive", "a trend"):
    from livebode_plant.trending.assessment import (
        FALSE_DISCOVERIES,
        LIMIT_PERCENT,
        LOGARITHMIC,
        Assessment,
        LevelDifference,
        Ranked,
        assess,
        differences,
        discoveries,
        months_to_limit,
        urgency,
    )
    from livebode_plant.trending.quantity_history import History, MachineHistory, Selection, histories, history
    from livebode_plant.trending.trend import MONTH_S, RUNS_MIN, ChangePoint, NotAssessed, Trend, trend_of

__all__ = [
    "FALSE_DISCOVERIES", "LIMIT_PERCENT", "LOGARITHMIC", "MONTH_S", "RUNS_MIN", "Assessment", "ChangePoint", "History",
    "LevelDifference", "MachineHistory", "NotAssessed", "Ranked", "Selection", "Trend", "assess", "differences",
    "discoveries", "histories", "history", "months_to_limit", "trend_of", "urgency",
]  # fmt: skip
