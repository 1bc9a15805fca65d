"""Mutual TLS: a scheduler takes tasks from who has a certificate of its authority, and from nobody else.

A cluster that loses its workers or its scheduler ends an archive with a sentence.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
import trustme
from distributed import LocalCluster, Security

from livebode import ArchiveError
from livebode_plant.archive import clusters, distribution
from livebode_plant.archive.archive_settings import ClusterSection
from livebode_plant.archive.archived_recordings import ArchivedRecording, RecordingPlace
from livebode_plant.archive.distribution import RecordingGroups
from tests.support.certificates import certified


@pytest.fixture
def scheduler(tmp_path: Path) -> Iterator[tuple[str, dict[str, Path]]]:
    files = certified(tmp_path / "ours", trustme.CA())
    each = {f"tls_{role}_{name}": str(files[file]) for role in ("scheduler", "worker", "client")
            for name, file in (("cert", "certificate"), ("key", "key"))}  # fmt: skip
    security = Security(tls_ca_file=str(files["authority"]), require_encryption=True, **each)
    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, host="tls://127.0.0.1", protocol="tls://",
        security=security, dashboard_address="127.0.0.1:0",
    ) as cluster:  # fmt: skip
        yield cluster.scheduler_address, files


def test_who_has_a_certificate_is_served_and_who_has_another_is_not(
    scheduler: tuple[str, dict[str, Path]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    address, files = scheduler
    with clusters.started(ClusterSection(address=address, **files)) as cluster:
        assert cluster.workers == 1
        assert cluster.client.submit(sum, (1, 2)).result() == 3
    monkeypatch.setattr(clusters, "_CONNECT_S", 1)
    strangers = certified(tmp_path / "strangers", trustme.CA())
    with (
        pytest.raises(ArchiveError, match="does not answer") as caught,
        clusters.started(ClusterSection(address=address, **strangers)),
    ):
        pass
    assert caught.value.code == "archive.cluster-unreachable"


@pytest.mark.parametrize(("lost", "code"), [("workers", "workers-lost"), ("scheduler", "cluster-lost")])
def test_a_cluster_that_is_lost_ends_with_a_sentence(lost: str, code: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "_CONNECT_S", 1)
    monkeypatch.setattr(distribution, "_NO_WORKER_S", 0.3 if lost == "workers" else 60)
    monkeypatch.setattr(distribution, "_COUNT_AGAIN_S", 0.1)
    items = [ArchivedRecording(RecordingPlace(Path(str(number)), 1, "")) for number in range(50)]
    with (
        LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, host="127.0.0.1", protocol="tcp://",
            dashboard_address="127.0.0.1:0",
        ) as local,
        clusters.started(ClusterSection(address=local.scheduler_address)) as cluster,
    ):  # fmt: skip
        done = distribution.Distribution[ArchivedRecording, int](
            cluster, RecordingGroups(items), _zeros, lambda *_: 0, lambda _: False, lambda _: 0
        ).results()
        assert [result for _, result in next(done)] == [0]
        local.scale(0) if lost == "workers" else local.close()
        with pytest.raises(ArchiveError, match="the same command continues") as caught:
            for _ in done:
                pass
    assert caught.value.code == f"archive.{code}"


def _zeros(items: Sequence[ArchivedRecording], scratch: Path) -> list[int]:  # noqa: ARG001
    return [0] * len(items)
