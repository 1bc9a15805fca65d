"""Rows that are recorded but not yet safe on the disk, and rows that had to be dropped."""

from __future__ import annotations

from livebode.dataclass import dataclass
from livebode.records.segments.frames import ROWS, to_frame
from livebode.tables import Table, to_message


@dataclass(frozen=True)
class _UnsyncedFrame:
    table: str
    frame: bytes
    rows: int
    first_sample: int
    last_sample: int


class UnsyncedRows:
    """Rows since the journal was last synced. After a failure they are written again, or dropped and counted.

    Parameters
    ----------
    tables
        Names, in the order of the journal's schemas.

    Attributes
    ----------
    rows
        Rows of each table since the run began, without dropped ones.
    lost
        Number, first and last sample of the dropped rows, for each table.
    """

    def __init__(self, tables: tuple[str, ...]) -> None:
        self._tables = tables
        self.rows = dict.fromkeys(tables, 0)
        self._new: dict[str, list[Table]] = {}
        self._parts: list[_UnsyncedFrame] = []
        self._written = 0
        self.lost: dict[str, dict[str, int]] = {}

    def add(self, table: str, batch: Table) -> None:
        if batch.num_rows:
            self._new.setdefault(table, []).append(batch)

    def gather(self) -> None:
        """Create one frame for each table from the added rows."""
        for table, batches in self._new.items():
            batch = Table.join(batches)
            sample = batch["sample"]
            frame = to_frame(ROWS, to_message(batch), table=self._tables.index(table))
            self.rows[table] += batch.num_rows
            self._parts.append(_UnsyncedFrame(table, frame, batch.num_rows, int(sample.min()), int(sample.max())))
        self._new.clear()

    @property
    def held_bytes(self) -> int:
        return sum(len(part.frame) for part in self._parts)

    def unwritten(self) -> list[bytes]:
        """Frames that are not in the journal."""
        return [part.frame for part in self._parts[self._written :]]

    def written(self) -> int:
        """They are in the journal now; so many are not known to be safe."""
        self._written = len(self._parts)
        return self._written

    def safe(self, parts: int) -> None:
        """The journal was synced with so many of them in it."""
        del self._parts[:parts]
        self._written -= parts

    def failed(self, bytes_max: int) -> None:
        """Rows since the last sync count as not written; drop all of them if they are more than this."""
        self._written = 0
        if self.held_bytes <= bytes_max:
            return
        for part in self._parts:
            sum_ = self.lost.setdefault(part.table, {"rows": 0, "first_sample": part.first_sample})
            sum_["rows"] += part.rows
            self.rows[part.table] -= part.rows
            sum_["last_sample"] = part.last_sample
        self._parts.clear()

    def drain_lost(self) -> dict[str, dict[str, int]]:
        lost, self.lost = self.lost, {}
        return lost
