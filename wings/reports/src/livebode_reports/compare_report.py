"""The report of the comparison of two runs."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from datetime import datetime
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from livebode.analysis import RunMean
from livebode.configuration import ReportSection, recorded_configuration, recorded_report
from livebode.core import (
    TONES,
    Answer,
    Document,
    Finding,
    Paragraph,
    Part,
    Picture,
    PrintedTable,
    Section,
    counted,
    with_bound,
)
from livebode.dataclass import dataclass
from livebode.estimates import kind_of
from livebode.language import Message, number, quantity_name, recorded, tr, trn, worded
from livebode.records import RunRecord, event_counts, read_summary
from livebode_reports import first_page
from livebode_reports.changes import Changes, QuantityChange, by_importance, changes, percent
from livebode_reports.comparison_verdict import detectable, in_percent, most_certain, parameters, verdict
from livebode_reports.difference import ALPHA, Difference, RunDifferences, compare
from livebode_reports.kinds import rule_of
from livebode_reports.limits import limits
from livebode_reports.report_data import entry_title, read, written
from livebode_reports.wording import decibels, pairs, polar, polar_phrase, signed

TONES_OF_A_COMPARISON = {**TONES, "ok": Message("no difference shown")}
_LINES_SHOWN, _PLACES_SHOWN, _ANSWERS_MAX = 10, 40, 5


def comparison_of(before: Path, after: Path) -> Any:
    """What compares two runs: a class such as `Comparison`. RecordError if one is not a run."""
    first, second = (kind_of(read_summary(path)[0]) for path in (before, after))
    return (first == second and rule_of(first, "compare")) or Comparison


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two runs compared, and the sentences, tables and document that report it."""

    differences: RunDifferences
    changes: Changes

    @classmethod
    def of(cls, before: Path, after: Path, *, ignore_below: float = 0.0, entry: str | None = None) -> Comparison:
        """Read and compare two runs, or one entry of two matrix runs; raises the errors of `compare`."""
        runs = RunRecord.open(before, entry=entry), RunRecord.open(after, entry=entry)
        return cls.between(*runs, ignore_below=ignore_below)

    @classmethod
    def between(
        cls, before: RunRecord, after: RunRecord, *, ignore_below: float = 0.0, together: int = 1
    ) -> Comparison:
        """Compare two opened runs; `together` as in `compare`."""
        differences = compare(before, after, ignore_below=ignore_below, together=together)
        return cls(differences, changes(differences))

    @property
    def later(self) -> RunRecord:
        """The run after the change."""
        return self.differences.runs[1]

    @property
    def printed(self) -> Iterator[str]:
        """Verdict and tables for the terminal, and why there are no parameters."""
        yield from (finding.text for finding in self.sentences)
        yield from (f"\n{table}" for table in self.tables)
        if not self.changes.parameters:
            yield self.changes.parameter_words

    @property
    def sentences(self) -> tuple[Finding, ...]:
        """The verdict, the most urgent finding first."""
        return verdict(self.differences, self.changes)

    @property
    def tables(self) -> tuple[str, ...]:
        """Tables for the terminal: changes of parameters and margins, and the ten lines that differ most certainly."""
        d = self.differences.overall
        changed = [
            f"  {quantity_name(c.name):28}{number(c.before[0], '.5g'):>12} → "
            f"{number(c.after[0], '.5g'):<12}{_amount(c)}{c.unit}" + "  changed" * c.significant
            for table in (self.changes.parameters, self.changes.margins)
            for c in by_importance(table)
        ]
        differing = most_certain(d)
        rows = [
            f"{d.before.lines.frequency_hz[i]:>10g} Hz {_ratio_columns(complex(d.ratio[i]), float(d.bound[i]))}"
            for i in sorted(differing[:_LINES_SHOWN])
        ]
        if rows:
            rows.insert(0, "after/before at the lines that differ most certainly; ± covers all lines with 95 %")
        if (more := len(differing) - _LINES_SHOWN) > 0:
            rows.append(f"and {counted(more, 'more line')} that differ; --json prints all lines, --out FILE a report")
        return tuple(filter(None, ("\n".join(changed), "\n".join(rows))))

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        places = [{"from": p.low, "to": p.high, "back": p.back} | _lines(p.difference) for p in self.differences.places]
        return {
            "before": self.differences.runs[0].place,
            "after": self.differences.runs[1].place,
            "quantity": self.differences.overall.before.quantity,
            "unit": self.differences.overall.before.unit,
            "alpha": ALPHA,
            "tested_together": self.differences.overall.m,
            "ignore_below": self.differences.overall.ignore_below,
            "lines": _lines(self.differences.overall)["lines"],
            "places": places,
            "parameters": [_plain_change(c) for c in self.changes.parameters],
            "margins": [_plain_change(c) for c in self.changes.margins],
            "warnings": list(self.differences.warnings),
            "sentences": [finding.text for finding in self.sentences],
        }

    def document(
        self, made: datetime, *, header: ReportSection | None = None, appendix: bool = False
    ) -> Document:  # fmt: skip
        """The report.

        Parameters
        ----------
        made
            Time of the report.
        header
            The first page, and limits for the later run. Default: the [report] of that run.
        appendix
            Add the settings that differ.
        """
        before, other = self.differences.runs
        header = recorded_report(other.summary) if header is None else header
        accepted = read(other.path, header=header, entry=other.entry_name).accepted if header.limits else ()
        runs = header.machine or tr("{before} and {after}", before=run_name(before), after=run_name(other))
        title = " · ".join(filter(None, (runs, entry_title(other))))
        sections = [
            limits(accepted), self._parameters(), self.differing(), self._places(), self.how(), self.events(),
        ]  # fmt: skip
        return Document(
            kind=tr("Before and after"),
            title=title,
            facts=first_page.facts(header, title, self.facts(), made),
            verdict=self.sentences,
            sections=tuple(section for section in sections if section is not None),
            foot=" · ".join(filter(None, (title, header.serial_number, header.company))),
            heading=tr("What changed"),
            tones=TONES_OF_A_COMPARISON,
            answers=self._answers(),
            about_answers=tr("Change from before to after. ± covers all changes of the table together with 95 %."),
            result=first_page.result(tuple(self._in_short()), accepted),
            picture=self.picture(),
            signatures=first_page.signatures(header),
            appendix=(self.response(), *(self.appendix() if appendix else ())),
            logo=first_page.logo_of(header),
            paper=header.paper,
            made=made,
        )

    def _in_short(self) -> Iterator[Finding]:
        """The verdict without the changes that the answers have."""
        answered = {finding.text for finding in parameters(self.changes.parameters)}
        for finding in self.sentences:
            if finding.text in answered:
                changed, every = sum(c.significant for c in self.changes.parameters), len(self.changes.parameters)
                text = trn(
                    "{n:,} parameter of {all} changed.", "{n:,} parameters of {all} changed.", changed, all=every
                )  # fmt: skip
                yield Finding(finding.tone, text)
            else:
                yield finding

    def _answers(self) -> tuple[Answer, ...]:
        """The changes of the most important parameters."""
        rows = by_importance(self.changes.parameters)[:_ANSWERS_MAX]
        return tuple(
            Answer(
                quantity_name(c.name), in_percent(c),
                f"{with_bound(*c.before)[0]} → {with_bound(*c.after)[0]} {worded(c.unit)}".rstrip(),
                "differs" if c.significant else "ok",
            )
            for c in rows
        )  # fmt: skip

    def appendix(self) -> tuple[Section, ...]:
        """The settings that differ, and what the report does not contain."""
        absent = (
            (self.changes.parameter_words, self.changes.parameters), (self.changes.margin_words, self.changes.margins),
        )  # fmt: skip
        parts = tuple(Paragraph(worded(words)) for words, table in absent if words and not table)
        paths = pairs([(tr("before"), self.differences.runs[0].place), (tr("after"), self.differences.runs[1].place)])
        sections = (Section(tr("Details of the measurement"), (paths,)), _settings(*self.differences.runs))
        return (*sections, Section(tr("Not in this report"), parts)) if parts else sections

    def facts(self, *others: Comparison) -> list[tuple[str, str]]:
        """Rows of the title block; of a matrix run with the `others` of its entries."""
        rows = [
            (tr("before"), run_name(self.differences.runs[0])), (tr("after"), run_name(self.differences.runs[1])),
            *((words, _measured(run, average)) for words, run, average in zip(
                (tr("before measured"), tr("after measured")), self.differences.runs, self.differences.averages
            )),
            (tr("responses"), " / ".join(number(a.count, ",") for a in self.differences.averages)),
            (tr("compared at"), _span(self.differences)),
            (tr("smallest detectable change of a line"), detectable(*(c.differences.overall for c in (self, *others)))),
        ]  # fmt: skip
        return [(name, value) for name, value in rows if value]

    def picture(self) -> Picture:
        """Both responses, and their ratio."""
        d = self.differences.overall
        how = tr("means of the runs")
        if self.differences.places:
            how = tr("means over the common places, each place counted alike")
        caption = tr(
            "Before and after: {how}, with 95 % bounds. Below: ratio after/before, with the bound that covers all {m} "
            "lines together with 95 %; filled marks differ.",
            how=how, m=d.m,
        )  # fmt: skip
        data = {"before": d.before, "after": d.after, "ratio": d.ratio, "bound": d.bound, "differs": d.differs}
        return Picture("comparison", data, caption)

    def how(self) -> Section:
        """How the runs were compared."""
        words = tr(
            "The means of both runs are compared. A change is reported only if chance does not explain it. "
            "“Detectable” is the smallest change that this comparison finds with a probability of 95 %: a smaller one "
            "may be there and not be seen."
        )  # fmt: skip
        return Section(
            tr("How it was compared"), (Paragraph(words), Paragraph(_how_tested(self.differences.overall.m)))
        )

    def response(self) -> Section:
        """Both responses and their ratio at each line."""
        return Section(tr("Frequency response"), (self._lines(),))

    def differing(self) -> Section | None:
        """The lines that differ most certainly; None if none differs."""
        differing = most_certain(self.differences.overall)
        if not differing.size:
            return None
        return Section(tr("Lines that differ"), (self._lines(sorted(differing[:_LINES_SHOWN].tolist())),))

    def _lines(self, indices: Sequence[int] | None = None) -> PrintedTable:
        d = self.differences.overall
        radius = [r.bound() for r in (d.before, d.after)]
        rows = [
            (
                number(f, "g"), *polar(complex(d.before.value[i]), float(radius[0][i]))[:2],
                *polar(complex(d.after.value[i]), float(radius[1][i]))[:2],
                *polar(complex(d.ratio[i]), float(d.bound[i])), _seen(d.seen[i]), _p(d.p[i]),
                tr("yes") if d.differs[i] else tr("no"),
            )
            for i, f in enumerate(d.before.lines.frequency_hz)
            if indices is None or i in indices
        ]  # fmt: skip
        note = tr("± of the ratio: 95 % at all lines together.")
        if indices is not None and (more := int(d.differs.sum()) - len(indices)) > 0:
            text = trn(
                "{n:,} more line that differs is in the table of all lines, at the end.",
                "{n:,} more lines that differ are in the table of all lines, at the end.",
                more,
            )
            note = f"{text} {note}"
        headings = (
            "Hz", tr("before dB"), "±", tr("after dB"), "±", tr("ratio dB"), "±", tr("ratio °"), "±",
            tr("detectable %"), "p", tr("differs"),
        )  # fmt: skip
        return PrintedTable(headings, tuple(rows), tuple(range(11)), note)

    def _places(self) -> Section | None:
        places = self.differences.places
        if not places:
            return None
        caption = tr("Change of the magnitude at each place and line, forward and return; dots mark those that differ.")
        data = {
            "frequency_hz": self.differences.overall.before.lines.frequency_hz,
            "places": [(p.low, p.high, p.back, p.difference.ratio, p.difference.differs) for p in places],
        }
        rows = [
            (
                f"{number(p.low, '.3g')} … {number(p.high, '.3g')}",
                tr("return") if p.back else tr("forward"), number(f, "g"),
                *polar(complex(p.difference.ratio[i]), float(p.difference.bound[i])), _p(p.difference.p[i]),
            )
            for p in places
            for i, f in enumerate(p.difference.before.lines.frequency_hz)
            if p.difference.differs[i]
        ]  # fmt: skip
        parts: list[Part] = [Picture("places", data, caption)]
        if rows:
            left_out = len(rows) - _PLACES_SHOWN
            note = trn(
                "{n:,} more row is not listed; the picture shows all.",
                "{n:,} more rows are not listed; the picture shows all.",
                left_out,
            )
            headings = (tr("place"), tr("direction"), "Hz", tr("ratio dB"), "±", tr("ratio °"), "±", "p")
            shown = tuple(rows[:_PLACES_SHOWN])
            parts.append(PrintedTable(headings, shown, tuple(range(2, 8)), note if left_out > 0 else ""))
        return Section(tr("By place"), tuple(parts))

    def _parameters(self) -> Section | None:
        if not (self.changes.parameters or self.changes.margins):
            return None
        parts: list[Part] = []
        for words, table in (
            (self.changes.parameter_words, self.changes.parameters),
            (self.changes.margin_words, self.changes.margins),
        ):
            if table:
                parts += [Paragraph(worded(words))] if words else []
                headings = (
                    "", tr("before"), "±", tr("after"), "±", tr("unit"), tr("change"), "±", tr("in %"),
                    tr("detectable %"), tr("differs"),
                )  # fmt: skip
                note = tr(
                    "± of before and after covers 95 % each; ± of the change covers the whole table together "
                    "(Bonferroni)."
                )
                parts.append(
                    PrintedTable(headings, tuple(_row(c) for c in by_importance(table)), (1, 2, 3, 4, 6, 7, 8, 9), note)
                )
        return Section(tr("Parameters and margins"), tuple(parts))

    def events(self) -> Section:
        """Events of both runs."""
        counts = [sum(map(event_counts, run.each_event_and_damage()), Counter[str]()) for run in self.differences.runs]
        kinds = sorted(counts[0].keys() | counts[1].keys())
        rows = tuple((worded(kind), *(number(count[kind], ",") for count in counts)) for kind in kinds)
        parts: list[Part] = [PrintedTable((tr("kind"), tr("before"), tr("after")), rows, (1, 2))] if rows else []
        for run, when in zip(self.differences.runs, (tr("Before"), tr("After"))):
            monitoring = run.summary.get("monitoring", {})
            judged = monitoring.get("baseline") is not None and "message" in monitoring
            message: str = Message("changes are not assessed.")
            if judged:
                message = recorded(monitoring.get("words", {}), monitoring["message"])
            parts.append(Paragraph(f"{when}: {worded(message)}"))
        return Section(tr("Events"), tuple(parts))


