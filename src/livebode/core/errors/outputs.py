"""Errors of what is written or served: runs, files, states, receivers, the dashboard, archives and fleets."""

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
        "foreign-files": "The directory has files that livebode did not write, or other runs, and is not replaced.",
        "locked": "Another process records in this directory.",
        "matrix-unsupported": "The run is a matrix run, where one with a single response is needed.",
        "newer-version": "A file of the run was written by a newer version of livebode.",
        "no-directory": "The run has no directory yet: that of a recording appears at its end.",
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
        "older-version": "A file of the run was written by an older version of livebode.",
        "proposal-invalid": "The stored proposal of livebode tune is damaged, or is not the one that the run gives.",
        "states-differ": "The unfinished run has the states of another version of livebode.",
        "too-large": "A file of the run is larger than a run writes it.",
        "unexpected-content": "A file of the run is whole, but contains what a run does not write.",
        "unreadable": "The system or a library cannot read a file of the run.",
    }
    temporary_codes: ClassVar[frozenset[str]] = frozenset({"changed-meanwhile", "locked"})


class OutputError(LivebodeError):
    """A file that was asked for cannot be written.

    Examples
    --------
    >>> import livebode
    >>> from pathlib import Path
    >>> from livebode.export import save
    >>> try:
    ...     save(Path("."), write=Path.touch)
    ... except livebode.OutputError as error:
    ...     print(error.code)
    output.is-directory
    """

    area: ClassVar[str] = "output"
    codes: ClassVar[Mapping[str, str]] = {
        "exists": "The file or directory exists already, and is replaced only on request.",
        "is-directory": "The path of the file is a directory.",
        "no-font": "This computer has no font with the letters of the language, and a PDF contains its fonts.",
        "not-archivable": "The content cannot be written as PDF/A.",
        "not-replaceable": "The directory contains something else than an earlier output, and is not replaced.",
        "not-written": "The system refuses to write the output.",
        "too-large": "There are more values than can be written in this format.",
    }


class StateError(LivebodeError):
    """The state of a stage cannot be restored; the stage is then unchanged.

    Examples
    --------
    >>> import livebode
    >>> livebode.StateError.codes["newer-version"]
    'The state was written by a newer version of livebode.'
    """

    area: ClassVar[str] = "state"
    codes: ClassVar[Mapping[str, str]] = {
        "damaged": "The state is not as it was written, or incomplete.",
        "newer-version": "The state was written by a newer version of livebode.",
        "not-a-state": "The bytes are not a state that livebode wrote.",
        "older-version": "The state was written by an older version of livebode.",
        "other-settings": "The state belongs to a stage with other settings.",
        "other-stage": "The state belongs to another stage.",
    }


class DamageWarning(UserWarning):
    """A file of a run or a lake is damaged; its damaged part is left out, and the rest is read."""


class PublishError(LivebodeError):
    """A receiver of a [[publish]] section did not take a message. The run continues.

    Examples
    --------
    >>> import livebode
    >>> livebode.PublishError.codes["not-taken"]
    'The receiver refuses this message permanently; it is not sent again.'
    """

    area: ClassVar[str] = "publish"
    codes: ClassVar[Mapping[str, str]] = {
        "cannot-listen": "The operating system does not let livebode listen at the address of a [[publish]] section.",
        "not-taken": "The receiver refuses this message permanently; it is not sent again.",
        "nothing-configured": "The configuration has no [[publish]] section.",
        "outbox-foreign": "The file for the events that wait for delivery was written by another program.",
        "outbox-unusable": "The file with the events that wait for delivery cannot be used.",
        "refused": "The receiver answers, and refuses messages now; they are sent again.",
        "unreachable": "The receiver cannot be reached, or does not answer in time; messages are sent again.",
    }
    temporary_codes: ClassVar[frozenset[str]] = frozenset({"outbox-unusable", "unreachable", "refused"})


