"""A lake on S3: two coordinators at once store each result once, by conditional puts."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import deltalake
import pyarrow as pa
import pytest

from livebode.locations import Url, find, write_whole
from livebode_plant.archive.archive_settings import ArchiveSettings
from livebode_plant.archive.archived_recordings import HashedContent, TrackedResult, each_result, find_places, untracked
from livebode_plant.archive.coordinator import Committer
from livebode_plant.archive.tasks import Job, handle
from livebode_plant.lake import DataFile, Lake
from livebode_plant.lake.table_directory import delta_options
from tests.support.archives import contents_of, write_archive
from tests.support.object_storage import BUCKET, object_storage

LAKE, RECORDINGS = f"s3://{BUCKET}/lake", 2


@pytest.fixture(scope="module")
def s3() -> Iterator[str]:
    with object_storage() as address:
        yield address


@pytest.mark.usefixtures("s3")
def test_two_coordinators_lose_nothing_and_double_nothing(tmp_path: Path) -> None:
    archive = write_archive(tmp_path, RECORDINGS)
    for path in (tmp_path / "plant").rglob("*.parquet"):
        write_whole(f"s3://{BUCKET}/{path.relative_to(tmp_path).as_posix()}", path.read_bytes())
    text = archive.read_text().replace('"plant/', f'"s3://{BUCKET}/plant/').replace('"lake"', f'"{LAKE}"')
    archive.write_text(text)
    settings = ArchiveSettings.read(archive)
    job = Job.of(settings.axes(), settings.lake, 10**12)
    contents = contents_of(job, find_places(settings.templates))
    results = each_result(handle(job, untracked(contents, job.recipes, set())))

    def coordinator(order: int) -> list[DataFile]:
        lake = Lake(LAKE)
        for result in [*(HashedContent(*one) for one in contents), *results[::order]]:
            committer = Committer(lake, job)
            committer.add([result])
            committer.commit()
        return [file for result in results if isinstance(result, TrackedResult) for file in result.files]

    with ThreadPoolExecutor() as pool:
        written, _ = pool.map(coordinator, (1, -1))
    lake = Lake(LAKE)
    assert len(lake.read("runs")) == len(lake.keys("runs")) == RECORDINGS
    assert {row["machine"] for row in lake.read("files").to_pylist()} == {f"machine-{n:03}" for n in range(RECORDINGS)}
    assert lake.read("files").num_rows == RECORDINGS + 1  # one is a copy
    assert {name: lake.read(name).num_rows for name in ("responses", "parameters", "events")} == {
        name: sum(file.rows for file in written if file.table == name) for name in ("responses", "parameters", "events")
    }
    assert len(find(f"{LAKE}/tables/responses/*.parquet")) == RECORDINGS


def test_delta_tables_have_the_options_of_the_same_storage(s3: str) -> None:
    table, url = pa.table({"run": [1, 2]}), Url(f"s3://{BUCKET}/lake/runs")
    assert delta_options(url) == {"aws_endpoint_url": s3, "aws_allow_http": "true"}
    for _ in range(2):
        deltalake.write_deltalake(str(url), table, mode="append", storage_options=delta_options(url))
    assert deltalake.DeltaTable(str(url), storage_options=delta_options(url)).to_pyarrow_table().num_rows == 4
    assert delta_options(Path("lake")) == {}
