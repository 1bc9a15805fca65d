"""`livebode demo` and the baseline that it learns first, made once for all tests that read them."""

from __future__ import annotations

import pickle
from pathlib import Path
from unittest import mock

from livebode.monitoring import Baseline
from livebode.runtime import demo_baseline
from tests.support.command import livebode
from tests.support.shared import folder, shared

SEED = 2
"""Of the healthy strokes, where the demonstration has the default seed."""


@shared
def learned() -> Baseline:
    return demo_baseline(SEED)


def already_learned(directory: Path) -> str:
    """Code that lets `livebode demo` take this baseline in a process of its own, by a file in `directory`."""
    path = directory / "learned.pickle"
    path.write_bytes(pickle.dumps(learned()))
    return (
        "import pickle, livebode.runtime\n"
        f"with open({str(path)!r}, 'rb') as file: baselines = {{{SEED}: pickle.load(file)}}\n"
        "livebode.runtime.demo_baseline = baselines.__getitem__"
    )


@shared
def shown() -> tuple[Path, str]:
    """The run of `livebode demo --fast`, and what it printed."""
    run, baselines = folder() / "demo", {SEED: learned()}
    with mock.patch("livebode.runtime.demo_baseline", baselines.__getitem__):
        done = livebode("demo", "--fast", "--out", run)
    assert done.code == 0, done.err
    return run, done.out
