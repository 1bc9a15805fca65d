"""Read a record in segments, also while it is being written. Damage is reported, and everything else is read."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from pathlib import Path

from livebode.core import Event, RecordError
from livebode.language import Message
from livebode.records.inside import is_folder
from livebode.records.segments import journal
from livebode.records.segments.damage import KIND, event_of
from livebode.records.segments.journal import Commit, Journal, last_commit
from livebode.records.segments.manifest import NAME, Manifest, Segment
from livebode.records.segments.segment_file import open_segment
from livebode.tables import ParquetFile, ParquetWriter, Table

_ROWS = 1 << 14
Report = Callable[[Event], None]


def in_segments(run: Path) -> bool:
    """Whether this run is recorded in segments."""
    # Of a finished run the folder is empty, and storages at URLs have no empty directories.
    return is_folder(run / journal.FOLDER) or (run / NAME).is_file()


Rows = dict[str, list[Table]]


def parts(run: Path, report: Report, manifest_bytes: int | None) -> tuple[list[Segment], Rows]:
    """Closed segments of all tables, by age, and later rows of each that are still in a journal.

    `manifest_bytes` is the length of the manifest of a finished run, as far as it is known.
    """
    # The newest first: everything before an existing journal is complete. And before the manifest: a journal that is
    # closed in between is then in both instead of in neither.
    journals: dict[int, Journal] = {}
    for number in reversed(journal.numbers(run)):
        following = journals.get(number + 1)
        journals[number] = _read(run, number, following, report)
    found = Manifest.read(run)
    if found.is_short(list(journals)):
        message = Message(
            "{file} is damaged: its last lines are missing; the segments of journals {first} to {last} are not read",
            file=NAME,
            first=found.last_closed + 1,
            last=min(journals) - 1,
        )
        report(Event(KIND, 0, 0.0, message))
    else:
        _tell_of(found, manifest_bytes, report)
    left = [number for number in sorted(journals) if not found.is_closed(number)]
    for number in left:
        if places := journals[number].damages:
            report(event_of(journal.name_of(number), places, None))
    rows: Rows = {}
    for number in left:
        for table, batches in journals[number].rows.items():
            rows.setdefault(table, []).extend(batches)
    return found.segments, rows


def newest_commit(run: Path) -> Commit | None:
    """The newest commit of an unfinished run; None if it cannot be read."""
    try:
        return last_commit(run)
    except (RecordError, OSError):  # `parts` reports it
        return None


def tables(
    run: Path,
    table: str,
    report: Report,
    size_bytes_max: int | None,
    span_s: tuple[float, float] | None = None,
    *,
    manifest_bytes: int | None,
) -> Iterator[Table]:
    """The rows in order, part by part; with `size_bytes_max` only the newest that fit in it, with `span_s` without the
    segments outside of that time. A damaged segment is reported and skipped.

    Raises
    ------
    RecordError
        If the content of the record is not from a run.
    OSError
        If something cannot be read.
    """
    segments, rows = parts(run, report, manifest_bytes)
    segments = [segment for segment in segments if segment.table == table]
    if span_s is not None:
        segments = [segment for segment in segments if segment.first_s <= span_s[1] and segment.last_s >= span_s[0]]
    yield from _joined(run, segments if size_bytes_max is None else _newest(segments, size_bytes_max), report, span_s)
    if table in rows:
        yield Table.join(rows[table])


def _joined(run: Path, segments: list[Segment], report: Report, span_s: tuple[float, float] | None) -> Iterator[Table]:
    """The rows of segments, small ones combined, because the overhead per part is larger than that of its rows."""
    held: list[Table] = []
    for segment in segments:
        if (file := whole(run, segment, report)) is None:
            continue
        held.append(file.table(_groups_in(file, span_s)))
        if sum(table.num_rows for table in held) >= _ROWS:
            yield Table.join(held)
            held = []
    if held:
        yield Table.join(held)


def _groups_in(file: ParquetFile, span_s: tuple[float, float] | None) -> list[int]:
    """The row groups of a merged segment with rows in this span of time."""
    every = list(range(len(file.footer.groups)))
    if span_s is None or len(every) == 1:
        return every
    found = []
    for group in every:
        first_s, last_s, _ = file.footer.statistics(group, "time_s")
        if first_s is None or last_s is None or (first_s <= span_s[1] and last_s >= span_s[0]):
            found.append(group)
    return found


def whole(run: Path, segment: Segment, report: Report) -> ParquetFile | None:
    """The file of a segment, in memory; of one that was merged in the meantime the same rows. None if it is damaged,
    which is reported, or was removed to meet the budget.
    """
    try:
        return open_segment(run, segment)
    except FileNotFoundError:
        now = Manifest.read(run)
        if (place := now.place(segment.name)) is not None:
            return _part(run, segment, *place, report)
        if segment not in now.segments:
            return None  # it was removed in the meantime
        why: str = Message("the file is missing")
    except RecordError as error:
        why = error.message
    except OSError as error:
        why = str(error)
    message = Message(
        "{file} is damaged: {why}; {lost_rows} rows of {table} of samples {first} to {last} ({seconds:.4g} s) are not "
        "read",
        file=segment.name,
        why=why,
        lost_rows=segment.rows,
        table=segment.table,
        first=segment.first_sample,
        last=segment.last_sample,
        seconds=segment.last_s - segment.first_s,
    )
    samples = segment.last_sample - segment.first_sample + 1
    details = {"rows": {segment.table: segment.rows}, "samples": samples}
    report(Event(KIND, segment.first_sample, segment.first_s, message, details))
    return None


def _part(run: Path, segment: Segment, merged: Segment, before: int, report: Report) -> ParquetFile | None:
    if (file := whole(run, merged, report)) is None:
        return None
    sink = io.BytesIO()
    table = file.table().slice(before, segment.rows)
    writer = ParquetWriter(sink, table.schema)
    writer.write(table)
    writer.close()
    return ParquetFile(sink.getvalue())


def _newest(segments: list[Segment], size_bytes_max: int) -> list[Segment]:
    used, at = 0, len(segments)
    while at and (used := used + segments[at - 1].size_bytes) <= size_bytes_max:
        at -= 1
    return segments[at:]


def _read(run: Path, number: int, following: Journal | None, report: Report) -> Journal:
    try:
        return Journal.read(run, number, lambda: None if following is None else following.first)
    except FileNotFoundError:  # it was closed in the meantime
        return Journal()
    except RecordError as error:
        if error.code == "record.newer-version":
            raise
        report(Event(KIND, 0, 0.0, error.words, {"file": journal.name_of(number)}))
        return Journal()


def _tell_of(found: Manifest, whole_bytes: int | None, report: Report) -> None:
    if whole_bytes is not None and (missing := whole_bytes - found.length - len(found.torn)) > 0:
        message = Message(
            "{file} is damaged: its last {missing_bytes} bytes are missing; the segments that they name are not read",
            file=NAME,
            missing_bytes=missing,
        )
        report(Event(KIND, 0, 0.0, message))
        return
    # The end of an unfinished one is still being written, but not with zeros, which a power cut leaves.
    torn = found.torn and (whole_bytes is not None or 0 in found.torn)
    if not found.broken and not torn:
        return
    lost = ", ".join(f"{first} to {last}" for first, last in found.missing)
    what = Message("each line is written twice, so nothing is lost")
    if lost:
        what = Message("the segments of journals {journals} are not read", journals=lost)
    numbers = ", ".join(map(str, found.broken)) or Message("the last")
    message = Message("{file} is damaged in line {numbers}; {what}", file=NAME, numbers=numbers, what=what)
    report(Event(KIND, 0, 0.0, message, {"lines": found.broken}))
