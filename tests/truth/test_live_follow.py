"""A table that grows gives what the whole table gives; a directory of recordings gives what all of them give."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np
import pytest

from livebode.nouns import InputError
from livebode.sources import open_log
from livebode.sources.live import LiveBlock, SourceSettings, open_source
from tests.command import RATE_HZ, signals, write_csv, write_parquet
from tests.peers.peer import PATIENCE_S, Feeding

SAMPLES = 600


def received(path: Path, last: float, **more: object) -> tuple[list[LiveBlock], dict[str, int]]:
    """Blocks until a sample at time `last` (s) came, and the counts of events."""
    with open_source(SourceSettings(log=path, follow=True, timeout_s=PATIENCE_S, **more)) as source:
        timer = threading.Timer(PATIENCE_S, source.stop)
        timer.start()
        blocks = []
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


def test_a_table_that_is_replaced_is_a_restart(tmp_path):
    raw = write_csv(tmp_path / "whole.csv", signals(SAMPLES)).read_bytes()
    path = tmp_path / "log.csv"
    path.write_bytes(raw)

    def script() -> None:
        time.sleep(0.5)
        (tmp_path / "next.csv").write_bytes(raw.replace(b"\n0.599", b"\n0.599"))
        (tmp_path / "next.csv").rename(path)
        grown(path, b"".join(b"%.3f,0,0,0\n" % (n / RATE_HZ) for n in range(SAMPLES, 2 * SAMPLES)), 10)

    with Feeding(script):
        blocks, counts = received(path, (2 * SAMPLES - 1) / RATE_HZ)
    assert counts["restart"] == 1
    assert [block.start for block in blocks if block.gap] == [SAMPLES]
    assert sum(map(len, blocks)) == 3 * SAMPLES


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
    with pytest.raises(InputError, match="parquet, which cannot grow; follow a directory of whole files instead"):
        open_source(SourceSettings(log=path, follow=True, timeout_s=0.5))
