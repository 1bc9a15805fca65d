"""Runs that cannot be read, written or continued."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class RecordError(LivebodeError):
    """A run's directory cannot be read, written or continued.

    Examples
    --------
    >>> import livebode
    >>> try:
    ...     livebode.Run("src")
    ... except livebode.RecordError as error:
    ...     print(error.code)
    record.not-a-run
    """

    area: ClassVar[str] = "record"
    codes: ClassVar[Mapping[str, str]] = {
        "baseline-differs": "The unfinished run was started with another baseline, or with none.",
        "changed-meanwhile": "The run's record changed while its source was opened.",
        "configuration-differs": "The unfinished run was started with another configuration.",
        "damaged": "A file of the run is not as it was written, or incomplete, and cannot be read.",
        "entry-missing": "The run has a matrix of responses, and no entry of it was chosen.",
        "entry-unknown": "The matrix of the run has no such entry.",
        "exists": "The directory of the run exists already.",
        "finished": "The run is finished and cannot be continued.",
        "foreign-files": "The directory has files that livebode did not write, so it is neither used nor replaced.",
        "locked": "Another process records in this directory.",
        "matrix-unsupported": "The run is a matrix run, where one with a single response is needed.",
        "newer-version": "A file of the run was written by a newer version of livebode.",
        "no-directory": "The run has no directory yet: it is written in one piece, at its end.",
        "no-matrix": "The run has one response, and no matrix of them.",
        "no-parameters": "The run has no fitted parameters.",
        "no-responses": "The run has no responses.",
        "no-samples": "The run has not recorded the samples that are needed.",
        "not-a-run": "The path is not the directory of a run.",
        "not-continuable": "The run has no whole journal to continue from.",
        "not-own-file": "A link, a pipe or a device is where a run has a regular file or a directory.",
        "not-removable": "The run cannot be removed.",
        "not-tracked": "The run does not name the channels that are needed.",
        "not-written": "The system refuses to write the run.",
        "proposal-invalid": "The stored proposal of livebode tune is damaged, or is not the one that the run gives.",
        "states-differ": "The unfinished run has the states of another version of livebode.",
        "too-large": "A file of the run is larger than a run writes it.",
        "unexpected-content": "A file of the run is whole, but contains what a run does not write.",
        "unreadable": "The system or a library cannot read a file of the run.",
    }
    temporary_codes: ClassVar[frozenset[str]] = frozenset({"changed-meanwhile", "locked"})
