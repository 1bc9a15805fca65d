"""A run that was compared with a made-up baseline."""

from __future__ import annotations

import json
import shutil
import zlib
from pathlib import Path

import numpy as np

from livebode.monitoring import Baseline, ScheduleTable
from livebode.monitoring.accuracy import ChangeAccuracy
from livebode.records import RunRecord
from livebode.records.summary_file import to_document
from tests.support.dashboards import LINES


def table_of(low: float, high: float) -> ScheduleTable:
    """A made-up baseline of four bins, with another mean and spread in each and for each way."""
    rng, shape = np.random.default_rng(0), (4, 3, len(LINES))
    mean = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    covariance = np.einsum("bwl,ij->bwlij", rng.uniform(1e-3, 1e-2, shape), np.eye(2))
    names = tuple(f"{f:g} Hz" for f in LINES.frequency_hz)
    ones = np.ones(2 * len(LINES))
    accuracy = ChangeAccuracy(ones, 0.01 * ones, 0.05 * ones)
    step = (high - low) / 4 * (1 + 1e-9)
    count = np.full((4, 3), 20)
    return ScheduleTable("lines", names, low, step, 1e-3, mean, covariance, np.abs(mean) ** 2 * 1e-3, count, accuracy)


def compared(run: Path, copy: Path) -> ScheduleTable:
    """Copy a run of these lines, with a baseline at all of its positions."""
    responses = RunRecord.open(run).responses()
    table = table_of(float(np.nanmin(responses.schedule)), float(np.nanmax(responses.schedule)))
    roles = {"output": "y", "input": "u", "excitation": "w", "schedule": "x"}
    shutil.copytree(run, copy)
    baseline = copy / "healthy.json"
    Baseline(LINES, 20, roles, "joint", "plant", (table,), None).save(baseline)
    summary = json.loads((copy / "run.json").read_text())
    summary["configuration"]["monitoring"] = {"baseline": str(baseline)}
    del summary["crc32"]
    (copy / "run.json").write_bytes(to_document(summary))
    return table


def with_checksum(data: object) -> bytes:
    """A file of a baseline with the checksum of what it contains."""
    text = json.dumps(data, indent=1)
    return f'{text[:-2]},\n "crc32": "{zlib.crc32(text.encode()):08x}"\n}}\n'.encode()
