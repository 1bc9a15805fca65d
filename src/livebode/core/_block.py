"""Block: consecutive samples of named channels."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import field, replace
from math import inf
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from livebode.core._unit_reading import KINDS, QuantityKind, read_unit, split_plant_unit
from livebode.core.errors import SignalError, UsageError
from livebode.dataclass import dataclass

if TYPE_CHECKING:
    from livebode.core._response import Response, Responses

_R = TypeVar("_R", "Response", "Responses")


@dataclass(frozen=True)
class Channel:
    """Name, unit and kind of quantity of one recorded signal.

    Attributes
    ----------
    name
        Its name in the source.
    unit
        Unit of the samples; empty where the source does not report it. What is read has SI units (rad for angles)
        where the unit is recognised.
    kind
        The quantity that it is: torque, force, current, velocity, position, acceleration or other. Default: the one
        that the unit shows, "other" for a unit that is not recognised.
    written
        Unit in the source, where it is spelled otherwise or is another one; else empty. Of a channel without a unit,
        the one that the configuration states.
    factor
        SI units in one unit of the source: the samples are its values times this.

    Raises
    ------
    UsageError
        If `kind` is not one of these.

    Examples
    --------
    >>> Channel("iq", "A")
    Channel(name='iq', unit='A', kind='current')
    >>> Channel("speed", "counts", "velocity").kind
    'velocity'
    """

    name: str
    unit: str = ""
    kind: QuantityKind = None  # type: ignore[assignment]
    written: str = field(default="", repr=False)
    factor: float = field(default=1.0, repr=False)

    def __post_init__(self) -> None:
        declared: str | None = self.kind
        if declared is None:
            object.__setattr__(self, "kind", read_unit(self.unit).kind)
        elif declared not in KINDS:
            raise UsageError(
                "not-one-of",
                f"channel {self.name!r} has kind {self.kind!r}",
                f"choose one of {', '.join(KINDS)}",
                argument="kind",
                value=self.kind,
                allowed=list(KINDS),
            )

    @property
    def stated_kind(self) -> QuantityKind | None:
        """The kind; None where the source reports no unit, and no kind is declared."""
        return None if self.kind == "other" and not self.unit else self.kind

    @property
    def source_unit(self) -> str:
        """Unit in the source, for a person who knows the machine by it: `unit` is that of the samples."""
        return self.written or self.unit


@dataclass(frozen=True, eq=False)
class Block:
    """Consecutive samples of named channels at one exact rate. Immutable.

    Parameters
    ----------
    data
        float64, shape (channels, samples); taken without a copy where it is float64 already.
    channels
        One Channel (or name) for each row of `data`.
    rate_hz
        Samples per second, exact.
    start
        Number of the first sample. Numbers count from the start of the source and include the samples of gaps.
    origin_s
        Time of sample number 0 in seconds, in the clock of the source.
    gap
        True where samples are missing between this block and the previous one.

    Raises
    ------
    UsageError
        If names repeat, shapes disagree, or the rate is not a positive number.

    Examples
    --------
    >>> block = Block([[0.0, 1.0, 2.0], [5.0, 5.0, 5.0]], ["u", "y"], rate_hz=1000)
    >>> block["y"]
    array([5., 5., 5.])
    >>> len(block), block.stop
    (3, 3)
    """

    data: NDArray[np.float64]
    channels: tuple[Channel, ...]
    rate_hz: float
    start: int = 0
    origin_s: float = 0.0
    gap: bool = False

    def __post_init__(self) -> None:
        data = np.asarray(self.data, dtype=np.float64).view()
        if data.ndim != 2:
            raise UsageError(
                "wrong-shape",
                f"a block's data has shape {data.shape}",
                "give (channels, samples)",
                argument="data",
                shape=list(data.shape),
            )
        data.flags.writeable = False
        channels = tuple(c if isinstance(c, Channel) else Channel(c) for c in self.channels)
        names = [channel.name for channel in channels]
        if len(names) != len(data):
            raise UsageError(
                "wrong-shape",
                f"{len(names)} channel names for {len(data)} rows of data",
                "give one for each row",
                argument="channels",
                shape=list(data.shape),
            )
        if len(set(names)) != len(names):
            repeated = sorted({name for name in names if names.count(name) > 1})
            raise UsageError(
                "duplicate",
                f"channel name {repeated[0]!r} is duplicated",
                "rename one of the channels",
                argument="channels",
                value=repeated[0],
            )
        if not 0 < self.rate_hz < inf:
            raise UsageError(
                "out-of-range",
                f"rate_hz={self.rate_hz} is not a positive number of samples per second",
                "specify the rate",
                argument="rate_hz",
                value=self.rate_hz,
            )
        object.__setattr__(self, "data", data)
        object.__setattr__(self, "channels", channels)

    def __len__(self) -> int:
        return int(self.data.shape[1])

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        return np.asarray(self.data[self.index(name)])

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(channel.name for channel in self.channels)

    @property
    def stop(self) -> int:
        """Number of the sample that would follow the last one."""
        return self.start + len(self)

    @property
    def time_s(self) -> NDArray[np.float64]:
        """Time of every sample, shape (samples,), seconds."""
        return self.origin_s + np.arange(self.start, self.stop) / self.rate_hz

    def index(self, name: str) -> int:
        """Row of the channel `name`; SignalError with the nearest name where it is missing."""
        for row, channel in enumerate(self.channels):
            if channel.name == name:
                return row
        raise SignalError(
            "channel-unknown",
            f"there is no channel {name!r}",
            nearest_name(name, self.names),
            channel=name,
            allowed=list(self.names),
        )

    def rows(self, names: Sequence[str]) -> NDArray[np.float64]:
        """Rows of these channels, shape (channels, samples); SignalError where one is missing.

        No copy where they are evenly spaced, as three channels in the usual orders are.
        """
        data, which = self.data, [self.index(name) for name in names]
        if not which:
            return data[:0]
        first, step = which[0], which[1] - which[0] if len(which) > 1 else 1
        stop = first + step * len(which)
        if step == 0 or data.strides[1] != data.itemsize or which != list(range(first, stop, step)):
            return data[which]
        return data[first : stop if stop >= 0 else None : step]

    def cut(self, first: int, last: int) -> Block:
        """Samples at positions first … last − 1 of this block, without a copy; all of them are this block itself."""
        first, last, _ = slice(first, last).indices(len(self))
        if (first, last) == (0, len(self)):
            return self
        return replace(self, data=self.data[:, first:last], start=self.start + first, gap=self.gap and first == 0)


def nearest_name(name: str, names: Iterable[str], kind: str = "Channels") -> str:
    """The remedy for a name that does not exist: the nearest one, and all of them, which are `what`.

    >>> nearest_name("iq_adX", ["iq_adx", "theta_mx"])
    "did you mean 'iq_adx'? Channels: iq_adx, theta_mx"
    """
    known = list(names)
    folded = {k.casefold(): k for k in known}
    near = difflib.get_close_matches(name.casefold(), folded, n=1, cutoff=0.5)
    hint = f"did you mean {folded[near[0]]!r}? " if near else ""
    return f"{hint}{kind}: {', '.join(known) or 'none'}"


@dataclass(frozen=True)
class SourceUnit:
    """The unit of a plant in the units of its source, where these are not SI units.

    Attributes
    ----------
    unit
        The unit of the output in the source, and that of the input.
    factor
        Of these units in one SI unit of the plant: a response, its sigma and the parts of this are multiplied by it.

    Examples
    --------
    >>> speed = Channel("n", "rad/s", written="rpm", factor=0.10472)
    >>> in_source = SourceUnit.of(speed, Channel("M", "N m", written="%", factor=0.024))
    >>> in_source.unit, round(in_source.factor, 5)
    ('rpm/(%)', 0.22918)
    """

    unit: str
    factor: float

    @classmethod
    def of(cls, output: Channel, input: Channel) -> SourceUnit | None:
        """From the channels of the plant's output and input; None where both have the units of the source."""
        if output.factor == input.factor == 1:
            return None
        return cls(f"{output.source_unit}/({input.source_unit})", input.factor / output.factor)

    def converted(self, response: _R) -> _R:
        """A response or responses in SI units, in this unit."""
        scaled = {name: getattr(response, name) * self.factor for name in ("value", "sigma", "distortion", "variation")}
        return replace(response, **scaled, unit=self.unit)


