"""Archives of small recordings, what a simple loop makes of them, and what is in a lake."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from deltalake import DeltaTable
from distributed import LocalCluster

from livebode_plant.archive.archive_settings import ArchiveSettings
from livebode_plant.archive.archived_recordings import (
    ArchivedRecording,
    HashedContent,
    RecordingPlace,
    each_result,
    find_places,
    known_contents,
    untracked,
)
from livebode_plant.archive.coordinator import Committer, Coordinator, Progress
from livebode_plant.archive.tasks import Job, handle
from livebode_plant.lake import TABLES, Lake

_RATE_HZ, _WINDOW, _LINES = 4000, 400, np.array([20.0, 40.0, 60.0, 100.0])
RECIPE = """
[signals]
excitation = "w"
input = "u"
output = "y"
[lines]
frequencies = "20, 40, 60, 100"
window = 400
[tracking]
hop = 400
[fit]
model = "rigid"
"""
DATA = ("responses", "covariance", "parameters", "events")


def write_recording(path: Path, seed: int, periods: int = 8, machine: int | None = None) -> None:
    """A recording of a rigid axis with noise; another seed is another machine, unless its number is given."""
    rng = np.random.default_rng(seed)
    t = np.arange(periods * _WINDOW) / _RATE_HZ
    w = np.sin(2 * np.pi * _LINES[:, None] * t + rng.uniform(0, 6, (len(_LINES), 1))).sum(axis=0)
    u = w + 0.01 * rng.standard_normal(len(t))
    y = np.cumsum(u) / _RATE_HZ / (
        0.01 + 0.0001 * (seed if machine is None else machine)
    ) + 0.001 * rng.standard_normal(len(t))
    _write(path, {"t": t, "w": w, "u": u, "y": y - y.mean()})


def write_damaged(folder: Path) -> list[Path]:
    """Recordings that cannot be tracked: cut off, no recording at all, other channels, and no excitation."""
    cut, junk, other, silent = (
        folder / name for name in ("cut.parquet", "junk.parquet", "other.parquet", "zero.parquet")
    )
    write_recording(cut, 900)
    cut.write_bytes(cut.read_bytes()[:-200])
    junk.write_bytes(np.random.default_rng(901).bytes(4000))
    _write(other, {"t": np.arange(2000) / _RATE_HZ, "position": np.zeros(2000)})
    _write(silent, {name: np.arange(4000) / _RATE_HZ if name == "t" else np.zeros(4000) for name in "twuy"})
    return [cut, junk, other, silent]


def write_poison(path: Path, rows: int) -> None:
    """A recording of some kilobytes whose reader needs rows·8 bytes at once: a column is one page."""
    table = pa.table({name: np.zeros(rows) for name in "wuy"}).replace_schema_metadata({"rate_hz": str(_RATE_HZ)})
    pq.write_table(
        table, path, compression="zstd", use_dictionary=False, data_page_size=1 << 31, row_group_size=rows,
        write_batch_size=rows, max_rows_per_page=rows,
    )  # fmt: skip


def write_archive(folder: Path, recordings: int, **cluster: Any) -> Path:
    """archive.toml with recordings of as many machines, one of which is there twice; the lake is in `lake`."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "recipe.toml").write_text(RECIPE)
    for seed in range(recordings):
        own = folder / "plant" / f"machine-{seed:03}"
        own.mkdir(parents=True)
        write_recording(own / "log.parquet", seed)
    (folder / "plant" / "machine-000" / "copy.parquet").write_bytes(
        (folder / "plant" / f"machine-{recordings - 1:03}" / "log.parquet").read_bytes()
    )
    lines = "".join(f"{key} = {value!r}\n" for key, value in cluster.items())
    path = folder / "archive.toml"
    path.write_text(
        'inputs = ["plant/{machine}/*.parquet"]\nrecipe = "recipe.toml"\nlake = "lake"\n[cluster]\n' + lines
    )
    return path


def silent(progress: Progress) -> None:
    """Nobody looks."""


def coordinator(archive: Path, **over: Any) -> Coordinator:
    """A coordinator of this archive."""
    return Coordinator(ArchiveSettings.read(archive).model_copy(update=over), silent)


def loop(archive: Path, lake: str) -> Lake:
    """What a simple loop over the recordings that the lake does not have stores; nothing in it is distributed."""
    settings, into = ArchiveSettings.read(archive), Lake(lake)
    job = Job.of(settings.axes(), lake, 10**12, settings.baselines)
    contents = contents_of(job, find_places(settings.templates))
    committer = Committer(into, job)
    committer.add(HashedContent(place, content) for place, content in contents)
    committer.add(each_result(handle(job, untracked(contents, job.recipes, into.keys("runs")))))
    committer.commit()
    assert set(known_contents(into)[0].values()) >= {content for _, content in contents}
    return into


def contents_of(job: Job, places: list[RecordingPlace]) -> list[tuple[RecordingPlace, str]]:
    """The content at each place."""
    found = each_result(handle(job, [ArchivedRecording(place) for place in places]))
    return [(one.place, one.content) for one in found if isinstance(one, HashedContent)]


@dataclass(frozen=True)
class Stored:
    """What counts in a lake: checksums of the data files, and the rows of the small tables in one order."""

    files: dict[str, str]
    rows: dict[str, list[str]]


def stored(lake: Lake) -> Stored:
    """Files and rows of a lake on this computer, except what differs between two lakes: the times of commits."""
    files = {f"{name}/{Path(uri).name}": _sha256(Path(uri)) for name in DATA for uri in _uris(lake, name)}
    small = [name for name in TABLES if name not in DATA]
    return Stored(files, {name: sorted(map(repr, lake.read(name).to_pylist())) for name in small})


def _uris(lake: Lake, name: str) -> Iterator[str]:
    if DeltaTable.is_deltatable(f"{lake.url}/tables/{name}"):
        yield from DeltaTable(f"{lake.url}/tables/{name}").file_uris()


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _write(path: Path, columns: dict[str, Any]) -> None:
    pq.write_table(pa.table(columns), path)


@contextmanager
def cluster_here() -> Iterator[str]:
    """The address of a cluster with one worker, a thread of this process."""
    with LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        processes=False,
        host="127.0.0.1",
        protocol="tcp://",
        dashboard_address="127.0.0.1:0",
    ) as cluster:
        yield cluster.scheduler_address
