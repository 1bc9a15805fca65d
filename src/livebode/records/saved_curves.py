"""references.json: responses and annotations that a person saved with a run."""

from __future__ import annotations

import math
import re
import secrets
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar, get_args

import numpy as np

from livebode.core import Lines, Quantity, RecordError, Responses, write_whole, writing
from livebode.dataclass import dataclass
from livebode.records.inside import read_bytes
from livebode.records.json_format import check_version, format_of
from livebode.records.summary_file import from_document, is_run, to_document

SAVED = "references.json"
REFERENCES_MAX, ANNOTATIONS_MAX = 32, 200
NAME_MAX, TEXT_MAX = 60, 200
_INFINITE = "infinite"
_SIZE_BYTES_MAX = 16 << 20
_ID = re.compile(r"[0-9a-f]{8}")
_OF_LINE = ("sigma", "coherence", "distortion", "variation")
_OF_RESPONSE = ("first", "sample", "time_s", "schedule", "dof")
T = TypeVar("T")


@dataclass(frozen=True)
class SavedReference:
    """A response with the name that a person gave it.

    Attributes
    ----------
    id
        Eight hexadecimal digits, unique in the run.
    name
        Its name.
    saved
        When it was saved: UTC, as in ISO 8601.
    response
        The response, one row, in the quantity of the run.
    """

    id: str
    name: str
    saved: str
    response: Responses


@dataclass(frozen=True)
class Annotation:
    """A text at a frequency."""

    id: str
    text: str
    frequency_hz: float


@dataclass(frozen=True)
class SavedCurves:
    """Everything in references.json. Immutable; each change gives a new object."""

    references: tuple[SavedReference, ...] = ()
    annotations: tuple[Annotation, ...] = ()

    def with_reference(self, name: str, response: Responses) -> SavedCurves:
        """Another reference; RecordError if there are too many."""
        _check_count(len(self.references), REFERENCES_MAX, "references")
        now = datetime.now(UTC).isoformat(timespec="seconds")
        new = SavedReference(secrets.token_hex(4), name[:NAME_MAX], now, response)
        return replace(self, references=(*self.references, new))

    def with_annotation(self, text: str, frequency_hz: float) -> SavedCurves:
        """Another annotation; RecordError if there are too many."""
        _check_count(len(self.annotations), ANNOTATIONS_MAX, "annotations")
        new = Annotation(secrets.token_hex(4), text[:TEXT_MAX], frequency_hz)
        return replace(self, annotations=(*self.annotations, new))

    def without(self, id: str) -> SavedCurves:
        """Without the reference or annotation of this id."""
        references = tuple(one for one in self.references if one.id != id)
        return SavedCurves(references, tuple(one for one in self.annotations if one.id != id))

    def reference(self, id: str) -> SavedReference | None:
        """The reference of this id."""
        return next((one for one in self.references if one.id == id), None)


def read_saved(run: Path) -> SavedCurves:
    """The saved references and annotations of a run; none if nothing was saved.

    Raises
    ------
    RecordError
        If the file is damaged, or a newer livebode wrote it.
    """
    path = str(run / SAVED)
    try:
        data = read_bytes(run, SAVED, _SIZE_BYTES_MAX)
    except FileNotFoundError:
        return SavedCurves()
    except OSError as error:
        raise RecordError(
            "unreadable", f"{path!r} cannot be read: {error}", "check its permissions", path=path, reason=str(error)
        ) from None
    try:
        document = from_document(data)
        check_version(run / SAVED, "references", document.get("version"))
        if document.get("format") != format_of("references")["format"]:
            raise ValueError("it does not contain references of livebode")
        references = tuple(_reference(plain) for plain in _list(document["references"], REFERENCES_MAX))
        annotations = tuple(_annotation(plain) for plain in _list(document["annotations"], ANNOTATIONS_MAX))
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
        raise RecordError(
            "damaged", f"{path!r} is damaged: {error}", "restore it from a backup", path=path, reason=str(error)
        ) from None
    return SavedCurves(references, annotations)


