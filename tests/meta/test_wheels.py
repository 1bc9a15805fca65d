"""Which Pythons get a wheel of their own (tools/wheels)."""

from __future__ import annotations

import sys
from pathlib import Path

from packaging.version import Version

from tools.wheels.build import builders
from tools.wheels.interpreters import Interpreter, interpreters


def test_3_11_and_free_threaded_pythons_have_their_own_wheel_and_all_others_share_that_of_the_lowest() -> None:
    found = [
        Interpreter(Version(version), is_free_threaded, Path(version))
        for version, is_free_threaded in (
            ("3.11.7", False), ("3.12.1", False), ("3.13.0", False), ("3.13.0", True),
            ("3.14.0", False), ("3.14.0", True),
        )
    ]  # fmt: skip
    assert [one.name for one in builders(found)] == ["3.11", "3.12", "3.13t", "3.14t"]


def test_the_python_of_the_tests_is_among_those_that_are_found() -> None:
    assert f"{sys.version_info.major}.{sys.version_info.minor}" in [one.name for one in interpreters()]
