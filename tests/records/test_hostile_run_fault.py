"""A run that comes from anybody: it makes nothing outside of its directory be read, changed or removed.

`make damage` takes many more manifests.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import warnings
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from livebode.core import DamageWarning, LivebodeError, RecordError
from livebode.pictures import Figure, save_svg
from livebode.records import RunDirectory, RunRecord, query, read_bytes
from livebode.records.segments.json_lines import to_line
from livebode.records.summary_file import to_document
from livebode.runtime.segmented import make_way
from tests.support.command import livebode
from tests.support.damaged import StopError, commands, make_runs, record_run
from tests.support.errors import refused
from tools.parquet_parts import parts_of

RUNS = int(os.environ.get("LIVEBODE_HOSTILE_RUNS", "6"))
SECRET = 4_242_424_242
LINKS = (
    "events.jsonl", "manifest.jsonl", "run.json", "run-copy.json", "responses", "samples", "open", "damaged",
    "responses/000001.parquet", "samples/000001.parquet", "open/000002.journal", ".run.json.partial",
    ".run-copy.json.partial", "open/.000003.journal.partial", ".pictures.partial", "bode.svg",
)  # fmt: skip


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return make_runs(tmp_path_factory.mktemp("whole"))


def outside(folder: Path) -> Path:
    """What is nobody's business: a run, files under the names that a run has, and a thesis."""
    place = folder / "outside"
    for inner in ("responses", "samples", "open", "deep/er"):
        (place / inner).mkdir(parents=True)
    rows = pa.table({"sample": pa.array([SECRET]), "time_s": [0.0], "w": [0.0]})
    for name in ("responses/000001.parquet", "samples/000001.parquet", "x.parquet", "deep/er/000009.parquet"):
        pq.write_table(rows, place / name, compression="lz4")
    for name in ("thesis.tex", "open/000001.journal", "open/000002.journal", "events.jsonl", "run.json"):
        (place / name).write_text("years of work\n")
    return place


def state_of(place: Path) -> dict[str, tuple[bytes, int]]:
    return {
        str(path): (path.read_bytes() if path.is_file() else b"", path.stat().st_mtime_ns)
        for path in sorted(place.rglob("*"))
    }


def hostile_name(rng: np.random.Generator, place: Path) -> str:
    target = ["thesis.tex", "x.parquet", "responses/000001.parquet", "samples/000001.parquet"][rng.integers(4)]
    names = [
        f"../outside/{target}", f"{place}/{target}", f"responses/../../outside/{target}", f"./../outside/{target}",
        f"responses/{'../' * int(rng.integers(1, 40))}{target}", "/dev/zero", "/etc/passwd", f"file://{place}/{target}",
        "RESPONSES/000001.parquet", "responses/000001.PARQUET", "responses//000001.parquet", "responses\\1.parquet",
        "responses/000001.parquet\0", f"link/{target}", "a" * int(rng.integers(255, 100_000)), "", ".", "..", "~/x",
        "responses/١.parquet", "%2e%2e/outside/thesis.tex", "responses/000001.parquet/../../../outside/thesis.tex",
    ]  # fmt: skip
    return names[rng.integers(len(names))]


def change_value(rng: np.random.Generator, values: dict[str, Any]) -> None:
    """Replace one of the values."""
    key = list(values)[rng.integers(len(values))]
    values[key] = [None, -1, 1 << 80, "x", [], {}, 1e400, True][rng.integers(8)]


def hostile_lines(rng: np.random.Generator, place: Path, honest: list[dict[str, Any]]) -> bytes:
    """The manifest with names changed, whose checksums are right all the same."""
    lines = [json.loads(json.dumps(line)) for line in honest]
    for line in lines:
        for segment in line.get("segments", []):
            kind = rng.integers(5)
            if kind == 0:
                segment["name"] = hostile_name(rng, place)
            elif kind == 1:
                segment["table"] = hostile_name(rng, place)
            elif kind == 2:
                change_value(rng, segment)
            elif kind == 3:
                change_value(rng, segment["parts"][rng.integers(len(segment["parts"]))])
    lines.append({"removed": [hostile_name(rng, place) for _ in range(3)], "size_bytes": 1})
    lines.append({"closed": [7, -3, 1 << 70, "../x", None][rng.integers(5)], "segments": [{"name": "../x"}]})
    return b"".join(to_line(line) * 2 for line in lines)


