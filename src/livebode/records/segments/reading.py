"""Read a record, also while it is being written. Damage is reported, and everything else is read."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import BinaryIO

from livebode.core import Event, RecordError
from livebode.language import Message
from livebode.records.segments import journal
from livebode.records.segments.damage import KIND, event_of
from livebode.records.segments.journal import Commit, Journal, last_commit
from livebode.records.segments.manifest import NAME, Manifest, Segment
from livebode.records.segments.segment_file import SegmentFile
from livebode.tables import ParquetWriter, Table

_ROWS = 1 << 14
Report = Callable[[Event], None]
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
    manifest = read_manifest(run, report)
    if manifest is None:
        manifest = Manifest()
    elif manifest.is_short(list(journals)):
        message = Message(
            "{file} is damaged: its last lines are missing; the segments of journals {first} to {last} are not read",
            file=NAME,
            first=manifest.last_closed + 1,
            last=min(journals) - 1,
        )
        report(Event(KIND, 0, 0.0, message))
    else:
        _tell_of(manifest, manifest_bytes, report)
    left = [number for number in sorted(journals) if not manifest.is_closed(number)]
    for number in left:
        if places := journals[number].damages:
            report(event_of(journal.name_of(number), places, None))
    rows: Rows = {}
    for number in left:
        for table, batches in journals[number].rows.items():
            rows.setdefault(table, []).extend(batches)
    return manifest.segments, rows


def read_manifest(run: Path, report: Report) -> Manifest | None:
    """The manifest of a run; None if it is missing, which is reported. Other errors as of `Manifest.read`."""
    try:
        return Manifest.read(run)
    except FileNotFoundError:
        report(Event(KIND, 0, 0.0, Message("{file} is damaged: the file is missing", file=NAME)))
        return None


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
    if size_bytes_max is not None:
        pieces = list(_newest(segments, size_bytes_max))
    else:
        pieces = [(segment, range(segment.rows)) for segment in segments]
    yield from _joined(run, pieces, report, span_s)
    if table in rows:
        yield Table.join(rows[table])


def _newest(segments: list[Segment], size_bytes_max: int) -> Iterator[tuple[Segment, range]]:
    """The newest row groups that fit in so many bytes, as rows of their segments, by age."""
    pieces: list[tuple[Segment, range]] = []
    for segment in reversed(segments):
        first = segment.rows
        for part in reversed(segment.parts):
            size_bytes_max -= part.size_bytes
            if size_bytes_max < 0:
                break
            first -= part.rows
        if first < segment.rows:
            pieces.append((segment, range(first, segment.rows)))
        if size_bytes_max < 0:
            break
    return reversed(pieces)


def _joined(
    run: Path, pieces: Iterable[tuple[Segment, range]], report: Report, span_s: tuple[float, float] | None
) -> Iterator[Table]:
    """The rows of segments, small parts combined, because the overhead per part is larger than that of its rows."""
    held: list[Table] = []
    for segment, rows in pieces:
        if span_s is not None and not _overlap((segment.first_s, segment.last_s), span_s):
            continue
        for table in segment_rows(run, segment, report, span_s, rows):
            held.append(table)
            if sum(table.num_rows for table in held) >= _ROWS:
                yield Table.join(held)
                held = []
    if held:
        yield Table.join(held)


def _overlap(extremes_s: tuple[float | None, float | None], span_s: tuple[float, float]) -> bool:
    first_s, last_s = extremes_s
    return first_s is None or last_s is None or (first_s <= span_s[1] and last_s >= span_s[0])


def segment_rows(
    run: Path,
    segment: Segment,
    report: Report,
    span_s: tuple[float, float] | None = None,
    rows: range | None = None,
) -> Iterator[Table]:
    """The intact row groups of a segment: with `span_s` those within that time, with `rows` only these rows.

    Of a segment that was merged in the meantime the same rows. Damage is reported; none are yielded if it was removed
    to meet the budget.
    """
    for file, group, part in _intact_groups(run, segment, report, span_s, rows):
        yield file.rows(group).slice(part.start, len(part))


def check_segment(run: Path, segment: Segment, report: Report) -> int:
    """Number of rows in the intact row groups of a segment. Damage is reported."""
    return sum(len(part) for _, _, part in _intact_groups(run, segment, report))


def _intact_groups(
    run: Path,
    segment: Segment,
    report: Report,
    span_s: tuple[float, float] | None = None,
    rows: range | None = None,
) -> Iterator[tuple[SegmentFile, int, range]]:
    """File and number of the row groups in `segment_rows`, and the rows to read of each."""
    rows = range(segment.rows) if rows is None else rows
    try:
        opened = SegmentFile(run, segment)
    except FileNotFoundError:
        now = Manifest.read(run)
        if (place := now.place(segment.name)) is not None:
            merged, before = place
            yield from _intact_groups(run, merged, report, span_s, range(before + rows.start, before + rows.stop))
        elif segment in now.segments:
            _report_segment(segment, Message("the file is missing"), report)
        return
    except (OSError, RecordError) as error:
        _report_segment(segment, error.message if isinstance(error, RecordError) else str(error), report)
        return
    with opened:
        stop = 0
        for group, intact in enumerate(opened.intact):
            begin, stop = stop, stop + segment.parts[group].rows
            part = range(max(begin, rows.start) - begin, min(stop, rows.stop) - begin)
            if not part or (span_s is not None and not _overlap(opened.extremes(group, "time_s"), span_s)):
                continue
            if intact:
                yield opened, group, part
            else:
                _report_group(segment, group, opened, report)


def intact_file(run: Path, segment: Segment, report: Report) -> BinaryIO | None:
    """A Parquet file with the intact rows of a segment, to be closed: its own, or a copy without what is damaged.

    None if nothing is intact. Damage is reported.
    """
    with contextlib.suppress(OSError, RecordError):
        opened = SegmentFile(run, segment)
        if all(opened.intact):
            return opened.file
        opened.file.close()
    tables = segment_rows(run, segment, report)
    first = next(tables, None)
    if first is None:
        return None
    copy: BinaryIO = tempfile.TemporaryFile()  # noqa: SIM115 - the caller closes it
    writer = ParquetWriter(copy, first.schema)
    for table in (first, *tables):
        writer.write(table)
    writer.close()
    copy.seek(0)
    return copy


def _report_segment(segment: Segment, reason: str, report: Report) -> None:
    first, last = (segment.first_sample, segment.first_s), (segment.last_sample, segment.last_s)
    report(_damage(segment, reason, segment.rows, first, last))


def _report_group(segment: Segment, group: int, file: SegmentFile, report: Report) -> None:
    (first, last), (first_s, last_s) = (file.extremes(group, column) for column in ("sample", "time_s"))
    begin = segment.first_sample if first is None else int(first), segment.first_s if first_s is None else first_s
    end = segment.last_sample if last is None else int(last), segment.last_s if last_s is None else last_s
    reason = Message("its checksum differs from the manifest")
    report(_damage(segment, reason, segment.parts[group].rows, begin, end))


def _damage(segment: Segment, reason: str, rows: int, first: tuple[int, float], last: tuple[int, float]) -> Event:
    """The event: these rows, of the samples and times of `first` to `last`, are not read."""
    message = Message(
        "{file} is damaged: {why}; {lost_rows} rows of {table} of samples {first} to {last} ({seconds:.4g} s) are not "
        "read",
        file=segment.name,
        why=reason,
        lost_rows=rows,
        table=segment.table,
        first=first[0],
        last=last[0],
        seconds=last[1] - first[1],
    )
    details = {"rows": {segment.table: rows}, "samples": last[0] - first[0] + 1}
    return Event(KIND, *first, message, details)


def _read(run: Path, number: int, following: Journal | None, report: Report) -> Journal:
    try:
        return Journal.read(run, number, lambda: None if following is None else following.first)
    except FileNotFoundError:  # it was closed in the meantime
        return Journal()
    except RecordError as error:
        if error.code in ("record.newer-version", "record.older-version"):
            raise
        report(Event(KIND, 0, 0.0, error.words, {"file": journal.name_of(number)}))
        return Journal()


def _tell_of(manifest: Manifest, whole_bytes: int | None, report: Report) -> None:
    if whole_bytes is not None and (missing := whole_bytes - manifest.length - len(manifest.torn)) > 0:
        message = Message(
            "{file} is damaged: its last {missing_bytes} bytes are missing; the segments that they name are not read",
            file=NAME,
            missing_bytes=missing,
        )
        report(Event(KIND, 0, 0.0, message))
        return
    # The end of an unfinished one is still being written, but not with zeros, which a power cut leaves.
    torn = manifest.torn and (whole_bytes is not None or 0 in manifest.torn)
    if not manifest.broken and not torn:
        return
    lost = ", ".join(f"{first} to {last}" for first, last in manifest.missing)
    what = Message("each line is written twice, so nothing is lost")
    if lost:
        what = Message("the segments of journals {journals} are not read", journals=lost)
    numbers = ", ".join(map(str, manifest.broken)) or Message("the last")
    message = Message("{file} is damaged in line {numbers}; {what}", file=NAME, numbers=numbers, what=what)
    report(Event(KIND, 0, 0.0, message, {"lines": manifest.broken, "journals": manifest.missing}))
