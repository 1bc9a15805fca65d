"""Workers and coordinators that are killed, and recordings that end their process or cannot be tracked.

The result is that of a simple loop over the recordings, file for file. The long version is `make archive-faults`
(LIVEBODE_ARCHIVE_KILLS: the number of kills).
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from livebode.archive.contents import quarantine
from livebode.lake import Lake
from tests.support.archive_faults import run_with_kills
from tests.support.archives import loop, stored, write_archive, write_damaged, write_poison

KILLS = int(os.environ.get("LIVEBODE_ARCHIVE_KILLS", "3"))
SHORT = KILLS <= 3
POISON = "poison.parquet"


def test_kills_lose_nothing_and_double_nothing_and_bad_recordings_harm_no_other(tmp_path: Path) -> None:
    archive = write_archive(tmp_path / "archive", 6 if SHORT else 40, workers=1 if SHORT else 2, memory_mb=350)
    bad = {path.name for path in write_damaged(archive.parent / "plant" / "machine-001")}
    wanted = stored(loop(archive, str(tmp_path / "loop")))
    write_poison(archive.parent / "plant" / "machine-002" / POISON, 40_000_000)
    rng, killed, round_ = np.random.default_rng(16), [], 0
    while len(killed) < KILLS and not (SHORT and round_):
        lake = archive.parent / f"lake-{round_}"
        own = archive.with_name(f"archive-{round_}.toml")
        own.write_text(archive.read_text().replace('lake = "lake"', f'lake = "{lake.name}"'))
        kinds = ["worker", "coordinator", "worker"] if SHORT else rng.choice(["worker", "coordinator"], 8)
        result, done = run_with_kills(own, lake, [str(kind) for kind in kinds[: KILLS - len(killed)]], rng)
        killed += done
        round_ += 1
        found = stored(Lake(str(lake)))
        rows = {name: [row for row in table if POISON not in row] for name, table in found.rows.items()}
        assert replace(found, rows=rows) == wanted
        reasons = {Path(row["url"]).name: row["code"] for row in quarantine(Lake(str(lake)))}
        assert reasons.keys() == bad | {POISON}
        assert reasons[POISON] == "archive.memory-exceeded"
        assert result["remaining"] == 0
        assert not result["unreadable"]
        print(f"round {round_}: {', '.join(done)}: {len(found.files)} files as those of the loop")
    assert killed
    print(f"{killed.count('worker')} workers and {killed.count('coordinator')} coordinators killed in {round_} rounds")
