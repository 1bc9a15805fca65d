"""A table that grows gives what the whole table gives; a directory of recordings gives what all of them give."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np
import pytest

from livebode.core import Event, SourceError
from livebode.runtime.continuing import StreamPosition
from livebode.sources import open_log
from livebode.sources.live import LiveBlock, SourceSettings, make_source, open_source
from tests.support.command import RATE_HZ, signals, write_csv, write_parquet
from tests.support.errors import refused
from tests.support.peers.peer import PATIENCE_S, Feeding, until

SAMPLES = 600


def received(
    path: Path, last: float, blocks: list[LiveBlock] | None = None, **more: object
) -> tuple[list[LiveBlock], dict[str, int]]:
    """Blocks until a sample at time `last` (s) came, appended to `blocks` as they come, and the counts of events."""
    blocks = [] if blocks is None else blocks
    with open_source(SourceSettings(log=path, follow=True, timeout_s=PATIENCE_S, **more)) as source:
        timer = threading.Timer(PATIENCE_S, source.stop)
        timer.start()
        for block in source.blocks():
            blocks.append(block)
            if block["t"][-1] >= last - 1e-9:
                break
        timer.cancel()
        counts = {kind: count for kind, count in source.health.counts.items() if count}
    assert blocks[-1]["t"][-1] == pytest.approx(last)
    return blocks, counts


def grown(path: Path, raw: bytes, cuts: int, seed: int = 0) -> None:
    """Writes `raw` piece by piece, cut anywhere."""
    at = sorted(np.random.default_rng(seed).integers(0, len(raw), cuts).tolist())
    with path.open("ab", buffering=0) as file:
        for a, b in zip([0, *at], [*at, len(raw)]):
            file.write(raw[a:b])
            time.sleep(0.002)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
@pytest.mark.parametrize("delimiter", [",", ";"])
def test_a_growing_table_gives_what_the_whole_gives(tmp_path, encoding, delimiter):
    whole = write_csv(tmp_path / "whole.csv", signals(SAMPLES))
    text = whole.read_text()
    raw = (text.replace(",", ";").replace(".", ",") if delimiter == ";" else text).encode(encoding)
    path = tmp_path / "log.csv"
    with Feeding(lambda: grown(path, raw, 150)):
        blocks, counts = received(path, (SAMPLES - 1) / RATE_HZ)
    truth = np.concatenate([block.data for block in open_log(whole).blocks(["t", "w", "u", "y"])], axis=1)
    np.testing.assert_array_equal(np.concatenate([block.data for block in blocks], axis=1), truth)
    assert blocks[0].rate_hz == RATE_HZ
    assert counts == {"connected": 1}


def test_missing_and_damaged_rows_are_gaps(tmp_path):
    lines = write_csv(tmp_path / "whole.csv", signals(SAMPLES)).read_bytes().splitlines(keepends=True)
    lines[500] = b"0.499,rubbish,1,2\n"
    kept = lines[:451] + lines[461:]  # rows 450 to 459 are missing
    path = tmp_path / "log.csv"
    path.write_bytes(b"".join(kept[:440]))
    with Feeding(lambda: grown(path, b"".join(kept[440:]), 20)):
        blocks, counts = received(path, (SAMPLES - 1) / RATE_HZ)
    assert [block.start for block in blocks if block.gap] == [460, 500]
    assert counts == {"connected": 1, "loss": 2, "malformed": 1}
    for block in blocks:
        np.testing.assert_allclose(block["t"] * RATE_HZ, np.arange(block.start, block.stop), atol=1e-6)


def test_a_table_that_is_replaced_by_another_is_a_restart(tmp_path):
    raw = write_csv(tmp_path / "whole.csv", signals(SAMPLES)).read_bytes()
    path = tmp_path / "log.csv"
    path.write_bytes(raw)
    blocks: list[LiveBlock] = []

    def script() -> None:
        until(lambda: sum(map(len, blocks)) == SAMPLES, "the whole table")
        (tmp_path / "next.csv").write_bytes(raw.replace(b"0.0,", b"0.0,-", 1))
        (tmp_path / "next.csv").rename(path)
        grown(path, b"".join(b"%.3f,0,0,0\n" % (n / RATE_HZ) for n in range(SAMPLES, 2 * SAMPLES)), 10)

    with Feeding(script):
        _, counts = received(path, (2 * SAMPLES - 1) / RATE_HZ, blocks)
    assert counts == {"connected": 2, "replaced": 1, "restart": 1}
    assert [block.start for block in blocks if block.gap] == [SAMPLES]
    assert sum(map(len, blocks)) == 3 * SAMPLES


def test_a_table_that_is_replaced_by_a_longer_copy_of_itself_continues(tmp_path):
    """As programs do that copy a log again and again."""
    raw = write_csv(tmp_path / "whole.csv", signals(2 * SAMPLES)).read_bytes()
    path = tmp_path / "log.csv"
    half = raw[: raw.index(b"\n", len(raw) // 2) - 5]
    path.write_bytes(half)
    blocks: list[LiveBlock] = []

    def script() -> None:
        until(lambda: sum(map(len, blocks)) == half.count(b"\n") - 1, "its whole lines")
        (tmp_path / "next.csv").write_bytes(raw)
        (tmp_path / "next.csv").rename(path)

    with Feeding(script):
        _, counts = received(path, (2 * SAMPLES - 1) / RATE_HZ, blocks)
    assert counts.keys() == {"connected"}
    np.testing.assert_array_equal(np.concatenate([block["t"] for block in blocks]), np.arange(2 * SAMPLES) / RATE_HZ)


def test_a_directory_of_recordings_is_read_in_order(tmp_path):
    columns = signals(SAMPLES)
    folder = tmp_path / "segments"
    folder.mkdir()

    def script() -> None:
        for part in (0, 1, 3, 4, 5):  # part 2 is lost
            cut = {name: values[part * 100 : (part + 1) * 100] for name, values in columns.items()}
            write_parquet(folder / f".{part}.parquet", cut).rename(folder / f"{part}.parquet")
            time.sleep(0.05)

    with Feeding(script):
        blocks, counts = received(folder, (SAMPLES - 1) / RATE_HZ)
    assert [(block.start, block.gap) for block in blocks if block.gap] == [(300, True)]
    assert counts == {"connected": 1, "loss": 1}
    found = np.concatenate([block["y"] for block in blocks])
    np.testing.assert_array_equal(found, np.delete(columns["y"], np.arange(200, 300)))


def test_a_file_that_cannot_grow_is_refused(tmp_path):
    path = write_parquet(tmp_path / "log.parquet", signals(SAMPLES))
    with refused(SourceError, "no-samples", cause="source.cannot-grow", timeout_s=0.5):
        open_source(SourceSettings(log=path, follow=True, timeout_s=0.5))


class Record:
    """What a record of a followed file or directory holds, over processes that each end at any sample."""

    def __init__(self, path: Path, **more: object) -> None:
        self.settings = SourceSettings(log=path, follow=True, timeout_s=PATIENCE_S, **more)
        self.t, self.number, self.events, self._state = np.zeros(0), np.zeros(0), [], b""

    def take(self, until_t: float, cut: int = 0) -> list[Event]:
        """Record until time `until_t`, without the last `cut` samples of the Block; what happened meanwhile."""
        position = StreamPosition(self._state)
        source = make_source(self.settings)
        if position.left_at is not None:
            source.resume(position.left_at)
        with source.open():
            timer = threading.Timer(PATIENCE_S, source.stop)
            timer.start()
            for block in source.blocks(["t"]):
                done = block["t"][-1] >= until_t - 1e-9
                kept = block.cut(0, len(block) - cut) if done else block
                position.take(kept)
                self.t = np.append(self.t, kept["t"])
                self.number = np.append(self.number, np.arange(kept.start, kept.stop))
                if done:
                    break
            timer.cancel()
            self._state = position.snapshot()
            return source.take_events()


COUNTED = {"rate_hz": float(RATE_HZ), "time": "none"}


def lines_of(first: int, last: int, sign: str = "") -> bytes:
    return b"".join(b"%.3f,%s1,2,3\n" % (n / RATE_HZ, sign.encode()) for n in range(first, last))


HEAD = b"t,w,u,y\n"


@pytest.mark.parametrize("more", [{}, COUNTED], ids=["timed", "counted"])
@pytest.mark.parametrize("cut", [0, 77])
def test_a_followed_file_continues_with_the_very_next_sample(tmp_path, more, cut):
    path = tmp_path / "log.csv"
    record = Record(path, **more)
    for turn in range(4):
        with path.open("ab") as file:
            file.write((b"" if turn else HEAD) + lines_of(300 * turn, 300 * (turn + 1)))
        events = record.take((300 * (turn + 1) - 1) / RATE_HZ, cut if turn < 3 else 0)
        assert [e.kind for e in events] == (["resumed", "connected"] if turn else ["connected"])
    np.testing.assert_array_equal(record.t, np.arange(1200) / RATE_HZ)
    np.testing.assert_array_equal(record.number, np.arange(1200))


@pytest.mark.parametrize("more", [{}, COUNTED], ids=["timed", "counted"])
@pytest.mark.parametrize("longer", [False, True])
def test_a_file_that_was_replaced_while_it_was_not_followed_is_named_and_read_whole(tmp_path, more, longer):
    path = tmp_path / "log.csv"
    record = Record(path, **more)
    path.write_bytes(HEAD + lines_of(0, 300))
    record.take(299 / RATE_HZ)
    rows = 900 if longer else 200
    path.write_bytes(HEAD + lines_of(0, rows, "-"))
    events = record.take((rows - 1) / RATE_HZ)
    assert [e.kind for e in events] == ["resumed", "replaced", "connected", "restart"]
    assert "truncated or replaced" in events[1].message
    np.testing.assert_array_equal(record.t, np.r_[np.arange(300), np.arange(rows)] / RATE_HZ)
    np.testing.assert_array_equal(record.number, np.arange(300 + rows))


@pytest.mark.parametrize("more", [{}, COUNTED], ids=["timed", "counted"])
def test_a_file_that_lost_its_end_is_not_recorded_twice(tmp_path, more):
    """As after a power cut, when the record was on the disk and the end of the log was not."""
    path = tmp_path / "log.csv"
    record = Record(path, **more)
    path.write_bytes(HEAD + lines_of(0, 300))
    record.take(299 / RATE_HZ)
    with path.open("ab") as file:
        file.write(lines_of(300, 600))
    record.take(599 / RATE_HZ)
    path.write_bytes(HEAD + lines_of(0, 560) + lines_of(560, 700, "-"))
    events = record.take(699 / RATE_HZ)
    assert [e.kind for e in events] == ["resumed", "replaced", "connected"]
    assert "changed before byte" in events[1].message
    np.testing.assert_array_equal(record.t, np.arange(700) / RATE_HZ)
    np.testing.assert_array_equal(record.number, np.arange(700))


def put(folder: Path, part: int, sign: str = "") -> Path:
    path = folder / f"{part}.csv"
    path.write_bytes(HEAD + lines_of(100 * part, 100 * (part + 1), sign))
    return path


@pytest.mark.parametrize("more", [{}, COUNTED], ids=["timed", "counted"])
@pytest.mark.parametrize("cut", [0, 33])
@pytest.mark.parametrize("removed", [False, True])
def test_a_followed_directory_continues_with_the_very_next_sample(tmp_path, more, cut, removed):
    folder = tmp_path / "segments"
    folder.mkdir()
    record = Record(folder, **more)
    for turn in range(3):
        paths = [put(folder, part) for part in (2 * turn, 2 * turn + 1)]
        record.take((200 * (turn + 1) - 1) / RATE_HZ, cut if turn < 2 else 0)
        for path in paths[: 2 if cut == 0 else 1] if removed else []:
            path.unlink()
    np.testing.assert_array_equal(record.t, np.arange(600) / RATE_HZ)
    np.testing.assert_array_equal(record.number, np.arange(600))


@pytest.mark.parametrize("more", [{}, COUNTED], ids=["timed", "counted"])
@pytest.mark.parametrize("changed", [False, True])
def test_a_recording_that_is_gone_or_changed_before_it_was_read_whole_is_named(tmp_path, more, changed):
    folder = tmp_path / "segments"
    folder.mkdir()
    record = Record(folder, **more)
    path = put(folder, 0)
    record.take(99 / RATE_HZ, cut=30)
    path.write_bytes(HEAD + lines_of(0, 100, "-")) if changed else path.unlink()
    put(folder, 1)
    events = record.take(199 / RATE_HZ)
    # By a column of time the loss is exact; without one how much was lost is not known.
    known = ["resumed", "replaced", "connected", "restart" if more else "loss"]
    assert [e.kind for e in events] == known
    np.testing.assert_array_equal(record.t, np.r_[np.arange(70), np.arange(100, 200)] / RATE_HZ)
    np.testing.assert_array_equal(record.number, np.arange(170) if more else np.r_[np.arange(70), np.arange(100, 200)])
