"""The journal of a record compared with an SQLite database in WAL mode, for the same commits.

`python -m bench.decisions.journal [COMMITS]`: cost and bytes of a commit, what a kill loses, and what one flipped bit
does. A commit is the rows of 0.25 s of one axis (5 responses of 21 lines, 1,000 samples of 3 channels) with 60 kB of
state, as bench/record.py measures them.
"""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

from livebode.records import FOLDER, AppendFile, ColumnTable, to_frame
from livebode.records.segments.frames import ROWS
from livebode.records.segments.journal import Commit, Journal, head, name_of
from livebode.tables import Table, from_message, to_message

STATE, SAMPLES, RESPONSES, LINES, SYNC_S = 60_000, 1000, 5, 21, 1.0
KILLS, FLIPS = 10, 200
_RNG = np.random.default_rng(0)


def batch(first: int, rows: int, columns: int) -> Table:
    values = {f"c{i}": _RNG.standard_normal(rows) for i in range(columns)}
    return Table.of({"sample": np.arange(first, first + rows), **values})


def rows(commit: int) -> dict[str, Table]:
    return {
        "samples": batch(commit * SAMPLES, SAMPLES, 3),
        "responses": batch(commit * SAMPLES, RESPONSES, 6 * LINES),
    }


def values(of: Table) -> bytes:
    """Everything in the rows."""
    return b"".join(of[name].tobytes() for name in of.column_names)


class ByJournal:
    """Appended frames; synced each second by the caller, as the Store does in a thread."""

    def __init__(self, run: Path) -> None:
        (run / FOLDER).mkdir(parents=True)
        tables = {name: ColumnTable(of.schema) for name, of in rows(0).items()}
        begin = head(tables, Commit(0, 0.0, 0.0, 0, {"tracker": b""}))
        (run / name_of(1)).write_bytes(begin)
        self._file = AppendFile(run, name_of(1), len(begin))

    def commit(self, number: int, state: bytes) -> None:
        frames = [to_frame(ROWS, body(of), table=i) for i, of in enumerate(rows(number).values())]
        at = (number + 1) * SAMPLES
        done = Commit(at, at / 4000, 0.0, 0, {"tracker": state}, {"samples": at, "responses": (number + 1) * RESPONSES})
        self._file.append(b"".join([*frames, done.to_frame()]))

    def sync(self) -> None:
        self._file.sync()


def body(of: Table) -> bytes:
    return to_message(of)


class BySqlite:
    """One transaction for each commit, with the same Arrow bytes; NORMAL waits for the disk at checkpoints only."""

    def __init__(self, run: Path, synchronous: str = "NORMAL") -> None:
        run.mkdir(parents=True)
        self._base = sqlite3.connect(run / "run.db", isolation_level=None)
        self._base.execute("PRAGMA journal_mode=WAL")
        self._base.execute(f"PRAGMA synchronous={synchronous}")
        self._base.execute("CREATE TABLE parts (number INTEGER, name TEXT, rows BLOB)")
        self._base.execute("CREATE TABLE state (one INTEGER PRIMARY KEY, number INTEGER, state BLOB)")

    def commit(self, number: int, state: bytes) -> None:
        self._base.execute("BEGIN")
        for name, of in rows(number).items():
            self._base.execute("INSERT INTO parts VALUES (?, ?, ?)", (number, name, body(of)))
        self._base.execute("INSERT OR REPLACE INTO state VALUES (1, ?, ?)", (number, state))
        self._base.execute("COMMIT")

    def sync(self) -> None:
        self._base.execute("PRAGMA wal_checkpoint(PASSIVE)")


MAKERS: dict[str, Callable[[Path], ByJournal | BySqlite]] = {
    "journal": ByJournal, "SQLite WAL, NORMAL": BySqlite, "SQLite WAL, FULL": lambda run: BySqlite(run, "FULL"),
}  # fmt: skip


def state() -> bytes:
    return _RNG.bytes(STATE)


def written_bytes() -> int:
    """Bytes that this process has given to the system's storage."""
    return int(next(s for s in Path("/proc/self/io").read_text().splitlines() if s.startswith("wchar")).split()[1])


def speed(folder: Path, commits: int) -> None:
    for name, make in MAKERS.items():
        store, spent, longest = make(folder / name), 0.0, 0.0
        before, states = written_bytes(), [state() for _ in range(20)]
        for number in range(commits):
            began, wall = time.process_time(), time.perf_counter()
            store.commit(number, states[number % 20])
            if number % 4 == 3:
                store.sync()
            spent += time.process_time() - began
            longest = max(longest, time.perf_counter() - wall)
        size = sum(path.stat().st_size for path in (folder / name).rglob("*") if path.is_file())
        written = (written_bytes() - before) / commits
        print(f"  {name:20} {1e3 * spent / commits:6.2f} ms of the processor, {written / 1e3:6.0f} kB written, "
              f"{size / commits / 1e3:6.0f} kB on the disk for each, longest {1e3 * longest:.0f} ms")  # fmt: skip


