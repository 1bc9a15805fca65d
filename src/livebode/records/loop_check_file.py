"""loop-check.json: the result of the newest `livebode validate --loop` of a run, beside its data."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from livebode.core import RecordError, write_whole, writing
from livebode.records.inside import check_own, read_bytes
from livebode.records.json_format import check_version, format_of, to_json

NAME = "loop-check.json"
_BYTES_MAX = 16 << 20


def read_loop_check(run: Path) -> dict[str, Any] | None:
    """The result as it was written; None of a run whose loop was not checked.

    Raises
    ------
    RecordError
        If the file cannot be read, or livebode did not write it.
    """
    path = run / NAME
    try:
        found = json.loads(read_bytes(run, NAME, _BYTES_MAX))
        if not isinstance(found, dict) or not isinstance(found.get("sentence"), str) or "loop" not in found:
            raise ValueError("it is not the result of a check")
    except FileNotFoundError:
        return None
    except (OSError, ValueError, RecursionError) as error:
        raise RecordError(
            "unreadable",
            f"{str(path)!r} cannot be read: {error}",
            "check the loop again",
            path=str(path),
            reason=str(error),
        ) from None
    check_version(path, "loop check", found.get("version"))
    return found


def write_loop_check(run: Path, result: dict[str, Any]) -> Path:
    """Replace the result, as a whole; RecordError if that is not possible."""
    check_own(run, NAME)
    with writing(run / NAME, RecordError):
        write_whole(run / NAME, to_json(format_of("loop check") | result, indent=2).encode())
    return run / NAME
