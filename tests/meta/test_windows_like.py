"""What works without POSIX (docs/how-to/windows.md), in a process that hides what Windows does not have."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_recordings_are_tracked_fitted_recorded_in_segments_and_reported_without_posix(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.support.windows_like", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "record.locked" in done.stdout
    assert "two-mass model" in done.stdout
    written = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*")}
    assert {"runs/standstill/report.html", "runs/standstill/report.pdf", "runs/segments/manifest.jsonl"} <= written
