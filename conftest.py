"""How the tests share a machine.

One thread of linear algebra for each test process, whose neighbours have the other cores: threads of small products
wait for each other, and keep a core busy while they do. What is set already is kept. One process more than there are
cores, because many tests wait for something: a machine that sends at its pace, a browser, a process that starts.

Python keeps what it compiles, also where the environment asks it not to: some hundred processes are started, and each
would compile all that it imports.

Half a million objects of modules and tests live from the collection to the end. The garbage collector does not visit
them: a sixth of the time of a collection was its search through them. For what tests make it comes a tenth as often:
they make much that they keep to their end, and memory is there. A process that has used DuckDB visits all of them once
more at its end: what tests import, or a run of several axes in the process freezes, would else not be freed, and
nanobind in DuckDB prints a page of what is left.

Processes of pytest-xdist run whole files, the longest first: none has a long one left when the others are at their end.

A generated example has no time limit: on a busy computer it measures the neighbours.

Ctrl-C reaches the processes that tests start. A shell lets what it starts in the background ignore it, and they would
inherit that: a test would never see the end of a command.
"""

import csv
import gc
import os
import signal
import sys
import tempfile
from collections import defaultdict
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from _pytest.doctest import DoctestModule
from hypothesis import settings

if TYPE_CHECKING:
    from playwright.sync_api import Browser

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
settings.register_profile("livebode", settings(), deadline=None)  # with what Hypothesis sets in CI
settings.load_profile("livebode")
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_xdist_auto_num_workers() -> int:
    """Of `-n auto`: more than cores, since many tests wait for servers, browsers and other processes."""
    return (os.cpu_count() or 1) + 2


def pytest_configure(config: pytest.Config) -> None:
    """A folder for what tests/support/shared.py keeps; the processes that xdist starts get it from this one."""
    if not hasattr(config, "workerinput"):
        kept = tempfile.TemporaryDirectory(prefix="livebode-tests-")
        os.environ["LIVEBODE_TESTS_SHARED"] = kept.name
        config.add_cleanup(kept.cleanup)


def pytest_collection() -> None:
    gc.disable()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if hasattr(config, "workerinput"):
        seconds: defaultdict[str, float] = defaultdict(float)
        with (config.rootpath / "bench/history/test-seconds.csv").open(encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                seconds[row["file"]] += float(row["seconds"])
        items.sort(key=lambda item: -seconds[item.nodeid.split("::")[0]])


def pytest_collection_finish() -> None:
    gc.freeze()
    gc.set_threshold(7000)
    gc.enable()


def pytest_sessionfinish() -> None:
    if (browsers := sys.modules.get("tests.support.browser")) is not None:
        browsers.end_chromium()
    if "duckdb" in sys.modules:
        gc.unfreeze()


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(
    file_path: Path, parent: pytest.Collector
) -> Generator[None, list[pytest.Collector], list[pytest.Collector]]:
    """Examples are in modules alone: a test's file is not searched for them, nor are the modules that have none."""
    found = yield
    of_tests = "tests" in file_path.relative_to(parent.config.rootpath).parts
    none = of_tests or (file_path.suffix == ".py" and b">>>" not in file_path.read_bytes())
    return [one for one in found if not (none and isinstance(one, DoctestModule))]


@pytest.fixture(autouse=True)
def _no_open_figure() -> Iterator[None]:
    """A figure of pyplot that an example leaves open would be the current one of the next test."""
    yield
    if (pyplot := sys.modules.get("matplotlib.pyplot")) is not None:
        pyplot.close("all")


@pytest.fixture(scope="module")
def browser() -> Iterator["Browser"]:
    """Chromium for the tests of a file: one of the process, whose event loop is the thread's only meanwhile."""
    from tests.support.browser import chromium

    with chromium() as found:
        yield found
