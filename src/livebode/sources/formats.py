"""Format of a file, detected from its content. A new format is one line in FORMATS."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from livebode.core import LivebodeError, RecordingError
from livebode.locations import Location, shared_copy
from livebode.sources.bag import parts_of
from livebode.sources.dbc import no_frames
from livebode.sources.recording import Recording, contained, located
from livebode.sources.svdxdata import is_project

HEAD_BYTES = 1024
MDF_MAGIC = b"MDF     ", b"UnFinMF "
ULOG_MAGIC = b"ULog\x01\x12\x35"
HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"


@dataclass(frozen=True)
class Format:
    """A format: its file name endings, a test of its first bytes, and the class that reads it.

    The class is named by module so that h5py and the like are imported only for the files that need them. With
    `takes_dbc` it is called with the file that defines the signals in CAN frames, with `takes_directory` with the
    directory of a bag whose first file it matches.
    """

    title: str
    suffixes: tuple[str, ...]
    matches: Callable[[bytes], bool]
    module: str
    takes_dbc: bool = False
    takes_directory: bool = False

    def open(self, path: Path, dbc: Path | None = None) -> Recording:
        reader: Callable[..., Recording] = import_module(f"livebode.sources.{self.module}").READER
        if dbc is not None and not self.takes_dbc:
            raise no_frames(path, self.title)
        with contained(path, self.title):
            return reader(path, dbc) if self.takes_dbc else reader(path)


def is_text(head: bytes) -> bool:
    """True if the bytes may be a text table: a byte order mark, or no control bytes.

    >>> is_text(b"t,u\\n0,1\\n"), is_text(b"\\x00\\x01\\x02")
    (True, False)
    """
    if head.startswith((codecs.BOM_UTF8, codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return True
    body = head.rstrip(b"\x1a\r\n")  # a text may end with Ctrl-Z
    return bool(head) and not any(byte < 9 or 13 < byte < 27 for byte in body)


def is_xml(head: bytes) -> bool:
    return head.removeprefix(codecs.BOM_UTF8).lstrip().startswith(b"<")


TWINCAT = re.compile(
    rb"(?:\xef\xbb\xbf)?Name([\t;,|: ])[^\r\n]*\r?\n"
    rb"(?:File|SymbolComment|Data-Type|SampleTime\[ms\]|NetI[dD]|SymbolName)\1"
)
"""First two lines of a TwinCAT export: of its file, or of its channels where the file's own lines were left out."""


CODESYS = re.compile(rb"(?:\xef\xbb\xbf)?\[key\];[ \t]*\[value\]\s*\n")


def is_wav(head: bytes) -> bool:
    return head.startswith((b"RIFF", b"RIFX", b"RF64")) and head[8:12] == b"WAVE"


ASC_HEAD = re.compile(
    rb"(?:\s*//[^\n]*\n)*\s*(?:date\s[^\n]*\n\s*)?base\s+(?:hex|dec)\s+timestamps\s+(\w+)", re.IGNORECASE
)
"""First lines of a text log of Vector, with the kind of its timestamps."""
ARROW_MAGIC = b"ARROW1\0\0", b"\xff\xff\xff\xff"

_FOREIGN = (
    (b"\x89PNG\r\n\x1a\n", "a picture (PNG)", "name the recording"),
    (b"\xff\xd8\xff", "a picture (JPEG)", "name the recording"),
    (b"%PDF", "a PDF document", "name the recording"),
    (b"\xd0\xcf\x11\xe0", "an Excel workbook (.xls) or another Office document", "save its table as CSV"),
    (b"\x1f\x8b", "compressed (gzip)", "unpack it first"),
    (b"BZh", "compressed (bzip2)", "unpack it first"),
    (b"7z\xbc\xaf", "a 7-Zip archive", "unpack it first"),
    (b"Rar!", "a RAR archive", "unpack it first"),
)
"""What a person may name by mistake: first bytes, what it is, and what to do."""
_ZIPPED_OFFICE = (b"[Content_Types].xml", b"_rels/", b"docProps/", b"xl/")
_NAME_IN_ZIP = 30  # where the name of its first file begins

