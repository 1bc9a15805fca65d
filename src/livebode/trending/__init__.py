"""Quantities over months and machines: trends with bounds, changes, and the ranking of a fleet."""

from livebode.trending.changes import SIGNIFICANT
from livebode.trending.fleet import FALSE_DISCOVERIES, Ranked, discoveries, ranking
from livebode.trending.trend import MONTH_S, RUNS_MIN, ChangePoint, Effect, NotAssessed, Trend, trend_of

__all__ = [
    "FALSE_DISCOVERIES",
    "MONTH_S",
    "RUNS_MIN",
    "SIGNIFICANT",
    "ChangePoint",
    "Effect",
    "NotAssessed",
    "Ranked",
    "Trend",
    "discoveries",
    "ranking",
    "trend_of",
]
