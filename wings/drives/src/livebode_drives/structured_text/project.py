"""All files of a PLC project: excitation, sliding DFT, the ring that livebode's ADS source reads, and the program."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from numpy.typing import ArrayLike

from livebode.core import Lines, UsageError, counted
from livebode.dataclass import dataclass
from livebode.excitation import function_block
from livebode.structured_text import (
    Declared,
    array,
    check_bytes,
    check_name,
    check_names,
    check_rate,
    comment,
    real,
    section,
)
from livebode_drives.structured_text.sliding_dft import sliding_dft

LENGTH = 8192
CHANNELS_MAX = 64
_HEADER_BYTES = 40
_RING_WORDS = ("stamp", "ring", "slot", "started")

_BODY = """\
IF NOT started THEN
    IF stamp > 0 THEN
        ring.epoch := ULINT_TO_UDINT((stamp / 10000) MOD ULINT#4294967295) + 1;
    END_IF
    started := TRUE;
END_IF
slot := ULINT_TO_UDINT(ring.count MOD {length});
{stores}
ring.stamp := stamp;
ring.count := ring.count + 1;   // last: the sample is complete
"""


def ring_type(channels: int, rate_hz: float, *, length: int = LENGTH, name: str = "ST_LivebodeRing") -> str:
    """Text of the structure that livebode finds by its symbol and reads in batches.

    Every member is at a multiple of its size, without gaps, so that the layout does not depend on the packing.

    Parameters
    ----------
    channels
        Number of channels, 1 to 64.
    rate_hz
        Calls of the block per second.
    length
        Number of samples in the ring: livebode must read it at least once in that time.
    name
        Name of the type.

    Raises
    ------
    UsageError
        If a number is out of range, the ring needs more than 8 MiB, or the name is not valid in Structured Text.
    """
    check_name(name, "type")
    _check_size(channels, length)
    check_rate(rate_hz)
    members = [
        ("magic", "UDINT := 16#474E524C", "byte 0"),
        ("version", "UINT := 1", "4"),
        ("channels", f"UINT := {channels}", "6"),
        ("length", f"UDINT := {length}", "8, samples in the ring"),
        ("epoch", "UDINT", "12, different at each start; 0 for none"),
        ("rate_hz", f"LREAL := {real(rate_hz)}", "16"),
        ("stamp", "ULINT", "24, of the last sample: 100 ns since 1601 UTC; 0 without"),
        ("count", "ULINT", "32, samples written; updated last"),
        ("data", array(length, channels), "40"),
    ]
    declared = section("STRUCT", members).replace("END_VAR", "END_STRUCT")
    return (
        comment(f"Read by livebode: {length} samples of {counted(channels, 'channel')}, {length / rate_hz:.4g} s")
        + f"TYPE {name} :\n{declared}END_TYPE\n"
    )


def ring_block(
    channels: Sequence[str],
    *,
    length: int = LENGTH,
    name: str = "FB_LivebodeRing",
    type_name: str = "ST_LivebodeRing",
) -> str:
    """Text of the function block that writes a sample of each channel to the ring at each call.

    Its epoch, from which livebode detects a restart, is derived from the clock at the first call; without a clock
    (stamp 0) a restart is detected from sample numbers that go back.

    Parameters
    ----------
    channels
        Names of the inputs in the order of the ring's columns: at most 64, valid in Structured Text.
    length
        As in the type.
    name, type_name
        Name of the function block, and of the ring's type.

    Raises
    ------
    UsageError
        If a name is not valid in Structured Text, or the ring is too large.
    """
    check_name(name, "function block")
    check_name(type_name, "type")
    _check_size(len(channels), length)
    check_names(channels, "channel", (*_RING_WORDS, name, type_name))
    return (
        comment(f"Writes a sample of each channel to the ring, once per cycle: {', '.join(channels)}")
        + f"FUNCTION_BLOCK {name}\n"
        + section(
            "VAR_INPUT",
            [*((channel, "LREAL", "") for channel in channels), ("stamp", "ULINT", "100 ns since 1601 UTC; 0 without")],
        )
        + section("VAR_IN_OUT", [("ring", type_name, "")])
        + section("VAR", [("slot", "UDINT", ""), ("started", "BOOL", "")])
        + "\n"
        + _BODY.format(
            length=length,
            stores="\n".join(f"ring.data[slot, {i}] := {channel};" for i, channel in enumerate(channels)),
        )
        + "END_FUNCTION_BLOCK\n"
    )


def _check_size(channels: int, length: int) -> None:
    if not 1 <= channels <= CHANNELS_MAX:
        raise UsageError(
            "out-of-range",
            f"a ring of {counted(channels, 'channel')} is not one of 1 to {CHANNELS_MAX}",
            "use several rings",
            argument="channels",
            value=channels,
        )
    if length < 2:
        raise UsageError(
            "out-of-range",
            f"a ring of {length=} samples is too short",
            f"use at least 2, recommended {LENGTH}",
            argument="length",
            value=length,
        )
    check_bytes(_HEADER_BYTES, 8 * channels, length, f"a ring of {counted(channels, 'channel')}")


COUNTER = "sample"
_DECLARED: list[Declared] = [
    ("livebode", "ST_LivebodeRing", "read by livebode"),
    ("fbMultisine", "FB_Multisine", ""),
    ("fbSlidingDft", "FB_SlidingDft", ""),
    ("fbRing", "FB_LivebodeRing", ""),
    ("enable", "BOOL", "excite"),
    ("stop", "BOOL", "w = 0 at once: connect the drive's fault to it"),
    ("scale", "LREAL := 1.0", "of the excitation"),
    ("watch", "UDINT", "cycles until enable is reset, renewed by livebode; 0: never"),
]
_WATCH = """\
IF watch > 0 THEN
    watch := watch - 1;
    IF watch = 0 THEN
        enable := FALSE;
    END_IF
END_IF
"""
# A variable with one of these names would change the meaning of MAIN.
_OWN = ("MAIN", "F_GetSystemTime", *(word for name, of, _ in _DECLARED for word in (name, of.split()[0])))


@dataclass(frozen=True)
class Project:
    """Parts of a PLC program that excites an axis, tracks it and sends its samples to livebode.

    Parameters
    ----------
    period
        One period of the excitation, shape (samples,).
    limit
        Limit of the magnitude of the excitation.
    lines
        Bins and window of the sliding DFT, and the rate of the task.
    channels
        Names of the recorded channels, in the ring's order.
    excitation
        The channel that the block generates; the program reads the others from the drive.
    tracked
        Channels of the sliding DFT.
    ring_length
        Number of samples in the ring.
    ramp_periods
        Periods of the ramps of the excitation.
    counter
        Name of an additional channel: the excitation's sample counter; multiples of the window are borders of
        periods.
    note
        Lines for the top of the excitation's file.
    """

    period: ArrayLike
    limit: float
    lines: Lines
    channels: Sequence[str]
    excitation: str
    tracked: Sequence[str]
    ring_length: int = LENGTH
    ramp_periods: int = 1
    counter: str = COUNTER
    note: str = ""

    @property
    def columns(self) -> tuple[str, ...]:
        """The ring's columns: the channels, and after them the counter if it is not one of them."""
        return (*self.channels, *([] if self.counter in self.channels else [self.counter]))

    def files(self) -> dict[str, str]:
        """Text of each file by its name.

        Raises
        ------
        UsageError
            As `function_block`, `sliding_dft`, `ring_type` and `ring_block`; also if the excitation or a tracked signal
            is not a channel, or has a name that the program uses.
        """
        check_signals((self.excitation, *self.tracked), self.counter)
        for name in (self.excitation, *self.tracked):
            if name not in self.channels:
                raise UsageError(
                    "unknown-name",
                    f"there is no channel {name!r}",
                    f"choose from {', '.join(self.channels)}",
                    argument="excitation" if name == self.excitation else "tracked",
                    value=name,
                    allowed=list(self.channels),
                )
        check_names(self.columns, "channel", _OWN)
        rate_hz = self.lines.rate_hz
        return {
            "FB_Multisine.st": function_block(
                self.period, rate_hz=rate_hz, limit=self.limit, ramp_periods=self.ramp_periods, note=self.note
            ),
            "FB_SlidingDft.st": sliding_dft(self.lines, self.tracked),
            "ST_LivebodeRing.st": ring_type(len(self.columns), rate_hz, length=self.ring_length),
            "FB_LivebodeRing.st": ring_block(self.columns, length=self.ring_length),
            "MAIN.st": self._program(),
        }

    def _program(self) -> str:
        made = {self.excitation: "the excitation", self.counter: "its sample counter"}
        wired = "\n".join(f"// {name} := ...;" for name in self.columns if name not in made)
        return (
            comment(f"The task that controls the drive calls this once a cycle, at {self.lines.rate_hz:g} Hz.")
            + "PROGRAM MAIN\n"
            + section(
                "VAR",
                [*_DECLARED, *((name, "LREAL", made.get(name, "")) for name in self.columns)],
            )
            + f"\n// 1. From the drive, of this cycle:\n{wired}\n\n"
            + "// 2. The excitation\n"
            + _WATCH
            + "fbMultisine(enable := enable, stop := stop, scale := scale);\n"
            + f"{self.excitation} := fbMultisine.w;\n"
            + f"{self.counter} := ULINT_TO_LREAL(fbMultisine.sample);\n\n"
            + f"// 3. To the drive: add {self.excitation} to the torque reference\n\n"
            + "// 4. Spectra in fbSlidingDft.re and .im, [channel, bin]; samples to livebode\n"
            + f"fbSlidingDft({_arguments(self.tracked)});\n"
            + f"fbRing(ring := livebode, stamp := F_GetSystemTime(), {_arguments(self.columns)});\n"
            + "END_PROGRAM\n"
        )


def check_signals(names: Iterable[str], counter: str = COUNTER) -> None:
    """UsageError for a signal with a name that MAIN uses: the counter would be sent as torque."""
    check_names(list(dict.fromkeys(names)), "signal", (*_OWN, counter))


def _arguments(names: Sequence[str]) -> str:
    return ", ".join(f"{name} := {name}" for name in names)