FORMATS = (
    Format("Parquet", (".parquet", ".pq"), lambda head: head.startswith(b"PAR1"), "parquet"),
    Format("Arrow", (".arrow", ".feather", ".ipc"), lambda head: head.startswith(ARROW_MAGIC), "arrow"),
    Format("MATLAB", (".mat",), lambda head: head.startswith(b"MATLAB 5.0 MAT-file"), "matlab"),
    Format("MATLAB 7.3", (".mat",), lambda head: head[512:].startswith(HDF5_MAGIC), "matlab73"),
    Format("HDF5", (".h5", ".hdf5", ".hdf", ".he5"), lambda head: head.startswith(HDF5_MAGIC), "hdf5"),
    Format("NPZ", (".npz",), lambda head: head.startswith(b"PK\x03\x04"), "npz"),
    Format("TDMS", (".tdms",), lambda head: head.startswith(b"TDSm"), "tdms"),
    Format("MDF", (".mf4", ".mdf", ".dat"), lambda head: head.startswith(MDF_MAGIC), "mdf", takes_dbc=True),
    Format("ULog", (".ulg", ".ulog"), lambda head: head.startswith(ULOG_MAGIC), "ulog"),
    Format("WAV", (".wav",), is_wav, "wav"),
    Format("MCAP", (".mcap",), lambda head: head.startswith(b"\x89MCAP0\r\n"), "mcap", takes_directory=True),
    Format("ROS 2 bag", (".db3",), lambda head: head.startswith(b"SQLite format 3\0"), "rosbag", takes_directory=True),
    Format("BLF", (".blf",), lambda head: head.startswith(b"LOGG"), "blf", takes_dbc=True),
    Format("ASC", (".asc",), lambda head: ASC_HEAD.match(head) is not None, "asc", takes_dbc=True),
    Format("TwinCAT Scope project", (".svdx",), is_project, "svdx"),
    Format("Sinumerik XML", (".xml",), is_xml, "sinumerik"),
    Format("TwinCAT Scope export", (".csv", ".txt"), lambda head: TWINCAT.match(head) is not None, "twincat"),
    Format("CODESYS trace", (".csv", ".txt"), lambda head: CODESYS.match(head) is not None, "codesys"),
    Format("LabVIEW LVM", (".lvm",), lambda head: head.startswith(b"LabVIEW Measurement"), "lvm"),
    Format("CSV", (".csv", ".tsv", ".txt", ".dat", ".asc", ".tab"), is_text, "delimited"),
)  # fmt: skip
"""All formats; the first that matches reads the file."""


def open_recording(place: Location, dbc: Path | None = None) -> Recording:
    """Open `place` with the format that its content has; `dbc` defines the signals in CAN frames.

    Raises
    ------
    RecordingError
        For a file that is missing, empty, unreadable, or not in one of the formats; for a `dbc` with a file that
        has no CAN frames.
    LocationError
        If it is at a URL and cannot be downloaded.
    ExtraError
        Where the package that reads its format, or its storage, is not installed.
    """
    if isinstance(place, Path):
        return _opened(place, dbc)
    copy = shared_copy(place)
    with located(copy.path):
        recording = _opened(copy.path, dbc)
    recording.copy = copy
    return recording


def _opened(path: Path, dbc: Path | None) -> Recording:
    first, head = read_head(path)
    _refuse_foreign(first, head)
    for format_ in FORMATS:
        if format_.matches(head) and (format_.takes_directory or first == path):
            return checked(format_.open(path, dbc))
    path = first
    suffix = path.suffix.lower()
    named = [format_.title for format_ in FORMATS if suffix in format_.suffixes]
    if named:
        raise RecordingError(
            "format-unknown",
            f"{path} is not {' or '.join(named)}, although its ending is {suffix}: it begins with {head[:8]!r}",
            "check that the file is complete",
            path=str(path),
            suffix=suffix,
            beginning=head[:8].hex(),
        )
    known = " ".join(dict.fromkeys(suffix for format_ in FORMATS for suffix in format_.suffixes))
    raise RecordingError(
        "format-unknown",
        f"the format of {path} is not supported (it begins with {head[:8]!r})",
        f"convert it to one of: {known}",
        path=str(path),
        suffix=suffix,
        beginning=head[:8].hex(),
    )


def _refuse_foreign(path: Path, head: bytes) -> None:
    """RecordingError for a file of a known kind that is no recording."""
    found = next(((what, remedy) for magic, what, remedy in _FOREIGN if head.startswith(magic)), None)
    if head.startswith(b"PK\x03\x04") and head[_NAME_IN_ZIP:].startswith(_ZIPPED_OFFICE):
        found = "an Excel workbook (.xlsx) or another Office document", "save its table as CSV"
    if found is not None:
        raise RecordingError(
            "format-unknown",
            f"{path} is not a recording, but {found[0]}",
            found[1],
            path=str(path),
            suffix=path.suffix.lower(),
            beginning=head[:8].hex(),
        )


def read_head(path: Path) -> tuple[Path, bytes]:
    """The file, of a bag its first one, and its first bytes."""
    try:
        path, *_ = parts_of(path)
        if path.exists() and not path.is_file():
            raise RecordingError(
                "not-a-file", f"{path} is not a regular file", "write the recording to a file first", path=str(path)
            )
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
    except LivebodeError:
        raise
    except FileNotFoundError:
        raise RecordingError("not-found", f"there is no file {path}", "check the name", path=str(path)) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RecordingError(
            "not-readable", f"cannot read {path}: {reason}", "check its name and permissions", path=str(path)
        ) from None
    if not head:
        raise RecordingError("empty", f"{path} is empty", "check that the recording is complete", path=str(path))
    return path, head


def checked(recording: Recording) -> Recording:
    """The recording, if no two of its columns share a name."""
    seen: dict[str, int] = {}
    for at, column in enumerate(recording.columns, start=1):
        if column.name in seen:
            first = seen[column.name]
            raise RecordingError(
                "channel-duplicated",
                f"channel name {column.name!r} is duplicated in {recording.path} (columns {first} and {at})",
                "rename one of the columns",
                path=str(recording.path),
                channel=column.name,
                columns=[first, at],
            )
        seen[column.name] = at
    return recording
