"""Commands of drives and PLCs."""

from __future__ import annotations

from collections.abc import Mapping

from livebode.cli import MEASURE, Command

COMMANDS: Mapping[str, Command] = {
    "plc": Command(
        "Write function blocks for the PLC of an axis: excitation, sliding DFT and the ring buffer "
        "that livebode reads.",
        "livebode_drives.plc_command:plc_command",
        panel=MEASURE,
    ),
}