@dataclass(frozen=True)
class PlantKinds:
    """Kinds of the output and of the input of a measured plant.

    Attributes
    ----------
    output, input
        None where the source reports no unit, and neither its name nor the configuration shows the kind.
    output_unit, input_unit
        Units of their samples, empty where they are not known.
    output_name, input_name
        Names of their channels, for messages.

    Examples
    --------
    >>> PlantKinds.of(Channel("speed", "rad/s"), Channel("torque", "%"))
    PlantKinds(output='velocity', input='other', output_unit='rad/s', input_unit='%')
    """

    output: QuantityKind | None = None
    input: QuantityKind | None = None
    output_unit: str = ""
    input_unit: str = ""
    output_name: str = field(default="output", compare=False, repr=False)
    input_name: str = field(default="input", compare=False, repr=False)

    @classmethod
    def of(cls, output: Channel, input: Channel) -> PlantKinds:
        """The kinds of two channels."""
        return cls(output.stated_kind, input.stated_kind, output.unit, input.unit, output.name, input.name)

    @classmethod
    def of_unit(cls, unit: str) -> PlantKinds:
        """The kinds that the unit of a response shows, for a run that did not record them.

        >>> PlantKinds.of_unit("rad/(A)").output, PlantKinds.of_unit("").output
        ('position', None)
        """
        output, input = split_plant_unit(unit)
        return cls.of(Channel("y", output or unit), Channel("u", input or unit))
