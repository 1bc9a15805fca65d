"""Reads files in a process that may use little memory and processor time: the system ends or refuses it otherwise."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from pathlib import Path

MEMORY_BYTES, CPU_S = 1 << 30, 60
"""What a process may use beyond what it has once everything is imported. A fault ends it; nothing is measured."""


def outcomes(paths: list[Path], warm: list[Path], rate_hz: float | None = None) -> dict[str, str]:
    """What each file gives, "read" or the code of its error; `warm` are valid files that import the readers.

    `rate_hz` is that of all of them, where they have no time.
    """
    command = [sys.executable, "-m", "tests.support.limited_reader"]
    given = json.dumps({"warm": list(map(str, warm)), "paths": list(map(str, paths)), "rate_hz": rate_hz})
    done = subprocess.run(command, input=given, capture_output=True, text=True)
    assert done.returncode == 0, (done.returncode, done.stdout[-300:], done.stderr[-2000:])
    return dict(json.loads(line) for line in done.stdout.splitlines())


def main() -> None:
    """Read the files that standard input names."""
    from livebode.core import RecordingError
    from tests.support.bad_recordings import drain

    given = json.load(sys.stdin)
    options = {} if given["rate_hz"] is None else {"rate_hz": given["rate_hz"]}
    for name in given["warm"]:
        drain(Path(name), **options)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + MEMORY_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    used_s = int(resource.getrusage(resource.RUSAGE_SELF).ru_utime)
    resource.setrlimit(resource.RLIMIT_CPU, (used_s + CPU_S, used_s + CPU_S))
    for name in given["paths"]:
        try:
            drain(Path(name), **options)
            found = "read"
        except RecordingError as error:
            found = error.code
        except BaseException:
            print(name, file=sys.stderr)
            raise
        print(json.dumps([name, found]), flush=True)


if __name__ == "__main__":
    main()
