"""Archives and lakes that cannot be used, and recordings of an archive that cannot be tracked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class ArchiveError(LivebodeError):
    """An archive, its lake or its cluster cannot be used, or a recording ended the process that tracked it.

    Examples
    --------
    >>> import livebode
    >>> livebode.ArchiveError.codes["memory-exceeded"]
    'A recording needs more memory than a worker may use.'
    """

    area: ClassVar[str] = "archive"
    codes: ClassVar[Mapping[str, str]] = {
        "changed-meanwhile": "A recording changed between two steps of the same archive run.",
        "cluster-lost": "The scheduler of the cluster does not answer any more.",
        "cluster-unreachable": "The scheduler of the cluster does not answer, or refuses the certificate.",
        "covariate-unknown": "No run has a covariate of that name.",
        "foreign-files": "The directory of a table of the lake has files that livebode did not write.",
        "internal": "Tracking a recording ended with an internal error.",
        "lake-damaged": "A table of the lake is damaged.",
        "lake-unusable": "A table of the lake cannot be read or written.",
        "machine-unknown": "No run of the lake is of that machine.",
        "memory-exceeded": "A recording needs more memory than a worker may use.",
        "no-recordings": "No file matches the inputs of the archive.",
        "not-healthy": "Runs that a baseline is to be learned from contain alarms or a jump.",
        "nothing-in-common": "The two sides of a comparison have no quantity that both have.",
        "process-ended": "The process that tracked a recording was ended by a signal, or ended itself.",
        "quantity-ambiguous": "Several models have a quantity of that name.",
        "quantity-unknown": "No run of the lake has a quantity of that name.",
        "recipe-unknown": "No run was tracked with these settings.",
        "recording-absent": "A recording that a baseline needs is at none of its places any more, or has changed.",
        "run-unknown": "A run that is excluded is not among those to learn from.",
        "workers-lost": "The cluster has had no worker for two minutes.",
    }
    temporary_codes: ClassVar[frozenset[str]] = frozenset(
        {"changed-meanwhile", "cluster-lost", "cluster-unreachable", "lake-unusable", "process-ended", "workers-lost"}
    )