def _amount(c: QuantityChange) -> str:
    """A change with its bound; below a hundredth of that it is 0."""
    text, around = with_bound(c.amount, c.bound)
    return f"{'0' if abs(c.amount) < c.bound / 100 else signed(text):>12} ± {around:<10}"


def _ratio_columns(ratio: complex, bound: float) -> str:
    """A ratio with its bound in columns, or in words where a side of the bound is open."""
    if not bound < abs(ratio):
        return f"{polar_phrase(ratio, bound):<44}"
    db, around, deg, turned = polar(ratio, bound)
    return f"{signed(db):>9} ± {around:<8} dB {signed(deg):>9} ± {turned:<8} °"


def _how_tested(m: int) -> str:
    return tr(
        "A line differs if |G₂ − G₁|², divided by the variance of both means, exceeds a limit that chance exceeds with "
        "a probability of {alpha:.2g}: 5 % for all {m} together (Bonferroni). For two runs of an unchanged machine, "
        "the probability that any line differs is at most 5 %. The variance is from the scatter between windows, with "
        "degrees of freedom by Welch and Satterthwaite.",
        alpha=ALPHA / m, m=m,
    )  # fmt: skip


def _settings(before: RunRecord, after: RunRecord) -> Section:
    """Differences between the configurations."""
    first, other = (set(_flat(recorded_configuration(run.summary))) for run in (before, after))
    rows = tuple((*key, _of(first, key), _of(other, key)) for key in sorted({line[:1] for line in first ^ other}))
    if not rows:
        return Section(tr("Settings"), (Paragraph(tr("Both runs have the same settings.")),))
    return Section(tr("Settings that differ"), (PrintedTable((tr("setting"), tr("before"), tr("after")), rows),))


