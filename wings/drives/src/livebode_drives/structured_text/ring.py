"""The ring buffer that livebode's ADS source reads: its type, and the block that fills it (docs/how-to/live.md)."""

from __future__ import annotations

from collections.abc import Sequence

from livebode.core import UsageError, counted
from livebode.structured_text import array, check_bytes, check_name, check_names, check_rate, comment, real, section

LENGTH = 8192
CHANNELS_MAX = 64
_HEADER_BYTES = 40
_OWN = ("stamp", "ring", "slot", "started")

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
    check_names(channels, "channel", (*_OWN, name, type_name))
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
