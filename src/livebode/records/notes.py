"""notes.json: the tags and the notes of a person, beside the data of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError, field_validator

from livebode.core import RecordError, write_whole, writing
from livebode.records.inside import check_own, read_bytes
from livebode.records.json_format import check_version, format_of, to_json

NAME = "notes.json"
_BYTES_MAX = 32 << 10
Tag = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=40, pattern=r"^[^,\x00-\x1f]+$")]


class Notes(BaseModel):
    """What a person wrote about a run.

    Attributes
    ----------
    tags
        At most 20 words, of at most 40 letters and without commas, each once.
    text
        At most 2,000 letters.

    Examples
    --------
    >>> Notes(tags=["belt", " belt ", "after service"], text="new belt").tags
    ['belt', 'after service']
    """

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    tags: list[Tag] = Field(default=[], max_length=20)
    text: Annotated[str, Field(max_length=2000)] = ""

    @field_validator("tags")
    @classmethod
    def _each_once(cls, tags: list[str]) -> list[str]:
        return list(dict.fromkeys(tags))


class _File(Notes):
    format: Literal["livebode notes"]
    version: int


def read_notes(run: Path) -> Notes:
    """The notes of a run, empty if it has none.

    Raises
    ------
    RecordError
        If the file cannot be read, or livebode did not write it.
    """
    path = run / NAME
    try:
        data = read_bytes(run, NAME, _BYTES_MAX)
        found = _File.model_validate_json(data)
    except FileNotFoundError:
        return Notes()
    except (OSError, ValidationError) as error:
        reason = error.errors()[0]["msg"] if isinstance(error, ValidationError) else str(error)
        raise RecordError(
            "unreadable",
            f"{str(path)!r} cannot be read: {reason}",
            "correct it, or move it away",
            path=str(path),
            reason=reason,
        ) from None
    check_version(path, "notes", found.version)
    return Notes(tags=found.tags, text=found.text)


def write_notes(run: Path, notes: Notes) -> None:
    """Replace the notes of a run, as a whole; RecordError if that is not possible."""
    check_own(run, NAME)
    with writing(run / NAME, RecordError):
        write_whole(run / NAME, to_json(format_of("notes") | notes.model_dump(), indent=2).encode("utf-8", "replace"))
