"""Workers and coordinators that are killed, and recordings that end their process or cannot be tracked.

The result is that of a simple loop over the recordings, file for file. The long version is `make archive-faults`
(LIVEBODE_ARCHIVE_KILLS: the number of kills).
"""

from __future__ import annotations

import os
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from livebode_plant.archive.contents import quarantine
from livebode_plant.lake import Lake
from tests.support.archive_faults import run_with_kills
from tests.support.archives import Stored, loop, stored, write_archive, write_damaged, write_poison

KILLS = int(os.environ.get("LIVEBODE_ARCHIVE_KILLS", "2"))
SHORT = KILLS <= 2
IN_A_ROUND, AT_ONCE = 12, 2
"""Kills of one archive, and archives at once: a kill is mostly waiting for processes to start."""
POISON = "poison.parquet"


def test_kills_lose_nothing_and_double_nothing_and_bad_recordings_harm_no_other(tmp_path: Path) -> None:
    archive = write_archive(tmp_path / "archive", 4 if SHORT else 40, workers=1 if SHORT else 2, memory_mb=350)
    bad = {path.name for path in write_damaged(archive.parent / "plant" / "machine-001")}
    wanted = stored(loop(archive, str(tmp_path / "loop")))
    write_poison(archive.parent / "plant" / "machine-002" / POISON, 40_000_000)
    killed: list[str] = []
    rounds = 0
    with ThreadPoolExecutor(AT_ONCE) as threads:
        while len(killed) < KILLS and not (SHORT and rounds):
            plans = _plans(rounds, KILLS - len(killed))
            for done in threads.map(lambda plan: _round(archive, *plan, wanted, bad), plans):
                killed += done
            rounds += len(plans)
    assert killed
    print(f"{killed.count('worker')} workers and {killed.count('coordinator')} coordinators killed in {rounds} rounds")


def _plans(first: int, left: int) -> list[tuple[int, list[str]]]:
    """Numbers of the next rounds, and what they kill."""
    if SHORT:
        return [(0, ["worker", "coordinator"])]
    sizes = [min(IN_A_ROUND, left - IN_A_ROUND * index) for index in range(AT_ONCE)]
    return [
        (number, np.random.default_rng([16, number]).choice(["worker", "worker", "coordinator"], size).tolist())
        for number, size in enumerate(sizes, start=first)
        if size > 0
    ]


def _round(archive: Path, number: int, kinds: list[str], wanted: Stored, bad: set[str]) -> list[str]:
    """An archive into a lake of its own while processes are killed; compares it with the loop, returns the kills."""
    lake = archive.parent / f"lake-{number}"
    own = archive.with_name(f"archive-{number}.toml")
    own.write_text(archive.read_text().replace('lake = "lake"', f'lake = "{lake.name}"'))
    began_s = time.monotonic()
    result, done = run_with_kills(own, lake, kinds, np.random.default_rng([17, number]))
    found = stored(Lake(str(lake)))
    rows = {name: [row for row in table if POISON not in row] for name, table in found.rows.items()}
    assert replace(found, rows=rows) == wanted
    reasons = {Path(row["url"]).name: row["code"] for row in quarantine(Lake(str(lake)))}
    assert reasons.keys() == bad | {POISON}
    assert reasons[POISON] == "archive.memory-exceeded"
    assert result["remaining"] == 0
    assert not result["unreadable"]
    took_s = time.monotonic() - began_s
    print(
        f"round {number}, {took_s:.0f} s: {', '.join(done)}: {len(found.files)} files as those of the loop", flush=True
    )
    return done
