"""Microcontrollers in QEMU for tests: what they need, and recordings played through the kernel on them."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from livebode.kernel import SlidingDFT
from tools.firmware import ROOT, Core, missing, run

VARIANTS = ("modulated", "plain", "damped", "hann", "hamming", "blackman")


def need_tools() -> None:
    """Skips on a laptop, fails in CI, where the cross-compiler or QEMU is not installed."""
    if absent := missing():
        message = f"{' and '.join(absent)} not installed: `make system-packages` installs them"
        pytest.fail(message) if os.environ.get("CI") else pytest.skip(message)


@dataclass(frozen=True)
class Job:
    """A recording (samples, channels) and what the kernel is to do with it."""

    samples: NDArray[np.float64]
    window: int
    bins: tuple[int, ...]
    hop: int
    phase: str = "fixed"
    variant: str = "modulated"
    compact: bool = False
    blockwise: bool = False
    own_hop: int | None = None
    before: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 1)))
    """Samples that the host takes in first; the target goes on from its snapshot."""

    def started(self, dtype: str) -> SlidingDFT:
        """The host's kernel after the samples before."""
        dft = SlidingDFT(self.window, self.bins, self.samples.shape[1], dtype, self.variant, hop=self.own_hop)
        if len(self.before):
            dft.advance(np.ascontiguousarray(self.before.T.astype(dtype)))
        return dft

    def encoded(self, dtype: str) -> bytes:
        snapshot = self.started(dtype).snapshot() if len(self.before) else b""
        count, channels = self.samples.shape
        phase = ("window", "fixed").index(self.phase)
        head = (
            *(self.window, channels, len(self.bins), VARIANTS.index(self.variant), self.compact, phase),
            *(self.hop, count, len(snapshot), self.blockwise, self.own_hop or 0),
        )
        words = np.array(head + self.bins, dtype="<u4").tobytes()
        return words + snapshot + np.ascontiguousarray(self.samples.astype(dtype)).tobytes()


@dataclass(frozen=True)
class Made:
    """Rows, shape (channels, rows, bins), and the snapshot after the last sample."""

    rows: NDArray[np.complexfloating]
    snapshot: bytes


def on_host(job: Job, dtype: str) -> Made:
    dft = job.started(dtype)
    rows = dft.process(np.ascontiguousarray(job.samples.T.astype(dtype)), job.hop, phase=job.phase)
    return Made(rows, dft.snapshot())


def on_target(core: Core, program: Path, jobs: list[Job]) -> list[Made]:
    """The same jobs, played in one run of QEMU."""
    dtype = f"float{core.bits}"
    (program.parent / "jobs.bin").write_bytes(b"".join(job.encoded(dtype) for job in jobs))
    run(*core.qemu(program), cwd=program.parent)
    made, at, results = (program.parent / "made.bin").read_bytes(), 0, []
    for job in jobs:
        host = on_host(job, dtype)
        channels, rows, bins = host.rows.shape
        stop = at + host.rows.nbytes
        numbers = np.frombuffer(made[at:stop], host.rows.dtype)
        if job.blockwise:
            turned = numbers.reshape(channels, rows, bins)
        else:
            turned = numbers.reshape(rows, channels, bins).transpose(1, 0, 2)
        at = stop + len(host.snapshot)
        results.append(Made(turned, made[stop:at]))
    assert at == len(made)
    return results


def replay(core: Core, directory: Path) -> Path:
    """The program that plays jobs."""
    objects = core.kernel(directory / "kernel") + core.compile(
        [ROOT / "tests" / "support" / "firmware" / "replay.c"], directory
    )
    return core.link(directory / "replay.elf", objects)
