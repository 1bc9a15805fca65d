"""How the tests share a machine.

One thread of linear algebra for each test process, whose neighbours have the other cores: threads of small products
wait for each other, and keep a core busy while they do. What is set already is kept. One process more than there are
cores, because many tests wait for something: a machine that sends at its pace, a browser, a process that starts.
"""

import os
import sys
from collections.abc import Iterator

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def pytest_xdist_auto_num_workers() -> int:
    """Of `-n auto`."""
    return (os.cpu_count() or 1) + 1


@pytest.fixture(autouse=True)
def _no_open_figure() -> Iterator[None]:
    """A figure of pyplot that an example leaves open would be the current one of the next test."""
    yield
    if (pyplot := sys.modules.get("matplotlib.pyplot")) is not None:
        pyplot.close("all")