class ServerError(LivebodeError):
    """The dashboard cannot be served or reached.

    Examples
    --------
    >>> import livebode
    >>> livebode.ServerError.codes["port-taken"]
    'Another program listens at this port.'
    """

    area: ClassVar[str] = "server"
    codes: ClassVar[Mapping[str, str]] = {
        "busy": "Too many requests wait already.",
        "cannot-listen": "The operating system does not let the dashboard listen at this address.",
        "disk-full": "The disk has no room for an upload and the run of it.",
        "entry-only": "This is one entry of a matrix run, with which nothing can be saved.",
        "event-unknown": "An event with this key does not exist.",
        "file-unknown": "A file of this name is not among those that the page offers.",
        "job-not-started": "The operating system did not start the process of a job.",
        "job-unknown": "A job of this name was not started since the server started.",
        "name-invalid": "The text cannot be the name of a file.",
        "no-alarm": "The event is not an alarm, so it cannot be shelved.",
        "not-begun": "The run has no samples or responses yet.",
        "not-started": "The dashboard did not start in time.",
        "port-taken": "Another program listens at this port.",
        "quantity-unavailable": "The quantity cannot be computed from what the run knows.",
        "reference-unknown": "A reference with this id is not saved with the run.",
        "request-malformed": "A request or message of a browser is not what the dashboard takes.",
        "run-ended": "The run has ended, so its record cannot be changed.",
        "run-unknown": "A run of this name is not in the directory that is served.",
        "task-unknown": "No installed wing has the command of this task.",
        "too-many-tries": "Wrong tokens came too often from this address.",
        "upload-incomplete": "An upload ended before its announced length.",
        "upload-too-long": "An upload is longer than the page receives.",
    }
    temporary_codes: ClassVar[frozenset[str]] = frozenset({"busy", "job-not-started", "not-started", "port-taken"})


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


class FleetError(LivebodeError):
    """A fleet, its log or one of its axes cannot be used.

    Examples
    --------
    >>> import livebode
    >>> livebode.FleetError.codes["log-unreachable"]
    'The server of the log cannot be reached, or rejects the connection.'
    """

    area: ClassVar[str] = "fleet"
    codes: ClassVar[Mapping[str, str]] = {
        "authority-unusable": "The certificate of the authority of the log cannot be used.",
        "axis-duplicated": "Two axes of the fleet have the same site, line, machine and axis.",
        "axis-failed": "The messages of an axis cannot be tracked with its configuration.",
        "axis-unknown": "The fleet has no axis of this path.",
        "axis-unnamed": "An axis of the fleet has no [machine] section, so its place in the log is not defined.",
        "buffer-locked": "Another process uses the disk buffer of an edge.",
        "buffer-unusable": "The disk buffer of an edge cannot be read or written.",
        "cluster-open": "Others could join the servers of the log, because they have no TLS or no authority.",
        "credentials-unusable": "A file with the key of a user of the log cannot be used, or can be by others.",
        "leaf-missing": "The configuration of the fleet has no section [leaf].",
        "leaf-open": "The way of a leaf node to the log has no mutual TLS.",
        "leaves-unknown": "The server of the log could not check the certificates of leaf nodes.",
        "log-incomplete": "The log no longer has its beginning, so the results cannot be computed again.",
        "log-refused": "The server of the log does not accept the key of the user.",
        "log-unreachable": "The server of the log cannot be reached, or rejects the connection.",
        "log-untrusted": "The server of the log has no TLS, or a certificate that is not trusted.",
        "member-unknown": "It is not known which server of the cluster is meant.",
        "no-data": "The log has no data of this axis in the time that was asked for.",
        "not-exactly-once": "Stored responses are missing, doubled or different from one uninterrupted computation.",
        "partitions-changed": "The number of partitions differs from that of the data in the log.",
        "results-of-other-version": "The results in the log were written by another version of livebode.",
        "server-ended": "The server of the log ended at its start.",
        "server-missing": "The program nats-server is not installed.",
        "server-open": "The server of the log would be open to a network without TLS or keys.",
        "servers-missing": "The log is to have more copies than there are servers.",
        "view-only": "The key of this user may read the log, and store nothing there.",
        "worker-not-started": "The system starts no process for a worker of a fleet.",
    }
    temporary_codes: ClassVar[frozenset[str]] = frozenset(
        {"buffer-locked", "buffer-unusable", "log-unreachable", "worker-not-started"}
    )