def make_hostile(run: Path, place: Path, rng: np.random.Generator) -> None:
    manifest = run / "manifest.jsonl"
    if manifest.exists():
        honest = [json.loads(line) for line in manifest.read_text().splitlines()[::2]]
        for line in honest:
            del line["crc32"]
        manifest.write_bytes(hostile_lines(rng, place, honest))
    (run / "link").symlink_to(place)
    for name in rng.choice(LINKS, int(rng.integers(1, 4)), replace=False):
        path = run / name
        if not path.parent.is_dir() or path.parent.is_symlink():
            continue
        with contextlib.suppress(FileNotFoundError):
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
        kind = rng.integers(4)
        if kind == 0:
            os.mkfifo(path)
        elif kind == 1:
            path.symlink_to("/dev/zero")
        else:
            aim = place / Path(str(name)).name
            path.symlink_to(aim if aim.exists() else place / "thesis.tex")


def attempts(run: Path, folder: Path) -> list[Callable[[], Any]]:
    return [
        lambda: [
            table
            for name in ("responses", "samples", "parameters")
            for table in map(pa.table, RunRecord.open(run).tables(name))
        ],
        lambda: RunRecord.open(run).events(),
        lambda: query(RunRecord.open(run), "FROM samples", 100_000).rows,
        *commands(run, folder).values(),
        lambda: record_run(run),
        lambda: make_way(run),
        lambda: RunDirectory(run, force=True).__enter__(),
    ]


def test_hostile_runs_touch_nothing_outside(tmp_path: Path, runs: dict[str, Path]) -> None:
    rng, refused = np.random.default_rng(3), 0
    for number in range(RUNS):
        folder = tmp_path / "each"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        place = outside(folder)
        before = state_of(place)
        shutil.copytree(runs["killed" if number % 3 else "piece"], folder / "run")
        make_hostile(folder / "run", place, rng)
        for attempt in attempts(folder / "run", folder):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", DamageWarning)
                try:
                    assert str(SECRET) not in str(attempt())
                except (LivebodeError, StopError):
                    refused += 1
        assert state_of(place) == before, number
    print(f"{RUNS} hostile runs: {refused} sentences, 0 files outside touched")


def test_force_removes_only_what_livebode_wrote(tmp_path: Path, runs: dict[str, Path]) -> None:
    for name, run in runs.items():
        other = tmp_path / name
        shutil.copytree(run, other)
        (other / "thesis.tex").write_text("years of work")
        inner = "open/" if (other / "open").exists() else ""
        (other / f"{inner}notes.txt").write_text("mine")
        for call in (make_way, lambda path: RunDirectory(path, force=True).__enter__()):
            with refused(RecordError, "foreign-files", path=str(other), files=[f"{inner}notes.txt", "thesis.tex"]):
                call(other)
        (other / "thesis.tex").unlink()
        next(other.rglob("notes.txt")).unlink()
        make_way(other)
        assert not other.exists()


def test_continuing_removes_no_file_that_it_did_not_write(tmp_path: Path, runs: dict[str, Path]) -> None:
    shutil.copytree(runs["killed"], tmp_path / "run")
    mine = [tmp_path / "run" / name for name in ("mine/2024.parquet", "responses/1999.parquet", ".mine.partial")]
    for path in mine:
        path.parent.mkdir(exist_ok=True)
        path.write_text("mine")
    record_run(tmp_path / "run")
    assert [path.read_text() for path in mine] == ["mine"] * 3
    assert RunRecord.open(tmp_path / "run").finished


def test_continuing_does_not_wait_at_a_pipe_in_place_of_the_pictures(tmp_path: Path, runs: dict[str, Path]) -> None:
    shutil.copytree(runs["killed"], tmp_path / "run")
    os.mkfifo(tmp_path / "run" / ".pictures.partial")
    with refused(RecordError, "not-own-file", path=str(tmp_path / "run" / ".pictures.partial")):
        record_run(tmp_path / "run")


def test_a_directory_in_place_of_a_file_is_refused_and_not_left_open(tmp_path: Path) -> None:
    (tmp_path / "tune.json").mkdir()
    before = os.listdir("/proc/self/fd")
    with refused(RecordError, "not-own-file", path=str(tmp_path / "tune.json")):
        read_bytes(tmp_path, "tune.json")
    assert os.listdir("/proc/self/fd") == before


