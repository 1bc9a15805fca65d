"""A cluster by SSH with mutual TLS: a real sshd, and a worker of it that is killed."""

from __future__ import annotations

from pathlib import Path

import psutil
import pytest
import trustme

from livebode_plant.archive.archive_settings import ArchiveSettings
from livebode_plant.archive.coordinator import Coordinator, Progress
from livebode_plant.lake import Lake
from tests.support.archives import loop, stored, write_archive
from tests.support.certificates import certified
from tests.support.ssh_server import ssh_server


def test_a_worker_that_is_killed_on_another_computer_is_replaced_and_nothing_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    archive = write_archive(tmp_path / "archive", 6)
    wanted = stored(loop(archive, str(tmp_path / "loop")))
    files = certified(tmp_path / "tls", trustme.CA())
    cluster = {"kind": "ssh", "hosts": ["127.0.0.1"] * 2} | {name: str(path) for name, path in files.items()}
    archive.write_text(archive.read_text() + "".join(f"{key} = {value!r}\n" for key, value in cluster.items()))
    killed: list[int] = []
    with ssh_server(tmp_path) as (server, home):
        monkeypatch.setenv("HOME", str(home))

        def kill_once(progress: Progress) -> None:
            if progress.stage == "tracking" and progress.done and not killed:
                for process in psutil.Process(server).children(recursive=True):
                    if "multiprocessing.spawn" in " ".join(process.cmdline()):
                        process.kill()
                        killed.append(process.pid)

        outcome = Coordinator(ArchiveSettings.read(archive), kill_once).run()
    assert killed
    assert (outcome.tracked, outcome.quarantined, outcome.unreadable, outcome.remaining) == (6, [], [], 0)
    assert stored(Lake(str(archive.parent / "lake"))) == wanted
