"""Format of a file, detected from its content."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from livebode.core import LivebodeError, RecordingError
from livebode.dataclass import dataclass
from livebode.locations import Location, shared_copy
from livebode.plugins import loaded, tables, wings_left_out
from livebode.sources.recording import Recording, contained, located

HEAD_BYTES = 1024
HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"


@dataclass(frozen=True)
class Format:
    """A format of recordings.

    Attributes
    ----------
    title
        Its name in messages.
    suffixes
        Endings of its files, for messages.
    matches
        Whether a file is in this format, from its first `HEAD_BYTES` bytes.
    reader
        "module:name" of what is called with the path and returns a `Recording`; h5py and the like are imported only
        for the files that need them.
    takes_dbc
        It is also called with the file that defines the signals in CAN frames.
    parts
        "module:name" of what lists the files of a directory that is one recording, in their order; none of another
        directory. The reader is called with the directory whose first file matches. Empty: a recording is one file.
    """

    title: str
    suffixes: tuple[str, ...]
    matches: Callable[[bytes], bool]
    reader: str
    takes_dbc: bool = False
    parts: str = ""

    def open(self, path: Path, dbc: Path | None = None) -> Recording:
        reader: Callable[..., Recording] = loaded(self.reader)
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


def is_wav(head: bytes) -> bool:
    return head.startswith((b"RIFF", b"RIFX", b"RF64")) and head[8:12] == b"WAVE"


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
_NOT_A_TABLE = re.compile(
    rb"(?:\xef\xbb\xbf)?(?:\s*<|LabVIEW Measurement|\[key\];[ \t]*\[value\]|"
    rb"(?i:(?:\s*//[^\n]*\n)*\s*(?:date\s[^\n]*\n\s*)?base\s+(?:hex|dec)\s+timestamps)|"
    rb"Name([\t;,|: ])[^\r\n]*\r?\n(?:File|SymbolComment|Data-Type|SampleTime\[ms\]|NetI[dD]|SymbolName)\1)"
)
"""Text of programs that is read as CSV with wrong names, or not at all, where the wing drives was left out."""
_JSON = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:\{\s*\"|\[\s*[\[{\"])")
_ZIPPED_OFFICE = (b"[Content_Types].xml", b"_rels/", b"docProps/", b"xl/")
_NAME_IN_ZIP = 30  # where the name of its first file begins


def _begins(magic: bytes | tuple[bytes, ...]) -> Callable[[bytes], bool]:
    return lambda head: head.startswith(magic)


def _own(reader: str) -> str:
    return f"livebode.sources.{reader}"


FORMATS = (
    Format("Parquet", (".parquet", ".pq"), _begins(b"PAR1"), _own("parquet:open_parquet")),
    Format("Arrow", (".arrow", ".feather", ".ipc"), _begins(ARROW_MAGIC), _own("arrow:open_arrow")),
    Format("MATLAB", (".mat",), _begins(b"MATLAB 5.0 MAT-file"), _own("matlab:MatlabRecording")),
    Format("MATLAB 7.3", (".mat",), lambda head: head[512:].startswith(HDF5_MAGIC), _own("hdf5:Matlab73Recording")),
    Format("HDF5", (".h5", ".hdf5", ".hdf", ".he5"), _begins(HDF5_MAGIC), _own("hdf5:Hdf5Recording")),
    Format("NPZ", (".npz",), _begins(b"PK\x03\x04"), _own("npz:NpzRecording")),
    Format("TDMS", (".tdms",), _begins(b"TDSm"), _own("tdms:TdmsRecording")),
    Format("WAV", (".wav",), is_wav, _own("wav:WavRecording")),
    Format("CSV", (".csv", ".tsv", ".txt", ".dat", ".asc", ".tab"), is_text, _own("delimited:DelimitedRecording")),
)  # fmt: skip
"""livebode's formats; of all, the first that matches reads the file."""


def all_formats() -> list[Format]:
    """All formats in the order in which they are tried: those of plug-ins first, because any text may be CSV."""
    return [format_ for table in reversed(tables("readers")) for format_ in table]


def open_file(place: Location, dbc: Path | None = None) -> Recording:
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
        return _with_short_names(_opened(place, dbc))
    copy = shared_copy(place)
    with located(copy.path):
        recording = _opened(copy.path, dbc)
    recording.copy = copy
    return _with_short_names(recording)


def _with_short_names(recording: Recording) -> Recording:
    """Names that contain that of the file, as dSPACE writes them, have an alias that other files have too."""
    columns = []
    for column in recording.columns:
        short = recording.without_file(column.name)
        aliases = column.aliases if short == column.name else (*column.aliases, short)
        columns.append(replace(column, aliases=aliases))
    recording.columns = tuple(columns)
    return recording


def _opened(path: Path, dbc: Path | None) -> Recording:
    first, head = read_head(path)
    _refuse_foreign(first, head)
    formats = all_formats()
    for format_ in formats:
        if format_.matches(head) and (format_.parts or first == path):
            if format_ is FORMATS[-1] and _NOT_A_TABLE.match(head) and wings_left_out("readers"):
                break
            return checked(format_.open(path, dbc))
    path = first
    suffix = path.suffix.lower()
    named = [format_.title for format_ in formats if suffix in format_.suffixes]
    left_out = " and ".join(wings_left_out("readers"))
    if named and not left_out:
        raise RecordingError(
            "format-unknown",
            f"{path} is not {' or '.join(named)}, although its ending is {suffix}: it begins with {head[:8]!r}",
            "check that the file is complete",
            path=str(path),
            suffix=suffix,
            beginning=head[:8].hex(),
        )
    known = " ".join(dict.fromkeys(suffix for format_ in formats for suffix in format_.suffixes))
    raise RecordingError(
        "format-unknown",
        f"the format of {path} is not supported (it begins with {head[:8]!r})",
        f"install the wing {left_out} of livebode, or save its table as CSV"
        if left_out
        else f"convert it to one of: {known}",
        path=str(path),
        suffix=suffix,
        beginning=head[:8].hex(),
    )


def _refuse_foreign(path: Path, head: bytes) -> None:
    """RecordingError for a file of a known kind that is no recording."""
    found = next(((what, remedy) for magic, what, remedy in _FOREIGN if head.startswith(magic)), None)
    if head.startswith(b"PK\x03\x04") and head[_NAME_IN_ZIP:].startswith(_ZIPPED_OFFICE):
        found = "an Excel workbook (.xlsx) or another Office document", "save its table as CSV"
    if _JSON.match(head):
        found = "JSON, as of a configuration or of results", "name the recording itself"
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
    """The file, of a directory that is one recording its first one, and its first bytes."""
    try:
        path = _first_part(path) if path.is_dir() else path
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


def _first_part(directory: Path) -> Path:
    for lister in dict.fromkeys(format_.parts for format_ in all_formats() if format_.parts):
        for part in loaded(lister)(directory):
            return Path(part)
    message, remedy = f"{directory} is a directory", "name the file in it"
    if (directory / "run.json").exists():
        message, remedy = f"{directory} is a run, not a recording", f"see its results: livebode view {directory}"
    raise RecordingError("not-a-file", message, remedy, path=str(directory))


def no_frames(path: Path, title: str) -> RecordingError:
    """The error for a DBC that is given with a file without CAN frames."""
    return RecordingError(
        "no-frames",
        f"{path} is {title}, which has no CAN frames, but dbc is given",
        "omit dbc, or check that the file is complete",
        path=str(path),
        argument="dbc",
    )


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