def test_a_picture_replaces_a_link_and_not_what_it_names(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    (tmp_path / "margins.svg").symlink_to(tmp_path / "thesis.tex")
    save_svg(Figure("", (), (), (), 100.0), tmp_path / "margins.svg")
    assert (tmp_path / "thesis.tex").read_text() == "years of work"
    assert not (tmp_path / "margins.svg").is_symlink()


def test_a_segment_that_expands_beyond_reason_is_named_and_left_out(
    tmp_path: Path, runs: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    run = tmp_path / "run"
    shutil.copytree(runs["segments"], run)
    lines = [json.loads(line) for line in (run / "manifest.jsonl").read_text().splitlines()[::2]]
    segment = next(s for s in lines[1]["segments"] if s["table"] == "samples")
    n = 1 << 18
    monkeypatch.setattr("livebode.records.segments.segment_file._VALUES_MAX", 1 << 20)
    zeros = pa.DictionaryArray.from_arrays(pa.array(np.zeros(n, np.int8)), pa.array([0.0]))
    columns = [pa.chunked_array([zeros])] * 5
    pq.write_table(pa.table(dict(zip("abcde", columns))), run / segment["name"], compression="zstd")
    content = (run / segment["name"]).read_bytes()
    segment["parts"] = json.loads(json.dumps([asdict(part) for part in parts_of(run / segment["name"])]))
    for line in lines:
        del line["crc32"]
    (run / "manifest.jsonl").write_bytes(b"".join(to_line(line) * 2 for line in lines))
    assert len(content) < n // 8
    with pytest.warns(DamageWarning, match="more than a segment can have"):
        assert sum(table.num_rows for table in map(pa.table, RunRecord.open(run).tables("samples"))) < 2600


@pytest.mark.parametrize("seed", range(2))
def test_a_broken_summary_ends_in_a_sentence(tmp_path: Path, runs: dict[str, Path], seed: int) -> None:
    rng = np.random.default_rng(seed)
    run = tmp_path / "run"
    shutil.copytree(runs["piece" if seed % 2 else "segments"], run)
    (run / "run-copy.json").unlink()
    whole = json.loads((run / "run.json").read_text())
    del whole["crc32"]
    texts = [b'{"found": ' * 100_000, b"[" * 1_000_000, b'{"a": ' + b"9" * 50_000 + b"}", b"\xff\xfe", b"null", b""]
    arguments: list[tuple[object, ...]] = [
        ("export", run, "--sql", "SELECT count(*) FROM responses"), ("fit", run), ("margins", run),
        ("export", run, "--to", "csv", "--out", tmp_path / "a.csv", "--force"), ("report", run),
    ]  # fmt: skip
    documents = [to_document(_broken(json.loads(json.dumps(whole)), rng)) for _ in range(RUNS // 2)]
    for data in [*texts, *documents]:
        (run / "run.json").write_bytes(data)
        asked = arguments[:1] if data in texts else arguments
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DamageWarning)
            for one in asked:
                done = livebode(*one)
                assert "Traceback" not in done.err, (one[0], data[:4000])
                assert done.code in (0, 2, 3)


def test_a_run_without_its_number_of_samples_is_reported(tmp_path: Path, runs: dict[str, Path]) -> None:
    run = tmp_path / "run"
    shutil.copytree(runs["piece"], run)
    (run / "run-copy.json").unlink()
    whole = json.loads((run / "run.json").read_text())
    del whole["crc32"]
    (run / "run.json").write_bytes(to_document(whole | {"counts": whole["counts"] | {"samples": None}}))
    assert livebode("report", run).code == 0
    last = RunRecord.open(run).responses().sample[-1]
    assert f"{last + 1:,}" in (run / "report.html").read_text()


def _broken(summary: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """The summary with one value somewhere in it replaced, or left out."""
    place: Any = summary
    while True:
        keys = list(place) if isinstance(place, dict) else list(range(len(place)))
        key = keys[rng.integers(len(keys))]
        inner = place[key]
        if isinstance(inner, dict | list) and inner and rng.random() < 0.8:
            place = inner
            continue
        values: list[Any] = [None, -1, 0, 1 << 80, 1e308, "", "x", [], {}, [None], {"a": 1}, True]
        choice = int(rng.integers(len(values) + 1))
        if choice == len(values) and isinstance(place, dict):
            del place[key]
        else:
            place[key] = values[choice % len(values)]
        return summary
