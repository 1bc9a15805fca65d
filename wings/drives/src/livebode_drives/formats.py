"""Formats of drives, PLCs, buses and robots, in the order in which they are tried."""

from __future__ import annotations

import codecs
import re
import struct
from collections.abc import Callable

from livebode.sources import COLUMNS_MAX, Format

MDF_MAGIC = b"MDF     ", b"UnFinMF "
ULOG_MAGIC = b"ULog\x01\x12\x35"
ASC_HEAD = re.compile(
    rb"(?:\s*//[^\n]*\n)*\s*(?:date\s[^\n]*\n\s*)?base\s+(?:hex|dec)\s+timestamps\s+(\w+)", re.IGNORECASE
)
"""First lines of a text log of Vector, with the kind of its timestamps."""
TWINCAT = re.compile(
    rb"(?:\xef\xbb\xbf)?Name([\t;,|: ])[^\r\n]*\r?\n"
    rb"(?:File|SymbolComment|Data-Type|SampleTime\[ms\]|NetI[dD]|SymbolName)\1"
)
"""First two lines of a TwinCAT export: of its file, or of its channels where the file's own lines were left out."""
CODESYS = re.compile(rb"(?:\xef\xbb\xbf)?\[key\];[ \t]*\[value\]\s*\n")
SCOPE_HEAD = struct.Struct("<QQI")
"""Head of a Scope project: offset and length of its XML, number of acquisitions."""
SCOPE_ENTRY = struct.Struct("<QQI")
"""Offset and length of an acquisition, and its handle."""
_BAG = "livebode_drives.recordings.ros:parts_of"


def is_xml(head: bytes) -> bool:
    return head.removeprefix(codecs.BOM_UTF8).lstrip().startswith(b"<")


def is_project(head: bytes) -> bool:
    """True if a file with these first bytes is a Scope project with data: its table ends where the data begins."""
    if len(head) < SCOPE_HEAD.size + SCOPE_ENTRY.size:
        return False
    offset, _, count = SCOPE_HEAD.unpack_from(head)
    first = SCOPE_ENTRY.unpack_from(head, SCOPE_HEAD.size)[0] if count else offset
    return 0 <= count <= COLUMNS_MAX and bool(first == SCOPE_HEAD.size + count * SCOPE_ENTRY.size)


def _begins(magic: bytes | tuple[bytes, ...]) -> Callable[[bytes], bool]:
    return lambda head: head.startswith(magic)


def _matches(pattern: re.Pattern[bytes]) -> Callable[[bytes], bool]:
    return lambda head: pattern.match(head) is not None


def _own(reader: str) -> str:
    return f"livebode_drives.recordings.{reader}"


FORMATS = (
    Format("MDF", (".mf4", ".mdf", ".dat"), _begins(MDF_MAGIC), _own("mdf:open_mdf"), takes_dbc=True),
    Format("ULog", (".ulg", ".ulog"), _begins(ULOG_MAGIC), _own("ulog:ULogRecording")),
    Format("MCAP", (".mcap",), _begins(b"\x89MCAP0\r\n"), _own("mcap:McapRecording"), parts=_BAG),
    Format("ROS 2 bag", (".db3",), _begins(b"SQLite format 3\0"), _own("rosbag:RosbagRecording"), parts=_BAG),
    Format("BLF", (".blf",), _begins(b"LOGG"), _own("blf:BlfRecording"), takes_dbc=True),
    Format("ASC", (".asc",), _matches(ASC_HEAD), _own("asc:AscRecording"), takes_dbc=True),
    Format("TwinCAT Scope project", (".svdx",), is_project, _own("svdx:ScopeProjectRecording")),
    Format("Sinumerik XML", (".xml",), is_xml, _own("sinumerik:SinumerikRecording")),
    Format("TwinCAT Scope export", (".csv", ".txt"), _matches(TWINCAT), _own("twincat:TwinCatRecording")),
    Format("CODESYS trace", (".csv", ".txt"), _matches(CODESYS), _own("codesys:CodesysRecording")),
    Format("LabVIEW LVM", (".lvm",), _begins(b"LabVIEW Measurement"), _own("lvm:LvmRecording")),
)  # fmt: skip
"""The first that matches reads the file, before livebode's own: any text may be CSV."""
