"""The report of a hall: all machines and quantities of a lake on one page, the worst first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import Any

from livebode.core import Document, Finding, Paragraph, Picture, PrintedTable, Section, Tone, date_and_time
from livebode.dataclass import dataclass
from livebode.language import listed, number, quantity_name, tr, trn, worded
from livebode_plant.report.trend_words import (
    amount,
    change_words,
    day,
    months,
    outlook,
    scale,
    sentence,
    year_of,
)
from livebode_plant.trending import LIMIT_PERCENT, Assessment, History, Ranked, urgency

_SENTENCES, _PICTURES, _ROWS = 12, 6, 40


@dataclass(frozen=True)
class RunAlarm:
    """An alarm of a run: its axis, begin of the recording in s since 1970, and what was reported."""

    axis: str
    recorded_s: float | None
    message: str


@dataclass(frozen=True, eq=False)
class Hall:
    """What a lake says about a hall.

    Attributes
    ----------
    name
        Of the hall.
    assessments
        Of each quantity, with the axis as level.
    quarantined
        Rows of recordings that could not be tracked: axis, and reason.
    limit_percent
        Change that needs maintenance.
    alarming
        Number of runs with an alarm.
    alarms
        Those of the newest of these, the newest run first.
    """

    name: str
    assessments: Sequence[Assessment]
    quarantined: Sequence[tuple[str, str]] = ()
    limit_percent: float = LIMIT_PERCENT
    alarming: int = 0
    alarms: Sequence[RunAlarm] = ()

    @property
    def changed(self) -> list[tuple[Ranked, History]]:
        """Significant changes of all quantities, the worst first."""
        every = [(ranked, of.history) for of in self.assessments for ranked in of.ranked if ranked.significant]
        return sorted(every, key=lambda pair: urgency(pair[0]))

    @property
    def axes(self) -> dict[str, tuple[int, float, float]]:
        """Number of runs, and times of the first and the last, of each axis."""
        found: dict[str, tuple[int, float, float]] = {}
        for of in self.assessments:
            for axis, runs in of.history.machines.items():
                own = (len(runs.time_s), float(runs.time_s[0]), float(runs.time_s[-1]))
                found[axis] = max(own, found.get(axis, own))
        return dict(sorted(found.items()))

    @property
    def silent(self) -> dict[str, float]:
        """Last run of the axes that have sent nothing for four weeks before the newest run of the hall."""
        every = [{*of.silent} for of in self.assessments]
        common = set.intersection(*every) if every else set()
        return {axis: last for axis, (_, _, last) in self.axes.items() if axis in common}

    def plain(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "axes": len(self.axes),
            "runs": sum(runs for runs, _, _ in self.axes.values()),
            "quarantined": len(self.quarantined),
            "changed": [
                {
                    "axis": each.machine,
                    "quantity": history.name,
                    "sentence": sentence(each, quantity_name(history.name), history.unit_of(each.machine)),
                }
                for each, history in self.changed
            ],
            "silent": {axis: day(last) for axis, last in self.silent.items()},
            "runs_with_alarms": self.alarming,
            "alarms": [
                {"axis": alarm.axis, "recorded": _recorded(alarm), "message": alarm.message} for alarm in self.alarms
            ],
        }

    def document(self, made: datetime) -> Document:
        """The report."""
        sections = (self._alarm_list(), self._changes(), self._silent(), self._not_assessed(), self._how())
        return Document(
            kind=tr("Report of a hall"),
            title=self.name,
            facts=self._facts(made),
            verdict=(),
            sections=tuple(section for section in sections if section is not None),
            foot=self.name,
            result=(*self._alarm_finding(), self._result(), *self._findings()),
            picture=self._picture(),
            made=made,
        )

    def _facts(self, made: datetime) -> tuple[tuple[str, str], ...]:
        axes = self.axes
        span = "—"
        if axes:
            first, last = min(first_s for _, first_s, _ in axes.values()), max(last_s for _, _, last_s in axes.values())
            span = f"{day(first)} … {day(last)}"
        return (
            (tr("recorded"), span),
            (tr("axes"), number(len(axes), ",")),
            (tr("runs"), number(sum(runs for runs, _, _ in axes.values()), ",")),
            (tr("recordings in quarantine"), number(len(self.quarantined), ",")),
            (tr("quantities"), listed(quantity_name(of.history.name) for of in self.assessments)),
            (tr("report written"), date_and_time(made.timestamp())),
        )

    def _result(self) -> Finding:
        changed = {ranked.machine for ranked, _ in self.changed}
        assessed = {ranked.machine for of in self.assessments for ranked in of.ranked}
        if not assessed:
            return Finding("open", tr("No axis has enough runs for a trend."))
        if not changed:
            text = trn("No change is shown at {n:,} axis.", "No change is shown at any of {n:,} axes.", len(assessed))
            return Finding("ok", text)
        text = trn(
            "{n:,} of {of:,} axes changed significantly.", "{n:,} of {of:,} axes changed significantly.", len(changed),
            of=len(assessed),
        )  # fmt: skip
        return Finding(max((self._tone(ranked) for ranked, _ in self.changed), key=("check", "alarm").index), text)

    def _tone(self, one: Ranked) -> Tone:
        return "alarm" if one.months == 0 else "check"

    def _findings(self) -> Iterator[Finding]:
        for one, history in self.changed[:_SENTENCES]:
            words = sentence(one, quantity_name(history.name), history.unit_of(one.machine))
            yield Finding(self._tone(one), " ".join(filter(None, (words, outlook(one, self.limit_percent)))))
        if (more := len(self.changed) - _SENTENCES) > 0:
            yield Finding(
                "check", trn("{n:,} more change is in the table.", "{n:,} more changes are in the table.", more)
            )
        for axis, last in self.silent.items():
            yield Finding("check", tr("{axis} has no run since {day}.", axis=axis, day=day(last)))

    def _alarm_finding(self) -> Iterator[Finding]:
        if self.alarms:
            axes = listed(sorted({alarm.axis for alarm in self.alarms}))
            text = trn(
                "{n:,} run has an alarm against the baseline of its machine: {axes}.",
                "{n:,} runs have an alarm against the baseline of their machine: {axes}.",
                self.alarming,
                axes=axes,
            )
            yield Finding("alarm", text)

    def _alarm_list(self) -> Section | None:
        if not self.alarms:
            return None
        rows = tuple((alarm.axis, _recorded(alarm) or "—", worded(alarm.message)) for alarm in self.alarms[:_ROWS])
        note = tr("The newest runs first. Each was compared with the baseline of its machine.")
        return Section(tr("Alarms"), (PrintedTable((tr("axis"), tr("recorded"), tr("alarm")), rows, (), note),))

    def _changes(self) -> Section | None:
        if not self.changed:
            return None
        rows = tuple(self._row(one, history) for one, history in self.changed[:_ROWS])
        headings = (
            tr("axis"), tr("quantity"), tr("a month, now"), tr("in all"), tr("unit"), tr("changes"), tr("limit"),
            tr("runs"),
        )  # fmt: skip
        note = tr("± covers 95 %. Of the rows, at most 5 % are expected to be unchanged.")
        return Section(tr("Axes that changed"), (PrintedTable(headings, rows, (2, 3, 7), note),))

    def _picture(self) -> Picture | None:
        years = [year_of(history, one.machine, one.trend) for one, history in self.changed[:_PICTURES]]
        caption = tr(
            "The first of the changes: each run with its bound, without the influence of the covariates; the trend "
            "with its 95 % bound; jumps and other slopes."
        )
        return Picture("livebode_plant.report.trend_words:years_figure", {"years": years}, caption) if years else None

    def _row(self, one: Ranked, history: History) -> tuple[str, ...]:
        trend, unit = one.trend, history.unit_of(one.machine)
        return (
            one.machine,
            quantity_name(history.name),
            amount(trend, trend.per_month, trend.per_month_bound_95, unit),
            amount(trend, trend.change, trend.change_bound_95, unit),
            scale(trend, unit)[1],
            listed(change_words(trend, change, unit) for change in trend.changes),
            months(one, self.limit_percent),
            number(trend.runs, ","),
        )

    def _silent(self) -> Section | None:
        rows = tuple((axis, day(last), number(self.axes[axis][0], ",")) for axis, last in self.silent.items())
        if not rows:
            return None
        note = tr("Axes without a run in the four weeks before the newest run of the hall.")
        return Section(
            tr("Axes without data"), (PrintedTable((tr("axis"), tr("last run"), tr("runs")), rows, (2,), note),)
        )

    def _not_assessed(self) -> Section | None:
        reasons: dict[tuple[str, str], list[str]] = {}
        for of in self.assessments:
            for axis, reason in of.not_assessed.items():
                reasons.setdefault((axis, reason), []).append(quantity_name(of.history.name))
            if of.history.undated:
                reason = trn("{n:,} run without a date", "{n:,} runs without a date", of.history.undated)
                reasons.setdefault(("", reason), []).append(quantity_name(of.history.name))
            if of.history.other_recipes:
                reason = trn(
                    "{n:,} run with other settings", "{n:,} runs with other settings", of.history.other_recipes
                )
                reasons.setdefault(("", reason), []).append(quantity_name(of.history.name))
        rows = [(axis, listed(names), worded(reason)) for (axis, reason), names in reasons.items()]
        rows += [(axis, tr("recording in quarantine"), reason) for axis, reason in self.quarantined]
        if not rows:
            return None
        more = trn("{n:,} more row is not listed.", "{n:,} more rows are not listed.", len(rows) - _ROWS)
        table = PrintedTable(
            (tr("axis"), tr("what"), tr("reason")), tuple(rows[:_ROWS]), (), more if len(rows) > _ROWS else ""
        )
        return Section(tr("Not assessed"), (table,))

    def _how(self) -> Section:
        words = tr(
            "Each quantity of each axis is regressed on the time and on the covariates, with little weight for "
            "outliers; jumps and other slopes are added where they are significant. The bounds contain the scatter "
            "from run to run and its correlation. An axis is listed if chance does not explain its trend or its "
            "change, so that at most 5 % of the listed ones are expected to be unchanged (Benjamini and Hochberg). The "
            "ranking is by the months until a quantity has changed by {limit} %.",
            limit=number(self.limit_percent, "g"),
        )
        return Section(tr("How it was assessed"), (Paragraph(words),))


def _recorded(one: RunAlarm) -> str:
    return "" if one.recorded_s is None else day(one.recorded_s)
