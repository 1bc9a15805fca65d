"""The comparison of two matrix runs: each entry as two runs, all of them tested together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from livebode.configuration import ReportSection
from livebode.core import Document, Finding, GridError, Section, Tone
from livebode.dataclass import dataclass
from livebode.estimates import MATRIX, rule
from livebode.language import tr, worded
from livebode.records import RunRecord
from livebode.simulation import Gantry
from livebode_reports import first_page
from livebode_reports.compare_report import TONES_OF_A_COMPARISON, Comparison, run_name
from livebode_reports.comparison_verdict import detectable
from livebode_reports.wording import pairs


@dataclass(frozen=True, eq=False)
class MatrixComparison:
    """The comparisons of the entries that two matrix runs have in common, by name.

    The probability of a false claim at any line of any entry is at most 5 %.
    """

    entries: Mapping[str, Comparison]
    whole: tuple[str, ...]
    """Sentences about all entries together: which one changed most, or which part of a described machine."""

    @classmethod
    def of(
        cls,
        first: Path,
        second: Path,
        *,
        ignore_below: float = 0.0,
        gantry: Gantry | None = None,
        cart_m: tuple[float, float] | None = None,
    ) -> MatrixComparison:
        """Read and compare the matrix runs in two directories; `gantry` and `cart_m` as in `compare_gantries`.

        Raises
        ------
        GridError
            If they have no entry or no line in common.
        SignalError
            If an entry has no valid response.
        """
        before, after = (RunRecord.open(path, matrix=True) for path in (first, second))
        common = [name for name in before.entries if name in after.entries]
        if not common:
            raise GridError(
                "not-alike",
                f"the runs have no entry in common: {', '.join(before.entries)}, and {', '.join(after.entries)}",
                "compare runs of the same signals",
                what="entries",
                values=[list(before.entries), list(after.entries)],
            )
        pairs = {name: (before.entry(*before.entries[name]), after.entry(*after.entries[name])) for name in common}
        together = len(common)
        return cls(
            {
                name: Comparison.between(*pair, ignore_below=ignore_below, together=together)
                for name, pair in pairs.items()
            },
            rule(MATRIX, "changes")(before.matrix(), after.matrix(), gantry, cart_m),
        )

    @property
    def later(self) -> RunRecord:
        """The run after the change."""
        return next(iter(self.entries.values())).later

    @property
    def printed(self) -> Iterator[str]:
        """Verdicts and tables for the terminal."""
        yield from self.sentences
        yield from (f"\n{table}" for table in self.tables)

    @property
    def sentences(self) -> list[str]:
        """The verdicts on all entries, those that differ first."""
        order = sorted(self.entries, key=lambda name: not self.entries[name].differences.overall.differs.any())
        each = [f"{name}: {finding.text}" for name in order for finding in self.entries[name].sentences]
        return [*self.whole, *each]

    @property
    def tables(self) -> list[str]:
        """Tables of the entries that differ, each under its name."""
        return [
            "\n\n".join([f"{name}:", *comparison.tables])
            for name, comparison in self.entries.items()
            if comparison.differences.overall.differs.any()
        ]

    def document(self, made: datetime, *, header: ReportSection, appendix: bool = False) -> Document:
        """The report: the verdict on all entries, and each entry with its picture and its lines.

        Parameters
        ----------
        made
            Time of the report.
        header
            The first page. Its limits apply to one response, so they are judged in the report of an entry.
        appendix
            Add the settings that differ.
        """
        named = sorted(self.entries.items(), key=lambda item: not item[1].differences.overall.differs.any())
        first, *others = (comparison for _, comparison in named)
        runs = tr(
            "{before} and {after}",
            before=run_name(first.differences.runs[0]),
            after=run_name(first.differences.runs[1]),
        )
        title = header.machine or runs
        findings = [
            Finding(f.tone, f"{_arrow(name)}: {f.text}") for name, comparison in named for f in comparison.sentences
        ]
        tone: Tone = "differs" if first.differences.overall.differs.any() else "ok"
        findings = [*(Finding(tone, f"{worded(sentence)}.") for sentence in self.whole), *findings]
        return Document(
            kind=tr("Before and after"),
            title=title,
            facts=first_page.facts(header, title, first.facts(*others), made),
            verdict=tuple(findings),
            sections=(*(_section(name, comparison) for name, comparison in named), first.how(), first.events()),
            foot=" · ".join(filter(None, (title, header.serial_number, header.company))),
            heading=tr("What changed"),
            tones=TONES_OF_A_COMPARISON,
            result=first_page.result(findings),
            signatures=first_page.signatures(header),
            appendix=(*_all_lines(named), *(first.appendix() if appendix else ())),
            logo=first_page.logo_of(header),
            paper=header.paper,
            made=made,
        )

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "entries": {name: comparison.plain() for name, comparison in self.entries.items()},
            "differing": [
                name for name, comparison in self.entries.items() if comparison.differences.overall.differs.any()
            ],
            "sentences": self.sentences,
        }


def _all_lines(named: Sequence[tuple[str, Comparison]]) -> Iterator[Section]:
    """Both responses at each line, for each entry."""
    for name, comparison in named:
        section = comparison.response()
        yield Section(f"{_arrow(name)}: {section.title}", section.parts)


def _arrow(name: str) -> str:
    """An entry as in the report of a matrix run: "output ← input"."""
    return name.replace("/", " ← ")


def _section(name: str, comparison: Comparison) -> Section:
    """Picture, smallest detectable change and lines of an entry, under its name."""
    seen = detectable(comparison.differences.overall)
    least = (pairs([(tr("smallest detectable change of a line"), seen)]),) if seen else ()
    differing = comparison.differing()
    return Section(_arrow(name), (comparison.picture(), *least, *(differing.parts if differing else ())))
