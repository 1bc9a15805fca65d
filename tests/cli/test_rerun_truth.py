"""A command that is given again without --out loses nothing: a new directory, or the run of a machine continues."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path

import pytest

from livebode.sources.live import encode_line
from tests.support.command import livebode, signals, write_parquet
from tests.support.forked import Command
from tests.support.live_runs import axis, sent
from tests.support.peers.peer import PATIENCE_S
from tests.support.small_axis import SMALL_AXIS


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def runs() -> list[str]:
    return sorted(os.listdir("runs"))


def test_an_edited_configuration_of_a_recording_is_a_new_run(tmp_path: Path) -> None:
    log = write_parquet(tmp_path / "log.parquet", signals())
    path = axis(tmp_path, f'log = "{log}"')
    assert livebode("run", path).code == 0
    before = (tmp_path / "runs" / "axis" / "run.json").read_bytes()
    axis(tmp_path, f'log = "{log}"', SMALL_AXIS.replace("[tracking]", "[tracking]\nforgetting = 0.7"))
    again = livebode("run", path)
    assert again.code == 0, again.err
    assert "runs/axis-2/" in again.out.replace(os.sep, "/")
    assert livebode("run", path).code == 0
    assert runs() == ["axis", "axis-2", "axis-3"]
    assert (tmp_path / "runs" / "axis" / "run.json").read_bytes() == before
    named = livebode("run", path, "--out", "runs/axis")
    assert named.code != 0
    assert "exists already" in named.err
    assert livebode("run", path, "--force").code == 0
    assert runs() == ["axis", "axis-2", "axis-3"]
    assert (tmp_path / "runs" / "axis" / "run.json").read_bytes() != before


def test_a_machine_continues_its_run_and_begins_another_with_another_configuration(tmp_path: Path) -> None:
    """Also when that is given again, the run of the newest configuration continues."""

    def tracked(text: str, *, end: bool) -> int | None:
        path = axis(tmp_path, 'url = "stdin:"', text)
        with Command("run", path, "--json") as process:
            assert process.stdin is not None
            process.stdin.write(b"".join(map(encode_line, sent(1000))))
            process.stdin.flush()
            if end:
                with pytest.raises(subprocess.TimeoutExpired):
                    process.wait(2.0)
                process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE_S)
        return process.returncode

    edited = SMALL_AXIS.replace("[tracking]", "[tracking]\nforgetting = 0.7")
    assert tracked(SMALL_AXIS, end=True) == 0
    assert runs() == ["axis"]
    assert tracked(SMALL_AXIS, end=True) == 0
    assert runs() == ["axis"]
    assert tracked(edited, end=False) == 0
    assert runs() == ["axis", "axis-2"]
    assert tracked(edited, end=False) == 0
    assert runs() == ["axis", "axis-2"]
