"""`livebode run` in a process of its own, on machines that send, and what its records hold."""

from __future__ import annotations

import json
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from livebode.core import Block, Event
from livebode.records import RunRecord
from tests.support.command import RATE_HZ
from tests.support.forked import Command
from tests.support.peers.machine import CHANNELS, Machine, data
from tests.support.peers.peer import PATIENCE_S, until
from tests.support.small_axis import WITH_SCHEDULE

SHARED = (
    WITH_SCHEDULE
    + """[record]
samples = true
segment_s = 2
"""
)


def source(machine: Machine) -> str:
    return f'source.url = "{machine.settings["url"]}"\n'


class Running:
    """The command on a file of ours, that may be edited."""

    def __init__(self, folder: Path, text: str, *options: str, log_level: str = "") -> None:
        self.file, self.out = folder / "axes.toml", folder / "run"
        self.write(text)
        log = ("--log-level", log_level) if log_level else ()
        self.process = Command(*log, "run", self.file, "--out", self.out, "--json", *options)

    def __enter__(self) -> Running:
        return self

    def __exit__(self, *error: object) -> None:
        self.process.__exit__(*error)

    def write(self, text: str) -> None:
        """Change the file at once: a look at it must not find a part."""
        new = self.file.with_suffix(".new")
        new.write_text(text)
        new.replace(self.file)

    def edit(self, text: str) -> None:
        """Change the file, and say so."""
        self.write(text)
        self.process.send_signal(signal.SIGHUP)

    def tracked(self, name: str, samples: int = 1) -> None:
        """Until the record of this run holds so many samples, or more."""
        until(lambda: self.process.poll() is not None or numbers(self.out / name).size >= samples, f"{samples} samples")
        assert self.process.poll() is None, self.process.communicate()

    def says(self, words: str) -> None:
        """Until these words are in standard error."""
        until(lambda: self.process.poll() is not None or words.encode() in self.process.reported, words)
        assert words.encode() in self.process.reported, self.process.communicate()

    def reported_event(self, name: str, kind: str) -> Event:
        """The first event of this kind in this run, once it is there."""
        return until(lambda: next((e for e in events(self.out / name) if e.kind == kind), None), kind)

    def end(self, number: int = signal.SIGINT) -> tuple[int, str, str]:
        """Exit code, standard output and standard error."""
        self.process.send_signal(number)
        out, err = self.process.communicate(timeout=PATIENCE_S)
        return self.process.returncode, out.decode(), err.decode()


def events(run: Path) -> list[Event]:
    return RunRecord.open(run).events() if (run / "run.json").exists() and (run / "events.jsonl").exists() else []


def numbers(run: Path) -> np.ndarray:
    """Numbers of the samples in a record, as they stand in it."""
    if not (run / "manifest.jsonl").exists() or not (run / "run.json").exists():
        return np.zeros(0, dtype=np.int64)
    parts = [table["sample"].to_numpy() for table in map(pa.table, RunRecord.open(run).tables("samples"))]
    return np.concatenate(parts) if parts else np.zeros(0, dtype=np.int64)


def summary_of(run: Path) -> dict[str, Any]:
    return json.loads((run / "run.json").read_text())


def check_samples(runs: list[Path], sent: int) -> None:
    """That every sample that was sent is in exactly one of these records, as it was sent."""
    tables = [table for run in runs for table in map(pa.table, RunRecord.open(run).tables("samples"))]
    number = np.concatenate([table["sample"].to_numpy() for table in tables])
    assert np.array_equal(number, np.arange(sent))
    for row, name in enumerate(("w", "u", "y", "n")):
        found = np.concatenate([table[name].to_numpy() for table in tables])
        assert np.array_equal(found, data(sent)[row]), name


def block(samples: int) -> Block:
    return Block(data(samples), CHANNELS, float(RATE_HZ))