def child(name: str, folder: str) -> None:
    """Commit until killed; the number of each finished commit goes to standard output."""
    store, number, one = MAKERS[name](Path(folder)), 0, state()
    while True:
        store.commit(number, one)
        os.write(1, b"%d\n" % number)
        number += 1


def last(name: str, run: Path) -> tuple[int, bool]:
    """Number of the last commit that can be read, and whether all rows before it can."""
    if name == "journal":
        found = Journal.read(run, 1)
        assert found.commit is not None
        stored = sum(part.num_rows for part in found.rows.get("samples", []))
        return found.commit.sample // SAMPLES - 1, stored == found.commit.sample and not found.damages
    base = sqlite3.connect(run / "run.db")
    (number,) = base.execute("SELECT number FROM state").fetchone() or (-1,)
    stored = base.execute("SELECT number, rows FROM parts WHERE name = 'samples' ORDER BY number").fetchall()
    whole = [part for part, _ in stored] == list(range(number + 1))
    base.close()
    return number, whole


def kills(folder: Path) -> None:
    for name in ("journal", "SQLite WAL, NORMAL"):
        lost, broken = Counter[int](), 0
        for kill in range(KILLS):
            run = folder / f"{name} {kill}"
            command = [sys.executable, "-m", "bench.decisions.journal", name, str(run)]
            process = subprocess.Popen(command, stdout=subprocess.PIPE)
            assert process.stdout is not None
            seen = [process.stdout.readline() for _ in range(10 + 7 * kill)]
            process.send_signal(signal.SIGKILL)
            seen += process.stdout.read().splitlines()
            process.wait()
            number, whole = last(name, run)
            lost[int(seen[-1]) - number] += 1
            broken += not whole
        print(f"  {name:20} {KILLS} kills: commits lost that were reported as done: {dict(lost)} (-1: the one after "
              f"it was done too), records with a hole: {broken}")  # fmt: skip


def flips(folder: Path, commits: int = 40) -> None:
    for name in ("journal", "SQLite WAL, NORMAL"):
        run = folder / "flip" / name
        store = MAKERS[name](run)
        for number in range(commits):
            store.commit(number, state())
        store.sync()
        del store
        path = run / (name_of(1) if name == "journal" else "run.db")
        whole, true = path.read_bytes(), reads(name, run)
        found = Counter[str]()
        for _ in range(FLIPS):
            raw = bytearray(whole)
            raw[_RNG.integers(len(raw))] ^= 1 << int(_RNG.integers(8))
            path.write_bytes(raw)
            found[judged(name, run, true)] += 1
        print(f"  {name:20} {FLIPS} flips: {dict(found.most_common())}")


def reads(name: str, run: Path) -> tuple[list[bytes], bytes, int]:
    """Rows of the samples, the newest state, and number of reported damages."""
    if name == "journal":
        found = Journal.read(run, 1)
        parts = [values(part) for part in found.rows.get("samples", [])]
        return parts, found.commit.states["tracker"] if found.commit else b"", len(found.damages)
    base, schema = sqlite3.connect(run / "run.db"), rows(0)["samples"].schema
    try:
        bad = base.execute("PRAGMA integrity_check").fetchone() != ("ok",)
        stored = base.execute("SELECT rows FROM parts WHERE name = 'samples' ORDER BY number").fetchall()
        return (
            [values(from_message(memoryview(part), schema)) for (part,) in stored],
            base.execute("SELECT state FROM state").fetchone()[0],
            int(bad),
        )
    finally:
        base.close()


def judged(name: str, run: Path, true: tuple[list[bytes], bytes, int]) -> str:
    try:
        parts, newest, damages = reads(name, run)
    except Exception:
        return "reported, nothing can be read"
    good = set(true[0])
    if any(part not in good for part in parts) or (newest != true[1] and not damages):
        return "wrong data, reported" if damages else "WRONG DATA, NOT REPORTED"
    return "the rest read, reported" if damages else "no effect on the data"


def main() -> None:
    if len(sys.argv) == 3:
        child(*sys.argv[1:])
    commits = int(sys.argv[1]) if len(sys.argv) > 1 else 400
    with tempfile.TemporaryDirectory(dir=os.environ.get("LIVEBODE_BENCH_DIRECTORY")) as folder:
        print(f"{commits} commits of 0.25 s, synced once a second")
        speed(Path(folder), commits)
        print("killed while it commits as fast as it can")
        kills(Path(folder))
        print("one bit flipped in the file")
        flips(Path(folder))


if __name__ == "__main__":
    main()
