"""ReadyCondition: at which samples the machine is ready, from a channel with its state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebode.core import Block, ConfigError
from livebode.dataclass import dataclass

_EXACT_MAX = 2.0**53


@dataclass(frozen=True)
class ReadyCondition:
    """At which samples the machine is ready.

    Without `mask` and `expected`, it is ready where the channel is not zero; else where ``value & mask == expected``.
    A value that is not finite, or no whole number where bits are compared, is not ready.

    Attributes
    ----------
    channel
        The channel with the state.
    mask
        Bits that are compared; default: all.
    expected
        Their value; default: all bits of the mask.

    Examples
    --------
    The state "operation enabled" in the status word of CiA 402:

    >>> condition = ReadyCondition("status_word", 0x6F, 0x27)
    >>> condition.holds(np.array([0x1637, 0x1633, np.nan])).tolist()
    [True, False, False]
    """

    channel: str
    mask: int | None = None
    expected: int | None = None

    def holds(self, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether the machine is ready at these values of the channel."""
        known = np.isfinite(values)
        if self.mask is None and self.expected is None:
            return np.asarray(known & (values != 0))
        known &= (np.abs(values) < _EXACT_MAX) & (values == np.floor(values))
        bits = np.where(known, values, 0.0).astype(np.int64)
        compared = bits if self.mask is None else bits & self.mask
        expected = self.mask if self.expected is None else self.expected
        return np.asarray(known & (compared == expected), dtype=np.bool_)

    def parts(self, block: Block) -> list[Block]:
        """The stretches of a Block in which the machine is ready at every sample."""
        edges = np.flatnonzero(np.diff(self.holds(block[self.channel]), prepend=False, append=False))
        return [block.cut(int(first), int(last)) for first, last in zip(edges[::2], edges[1::2])]


def ready_condition(
    channel: str | None, mask: int | None, expected: int | None, *, averages: bool
) -> ReadyCondition | None:
    """The condition of a configuration; None without a channel.

    Raises
    ------
    ConfigError
        If bits are given without a channel, or responses are averaged, which mixes those that are assessed with others.
    """
    if channel is None:
        for name, value in (("ready_mask", mask), ("ready_value", expected)):
            if value is not None:
                raise ConfigError(
                    "incomplete",
                    f"monitoring.{name} compares bits of signals.ready, which is missing",
                    "name the channel of the machine's state, such as the status word of the drive",
                    key="signals.ready",
                )
        return None
    if averages:
        raise ConfigError(
            "key-conflict",
            "tracking.average mixes windows in which the machine was ready with others, so signals.ready has no effect",
            "remove one of them",
            keys=["tracking.average", "signals.ready"],
        )
    return ReadyCondition(channel, mask, expected)
