"""LimitWatch: compares each sample with the limits of its channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from livebode.core import Block, ConfigError, MeasurementError, nearest_name


class LimitWatch:
    """Finds the first sample beyond a limit.

    Parameters
    ----------
    ranges
        Lowest and highest permitted value of each limited channel.
    channels
        Names of the channels that are received.

    Raises
    ------
    ConfigError
        If there is no such channel.
    """

    def __init__(self, ranges: Mapping[str, tuple[float, float]], channels: Sequence[str]) -> None:
        for name in ranges:
            if name not in channels:
                raise ConfigError(
                    "key-unknown",
                    f"measure.limits.{name}: there is no channel {name!r}",
                    nearest_name(name, list(channels)),
                    key=f"measure.limits.{name}",
                )
        self._ranges = dict(ranges)

    def check(self, block: Block) -> MeasurementError | None:
        """The first violation in a Block; a value that is not finite is one."""
        first: tuple[int, str] | None = None
        for name, (low, high) in self._ranges.items():
            with np.errstate(invalid="ignore"):
                beyond = ~((block[name] >= low) & (block[name] <= high))
            if beyond.any() and (first is None or int(beyond.argmax()) < first[0]):
                first = int(beyond.argmax()), name
        if first is None:
            return None
        at, name = first
        value, (low, high) = float(block[name][at]), self._ranges[name]
        unit = next(channel.unit for channel in block.channels if channel.name == name)
        return MeasurementError(
            "limit-exceeded",
            f"{name} = {value:.6g} {unit} at {(block.start + at) / block.rate_hz:.4f} s is outside of its limits "
            f"{low:g} … {high:g} {unit}",
            "reduce the amplitude, or correct measure.limits",
            channel=name,
            value=value,
            low=low,
            high=high,
            sample=block.start + at,
        )
