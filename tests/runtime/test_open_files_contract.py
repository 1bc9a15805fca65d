"""A session may open the files of many axes although the limit of its process is low at first."""

from __future__ import annotations

import subprocess
import sys

import pytest

PROGRAM = """
import resource, sys
from livebode.runtime.session import allow_open_files
resource.setrlimit(resource.RLIMIT_NOFILE, (64, int(sys.argv[1])))
allow_open_files()
print(*resource.getrlimit(resource.RLIMIT_NOFILE))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have other limits")
def test_the_limit_of_open_files_is_raised_as_far_as_the_system_permits() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM, "4000"], check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["4000", "4000"]