def _flat(values: dict[str, Any], path: str = "") -> list[tuple[str, str]]:
    entries = []
    for name, value in values.items():
        if isinstance(value, dict):
            entries += _flat(value, f"{path}{name}.")
        elif value is not None:
            entries.append((path + name, json.dumps(value, ensure_ascii=False)))
    return entries


def _of(lines: set[tuple[str, str]], key: tuple[str, ...]) -> str:
    return next((value for name, value in lines if (name,) == key), "—")


def _row(c: QuantityChange) -> tuple[str, ...]:
    changed = with_bound(c.amount, c.bound)
    return (
        quantity_name(c.name), *with_bound(*c.before), *with_bound(*c.after), c.unit, *changed,
        number(percent(c, c.amount), "+.2g"), _seen(percent(c, c.seen) / 100), tr("yes") if c.significant else tr("no"),
    )  # fmt: skip


def _seen(share: float) -> str:
    """A detectable relative change in percent."""
    return number(100 * share, ".2g") if isfinite(share) else "—"


def run_name(run: RunRecord) -> str:
    return str(run.path.resolve().name)


def _measured(run: RunRecord, average: RunMean) -> str:
    """When a run was measured; of one without a clock, when it was written."""
    return first_page.measured_at(run, average.spans_s[0]) or written(run.path / "run.json")


