"""Axes of a fleet with fits, margins and a baseline: the example axis, which changes at a known time."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

import livebode
from livebode.configuration import Axis
from livebode.core import Channel
from livebode.sources.live import Batch
from livebode_plant.fleet.fleet_settings import LogSection, machine_key
from livebode_plant.fleet.log import FleetLog
from livebode_plant.fleet.message import message_id, write_message
from livebode_plant.fleet.subjects import EDGE

RATE_HZ, SAMPLES = 4000.0, 400
CHANGED = 4
"""Number of the first batch after the change."""
_CHANNELS = (Channel("w", "N m"), Channel("u", "N m"), Channel("velocity", "rad/s"))
_SECONDS = 5.0


def healthy_baseline(folder: Path) -> Path:
    """Tables of lines and of parameters, learned from a run of the example axis."""
    path = folder / "healthy.json"
    livebode.learn([livebode.example_run(folder / "healthy", seconds=_SECONDS)]).save(path)
    return path


def fitted_axes(count: int, baseline: Path | None = None) -> dict[str, Axis]:
    """Axes by their key in the log."""
    found = {}
    for number in range(count):
        about = {
            "machine": {"site": "ulm", "machine": f"press {number}", "axis": "x"},
            "source": {"url": "udp://127.0.0.1:5000"},
            "signals": {"output": "velocity", "input": "u", "excitation": "w"},
            "lines": {"frequencies": "20:140:10", "window": 400},
            "tracking": {"hop": 100},
            "loop": {"velocity": {"gain": 0.2308, "integral_time_s": 0.2, "rate_hz": RATE_HZ}},
            "fit": {"model": "two-mass"},
        }
        axis = Axis.of(about | ({"monitoring": {"baseline": str(baseline)}} if baseline else {}), "a test")
        found[machine_key(axis, "a test")] = axis
    return found


@cache
def _signals() -> np.ndarray:
    block, _ = livebode.example_axis(_SECONDS).run()
    return np.array([block[channel.name] for channel in _CHANNELS])


def fitted_message(axis: int, number: int) -> bytes:
    """Batch `number` of an axis, each with noise of its own; from `CHANGED` on the first axis answers 20 % more."""
    data = _signals()[:, number * SAMPLES : (number + 1) * SAMPLES].copy()
    data[2] *= 1.2 if axis == 0 and number >= CHANGED else 1.0
    data[2] += 1e-3 * np.random.default_rng([axis, number]).standard_normal(SAMPLES)
    return write_message(Batch(number * SAMPLES, data.astype("f4").astype("f8"), _CHANNELS, RATE_HZ, epoch=axis + 1))


def fitted_sent(settings: LogSection, axes: Mapping[str, Axis], numbers: range) -> None:
    """Publish these batches of all axes."""

    async def publish() -> None:
        async with FleetLog(settings, "test") as log:
            await log.create_streams()
            for number in numbers:
                for axis, key in enumerate(axes):
                    message = fitted_message(axis, number)
                    await log.append(f"{EDGE}.{key}", message, message_id(key, message))

    asyncio.run(publish())
