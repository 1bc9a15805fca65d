"""What works without POSIX (docs/how-to/windows.md), in a process that hides what Windows does not have."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from livebode.interface import write_examples
from tests.support.peers.peer import PATIENCE_S

ROOT = Path(__file__).parents[2]
ROLES = ("--excitation", "w", "--input", "u", "--output", "velocity")
AXIS = """[source]
url = "{url}"
rate_hz = 1000

[signals]
excitation = "w"
input = "u"
output = "y"

[lines]
frequencies = "50,100,200"
window = 100
"""


def without_posix(*words: object, cwd: Path, **environment: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", "tests.support.windows_like", *map(str, words)],
        cwd=cwd,
        env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"} | environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def ended(process: subprocess.Popen[bytes], sent: bytes = b"") -> tuple[str, str]:
    out, err = process.communicate(sent, PATIENCE_S)
    return out.decode(errors="replace"), err.decode(errors="replace")


def test_recordings_are_tracked_fitted_recorded_in_segments_and_reported_without_posix(tmp_path: Path) -> None:
    process = without_posix("use", cwd=tmp_path)
    out, err = ended(process)
    assert process.returncode == 0, err
    assert "record.locked" in out
    assert "two-mass model" in out
    written = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*")}
    assert {"runs/standstill/report.html", "runs/standstill/report.pdf", "runs/segments/manifest.jsonl"} <= written


def test_every_module_can_be_imported_without_posix(tmp_path: Path) -> None:
    process = without_posix("import", cwd=tmp_path)
    out, err = ended(process)
    assert process.returncode == 0, err
    assert {"livebode.dashboard.listener", "livebode_start.jobs", "livebode_plant.fleet.edge"} <= set(out.split())


def test_samples_come_through_a_pipe_without_posix(tmp_path: Path) -> None:
    """There, select knows sockets only."""
    from livebode.core import Channel
    from livebode.sources.live import Batch, encode_line
    from tests.support.command import signals

    given = signals(2000)
    (tmp_path / "axis.toml").write_text(AXIS.format(url="stdin:"))
    import numpy as np

    data = np.array([given[name] for name in "wuy"])
    lines = [
        encode_line(Batch(k, data[:, k : k + 100], tuple(map(Channel, "wuy")), 1000.0)) for k in range(0, 2000, 100)
    ]
    process = without_posix("run", "run", "axis.toml", "--out", "run", cwd=tmp_path)
    out, err = ended(process, b"".join(lines))
    assert process.returncode == 0, err
    assert "from 2000 samples" in out


def test_a_job_of_the_start_page_ends_with_its_pipe_without_posix(tmp_path: Path) -> None:
    (tmp_path / "axis.toml").write_text(AXIS.format(url="udp://127.0.0.1:0").replace(":0", ":49999"))
    process = without_posix("job", "run", "axis.toml", "--out", "run", cwd=tmp_path)
    out, err = ended(process)
    assert process.returncode == 130, (out, err)
    assert "Traceback" not in err


@pytest.mark.parametrize("page", ["cp437", "cp1252", "cp850", "ascii", "utf-8"])
def test_a_console_with_a_code_page_gets_what_it_can_show(page: str, tmp_path: Path) -> None:
    """Its files have line ends of Windows."""
    write_examples(["standstill"], tmp_path)
    for name in ("standstill.csv", "standstill.toml"):
        text = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(text.replace(b"\n", b"\r\n"))
    for words in (("inspect", "standstill.csv"), ("run", "standstill.toml"), ("fit", "runs/standstill"), ("--help",)):
        process = without_posix("run", *words, cwd=tmp_path, PYTHONIOENCODING=page, PYTHONUTF8="0")
        out, err = process.communicate(timeout=PATIENCE_S)
        assert (process.returncode, b"Traceback" in err) == (0, False), err
        assert out.decode(page)
