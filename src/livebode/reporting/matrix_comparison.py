"""The comparison of two matrix runs: each entry as two runs, all of them tested together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from livebode.core import GridError
from livebode.records import RunRecord
from livebode.reporting.compare_report import Comparison


@dataclass(frozen=True, eq=False)
class MatrixComparison:
    """The comparisons of the entries that two matrix runs have in common, by name.

    The probability of a false claim at any line of any entry is at most 5 %.
    """

    entries: Mapping[str, Comparison]

    @classmethod
    def of(cls, before: RunRecord, after: RunRecord, *, ignore_below: float = 0.0) -> MatrixComparison:
        """Read and compare two matrix runs.

        Raises
        ------
        GridError
            If they have no entry or no line in common.
        SignalError
            If an entry has no valid response.
        """
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
            }
        )

    @property
    def sentences(self) -> list[str]:
        """The verdicts on all entries, those that differ first."""
        order = sorted(self.entries, key=lambda name: not self.entries[name].found.overall.differs.any())
        return [f"{name}: {finding.text}" for name in order for finding in self.entries[name].sentences]

    @property
    def tables(self) -> list[str]:
        """Tables of the entries that differ, each under its name."""
        return [
            "\n\n".join([f"{name}:", *comparison.tables])
            for name, comparison in self.entries.items()
            if comparison.found.overall.differs.any()
        ]

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "entries": {name: comparison.plain() for name, comparison in self.entries.items()},
            "differing": [name for name, one in self.entries.items() if one.found.overall.differs.any()],
            "sentences": self.sentences,
        }


def both_matrices(before: Path, after: Path) -> tuple[RunRecord, RunRecord] | None:
    """Two matrix runs; None if one of them is another run."""
    runs = RunRecord.open(before, matrix=True), RunRecord.open(after, matrix=True)
    return runs if all(run.is_matrix for run in runs) else None
