"""Runs that cannot be read, written or continued."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class RecordError(LivebodeError):
    """A run's directory cannot be read, written or continued."""

    area: ClassVar[str] = "record"
    codes: ClassVar[Mapping[str, str]] = {
        "baseline-differs": "The unfinished run was started with another baseline, or with none.",
        "changed-meanwhile": "The run's record changed while its source was opened.",
        "configuration-differs": "The unfinished run was started with another configuration.",
        "not-removable": "The run cannot be removed.",
        "not-tracked": "The run does not name the channels that are needed.",
        "not-written": "The system refuses to write the run.",
        "unexpected-content": "A file of the run is whole, but contains what a run does not write.",
    }
