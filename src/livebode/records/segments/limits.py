"""How a record in segments is cut, and what it may use."""

from __future__ import annotations

from dataclasses import dataclass

JOURNALS = 3
"""What stands beside closed segments, each of a journal's size: one that is turned, what becomes of it, the next."""


@dataclass(frozen=True)
class Limits:
    """How a record is cut.

    Attributes
    ----------
    interval_samples, interval_s
        A commit is due when either has gone by since the last one; every `interval_s` one is synced to the disk.
    segment_samples
        A segment is closed after so many samples, or when the journal has `journal_bytes`.
    budget_bytes
        What the record may use, but for events, which are never removed; None for no bound.
    held_bytes
        Rows that are kept in memory while the disk takes none; above it they are given up and counted.
    """

    interval_samples: int
    segment_samples: int
    interval_s: float = 0.5
    budget_bytes: int | None = None
    journal_bytes: int = 32 << 20
    held_bytes: int = 32 << 20

    @property
    def journal_bytes_max(self) -> int:
        """An eighth of the budget at most, so that journals and what becomes of them stand side by side within it."""
        return self.journal_bytes if self.budget_bytes is None else min(self.journal_bytes, self.budget_bytes // 8)
