"""Common parts of simulated sources: channels, excitation, delivery of Blocks, in real time if required, divergence."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, Channel, SignalError, SimulationError, UsageError, nearest_name

CHANNELS = (
    Channel("w", "N m"),
    Channel("u", "N m"),
    Channel("velocity", "rad/s"),
    Channel("position", "rad"),
    Channel("x", "m"),
    Channel("position_reference", "rad"),
    Channel("velocity_reference", "rad/s"),
)
BLOCK_SAMPLES_MAX = 1 << 24


def checked_block_samples(block_samples: int) -> None:
    """Raise UsageError if it is not a whole number from 1 to 2²⁴."""
    whole = isinstance(block_samples, int) and not isinstance(block_samples, bool)
    if not (whole and 1 <= block_samples <= BLOCK_SAMPLES_MAX):
        raise UsageError(
            "out-of-range",
            f"{block_samples=} is not a whole number from 1 to {BLOCK_SAMPLES_MAX}",
            "choose for example 4096",
            argument="block_samples",
            low=1,
            high=BLOCK_SAMPLES_MAX,
        )


def excitation_at(period: NDArray[np.float64], number: NDArray[np.int64]) -> NDArray[np.float64]:
    """The period repeated from sample 0 on, at these sample numbers; zeros for an empty one."""
    return period[number % period.size] if period.size else np.zeros(number.size)


def delivered(
    blocks: Iterable[Block],
    channels: Sequence[str] | None,
    real_time: bool,
    clock: Callable[[], float],
    sleep: Callable[[float], object],
) -> Iterator[Block]:
    """Blocks with only these channels; with `real_time` none before its last sample would have been measured."""
    names = [channel.name for channel in CHANNELS]
    for name in channels or ():
        if name not in names:
            raise SignalError(
                "channel-unknown",
                f"there is no channel {name!r}",
                nearest_name(name, names),
                channel=name,
                channels=names,
            )
    rows = [names.index(name) for name in (names if channels is None else channels)]
    labels = tuple(CHANNELS[i] for i in rows)
    chosen = (Block(block.data[rows], labels, block.rate_hz, start=block.start) for block in blocks)
    return paced(chosen, clock, sleep) if real_time else chosen


def paced(blocks: Iterable[Block], clock: Callable[[], float], sleep: Callable[[float], object]) -> Iterator[Block]:
    """These Blocks, each at its time after the first request; a late one is delivered at once."""
    began = clock()
    for block in blocks:
        if (wait := began + block.stop / block.rate_hz - clock()) > 0:
            sleep(wait)
        yield block


def diverged(time_s: float, state: Sequence[float], why: str) -> SimulationError:
    """The error for a simulated machine with this state at this time."""
    values = [float(value) for value in state]
    numbers = ", ".join(f"{value:.6g}" for value in values)
    return SimulationError(
        "diverged",
        f"the simulation stopped at {time_s:.6f} s, where {why} ({numbers})",
        "lower the gains, the delay or the amplitude",
        time_s=time_s,
        state=values,
    )