def _plain_change(c: QuantityChange) -> dict[str, Any]:
    return {
        "name": c.name, "unit": c.unit, "before": c.before[0], "before_bound_95": c.before[1], "after": c.after[0],
        "after_bound_95": c.after[1], "change": c.amount, "change_bound": c.bound, "detectable": c.seen,
        "significant": c.significant,
    }  # fmt: skip


def _lines(d: Difference) -> dict[str, Any]:
    f = d.before.lines.frequency_hz
    lines = [
        {
            "frequency_hz": float(f[i]), "ratio_db": decibels(abs(d.ratio[i])),
            "ratio_deg": float(np.degrees(np.angle(d.ratio[i]))), "ratio_bound": float(d.bound[i]),
            "p": float(d.p[i]), "differs": bool(d.differs[i]),
            "ignored": bool(d.ignored[i]), "detectable": float(d.seen[i]),
        }
        for i in range(len(f))
    ]  # fmt: skip
    return {"lines": lines}


def _p(p: float) -> str:
    return number(p, ".2g") if isfinite(p) else "—"


def _span(of: RunDifferences) -> str:
    f = of.overall.before.lines.frequency_hz
    text = trn("{n:,} line, {low:g} … {high:g} Hz", "{n:,} lines, {low:g} … {high:g} Hz", len(f), low=f[0], high=f[-1])
    if not of.places:
        return text
    return text + "; " + trn(
        "{n:,} place of the schedule, forward and return counted separately",
        "{n:,} places of the schedule, forward and return counted separately",
        len(of.places),
    )  # fmt: skip
