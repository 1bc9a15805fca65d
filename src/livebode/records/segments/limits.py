"""Sizes and disk budget of a record with a journal."""

from __future__ import annotations

from livebode.dataclass import dataclass

JOURNALS = 3
"""Files next to closed segments, each of a journal's size: the converted journal, its segments, the next journal."""


@dataclass(frozen=True)
class SegmentLimits:
    """Sizes of a record with a journal.

    Attributes
    ----------
    interval_samples, interval_s
        A commit is due when either has passed since the last one; every `interval_s` one is synced to the disk.
    segment_samples
        A segment is closed after so many samples, or when the journal has `journal_bytes`.
    budget_bytes
        Disk budget of the record without events, which are never removed; None for no limit.
    held_bytes
        Rows that wait in memory while the disk accepts none; above this they are dropped and counted.
    """

    interval_samples: int
    segment_samples: int
    interval_s: float = 0.5
    budget_bytes: int | None = None
    journal_bytes: int = 32 << 20
    held_bytes: int = 32 << 20

    @property
    def journal_bytes_max(self) -> int:
        """At most an eighth of the budget, so that journals and their segments fit in it at the same time."""
        return self.journal_bytes if self.budget_bytes is None else min(self.journal_bytes, self.budget_bytes // 8)