def change_saved(run: Path, change: Callable[[SavedCurves], SavedCurves]) -> SavedCurves:
    """Read, change and write the file as a whole; one thread of one process changes it at a time.

    Raises
    ------
    RecordError
        If the file is damaged, or the directory cannot be written or does not exist yet: a recording has one from the
        end of its run on.
    """
    path = str(run / SAVED)
    if not is_run(run):
        raise RecordError(
            "no-directory",
            f"{path!r} cannot be written yet: the run has no directory",
            "save it after the run",
            path=path,
        )
    saved = change(read_saved(run))
    document = {
        "references": [_plain(entry) for entry in saved.references],
        "annotations": [vars(entry) for entry in saved.annotations],
    }
    with writing(run / SAVED, RecordError):
        write_whole(run / SAVED, to_document(document, "references"))
    return saved


def _check_count(count: int, most: int, what: str) -> None:
    if count >= most:
        raise RecordError(
            "too-large", f"{SAVED} has {count} {what}, which is the limit", "delete one of them", limit=most
        )


def _plain(reference: SavedReference) -> dict[str, Any]:
    response = reference.response
    lines = response.lines
    plain: dict[str, Any] = {"id": reference.id, "name": reference.name, "saved": reference.saved}
    plain |= {"quantity": response.quantity, "unit": response.unit}
    plain |= {"bins": list(lines.bins), "window": lines.window, "rate_hz": lines.rate_hz}
    plain |= {name: _written(getattr(response, name)[0].item()) for name in _OF_RESPONSE}
    parts = {"re": response.value[0].real, "im": response.value[0].imag}
    parts |= {name: getattr(response, name)[0] for name in _OF_LINE}
    plain |= {name: [_written(v) for v in part.tolist()] for name, part in parts.items()}
    return plain | {"valid": response.valid[0].tolist()}


def _reference(plain: dict[str, Any]) -> SavedReference:
    lines = Lines(tuple(int(k) for k in plain["bins"]), int(plain["window"]), float(plain["rate_hz"]))
    count = len(lines)

    def numbers(name: str) -> Any:
        values = np.array([_read(v) for v in plain[name]], dtype=np.float64)
        if values.shape != (count,):
            raise ValueError(f"{name} does not have {count} values")
        return values

    rows: dict[str, Any] = {name: np.array([_read(plain[name])]) for name in ("time_s", "schedule", "dof")}
    rows |= {name: np.array([int(plain[name])], dtype=np.int64) for name in ("first", "sample")}
    if plain["quantity"] not in get_args(Quantity):
        raise ValueError("the quantity of a reference is not known")
    value = numbers("re") + 1j * numbers("im")
    response = Responses(
        lines=lines,
        value=value[np.newaxis],
        valid=np.array([[v is True for v in plain["valid"]]]).reshape(1, count),
        quantity=plain["quantity"],
        unit=str(plain["unit"]),
        **{name: numbers(name)[np.newaxis] for name in _OF_LINE},
        **rows,
    )
    return SavedReference(_id(plain), str(plain["name"])[:NAME_MAX], str(plain["saved"])[:NAME_MAX], response)


def _written(value: float) -> float | str:
    """JSON has no infinity: infinitely many degrees of freedom are a word."""
    return _INFINITE if value == math.inf else value


def _read(value: Any) -> float:
    return math.nan if value is None else math.inf if value == _INFINITE else float(value)


def _annotation(plain: dict[str, Any]) -> Annotation:
    hz = float(plain["frequency_hz"])
    if not (math.isfinite(hz) and hz > 0):
        raise ValueError("the frequency of an annotation is not positive")
    return Annotation(_id(plain), str(plain["text"])[:TEXT_MAX], hz)


def _id(plain: dict[str, Any]) -> str:
    if not _ID.fullmatch(str(plain["id"])):
        raise ValueError("an id is not eight hexadecimal digits")
    return str(plain["id"])


def _list(entries: list[T], most: int) -> list[T]:
    if not isinstance(entries, list) or len(entries) > most:
        raise ValueError(f"there are more than {most} entries, or no list of them")
    return entries
