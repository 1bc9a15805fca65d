"""Errors of what goes in: arguments, configurations, recordings, live sources, and packages that are not installed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class ExtraError(LivebodeError):
    """An optional package that this needs is not installed.

    Examples
    --------
    >>> import livebode
    >>> livebode.ExtraError.codes["not-installed"]
    'The package that this needs is not installed.'
    """

    area: ClassVar[str] = "extra"
    codes: ClassVar[Mapping[str, str]] = {
        "not-installed": "The package that this needs is not installed.",
    }


class UsageError(LivebodeError):
    """An argument of a call, or an option of a command, cannot be used.

    Examples
    --------
    >>> import livebode
    >>> lines = livebode.Lines.parse("20:140:20", rate_hz=4000, window=400)
    >>> try:
    ...     livebode.multisine(lines, amplitude=[1.0, 2.0])
    ... except livebode.UsageError as error:
    ...     print(error.code)
    usage.wrong-shape
    """

    area: ClassVar[str] = "usage"
    codes: ClassVar[Mapping[str, str]] = {
        "conflict": "Two arguments, or an argument and what it is used with, do not go together.",
        "duplicate": "A name or value is given twice where it may be given once.",
        "invalid-name": "A name has a form that is not allowed.",
        "missing": "A required argument is missing or empty.",
        "not-finite": "An argument has a value that is not a finite number.",
        "not-one-of": "An argument is not one of the allowed values.",
        "options": "The options of a command cannot be used as given.",
        "out-of-range": "The value is outside the range of the argument.",
        "query-rejected": "The database rejects the SQL of a query.",
        "too-large": "What the arguments ask for needs more memory than there is.",
        "too-many": "There are more values than the argument allows.",
        "unknown-name": "There is nothing of this name; the allowed names are given.",
        "unreadable": "The text or data of an argument cannot be read.",
        "wrong-shape": "An array or list does not have the shape that is needed.",
    }


class SourceError(LivebodeError):
    """A live source cannot be opened, or sends what cannot be used.

    Examples
    --------
    >>> import livebode
    >>> livebode.SourceError.codes["no-samples"]
    'No samples came in time.'
    """

    area: ClassVar[str] = "source"
    codes: ClassVar[Mapping[str, str]] = {
        "batch-shape": "A batch of samples or spectra has another shape than its channels need, or too many values.",
        "cannot-grow": "The file to follow is of a format that cannot grow.",
        "channel-unknown": "The live source has no channel of this name.",
        "channels-invalid": "The sender's channels are too many, or their names are missing, duplicated or unusable.",
        "frame-damaged": "Bytes are not a frame, or the frame was damaged on its way.",
        "frame-inconsistent": "A frame contradicts its own header or its layout.",
        "frame-too-long": "The samples are too many for one frame.",
        "frame-unsupported": "The version, kind or flags of a frame are not supported.",
        "key-missing": "A required key or field is missing in a message of the sender.",
        "key-unknown": "A message of the sender has an unknown key.",
        "layout-invalid": "The text that describes the channels or spectra cannot be read.",
        "line-not-json": "A line of the sender is not a JSON object.",
        "line-not-numbers": "A line of the sender does not have a number for each channel.",
        "line-too-long": "A line of the sender is longer than is read.",
        "no-samples": "No samples came in time.",
        "not-found": "The file to follow does not exist yet.",
        "refused": "The machine refuses the connection, or does not give what was asked for; it is not tried again.",
        "ring-invalid": "The symbol in the PLC is not a ring buffer, or its header contradicts its size.",
        "spectrum-misplaced": "A spectrum ends at a sample that does not fit the hop.",
        "value-invalid": "A value in a message of the sender is not of its type, or out of range.",
    }
    temporary_codes: ClassVar[frozenset[str]] = frozenset({"no-samples", "not-found"})


class LocationError(LivebodeError):
    """A file or directory at a URL cannot be read or written.

    Examples
    --------
    >>> import livebode
    >>> from livebode.locations import find
    >>> try:
    ...     find("memory://bench/missing.csv")
    ... except livebode.LocationError as error:
    ...     print(error.code)
    location.not-found
    """

    area: ClassVar[str] = "location"
    codes: ClassVar[Mapping[str, str]] = {
        "changed": "The file at the URL changed while it was downloaded.",
        "denied": "The storage permits no access, or knows no such user.",
        "exists": "There is something at the URL already, and it is not replaced.",
        "failed": "The storage reports another error.",
        "interrupted": "The connection ended within the file.",
        "no-credentials": "The storage needs credentials, and none were found.",
        "no-space": "The downloaded copy does not fit on the disk.",
        "not-a-run": "There are files below the URL, but no complete run.",
        "not-found": "There is nothing at the URL.",
        "not-possible": "A URL cannot be used for this.",
        "not-reachable": "The storage does not answer.",
        "not-uploaded": "A run was written, and could not be uploaded completely.",
        "scheme-unknown": "The first part of the URL names no storage that can be used here.",
    }
    temporary_codes: ClassVar[frozenset[str]] = frozenset(
        {"changed", "failed", "interrupted", "no-space", "not-reachable", "not-uploaded"}
    )


class ConfigError(LivebodeError):
    """A configuration (axis.toml, experiment.toml) cannot be read, or has a key or value that cannot be used.

    Examples
    --------
    >>> import livebode
    >>> try:
    ...     livebode.design("missing.toml")
    ... except livebode.ConfigError as error:
    ...     print(error.code)
    config.file-unreadable
    """

    area: ClassVar[str] = "config"
    codes: ClassVar[Mapping[str, str]] = {
        "auto-needs-recording": 'Lines or window are "auto", but there is no excitation or recording to find them in.',
        "axes-invalid": "The table [axes] is not a table of axes, or has too many of them.",
        "axis-name-invalid": "An axis has a name that cannot be the name of its directory.",
        "change-needs-restart": "A changed key cannot be applied while the axis runs.",
        "change-too-early": "A changed configuration cannot be checked before the live source has sent samples.",
        "cluster-open": "A cluster is reached over a network without mutual TLS.",
        "file-open-to-others": "A file with a secret can be read or changed by other users of the computer.",
        "file-too-long": "The file is longer than a configuration may be.",
        "file-unreadable": "A configuration, or a file that it names, does not exist or cannot be read.",
        "file-unusable": "A file that the configuration names has other content than it needs.",
        "incomplete": "A key needs another one that is missing.",
        "key-conflict": "Two keys contradict each other, or exclude each other.",
        "key-missing": "A required key is missing.",
        "key-unknown": "There is no such key.",
        "key-unused": "A key has no meaning for this kind of source.",
        "kind-needed": "A model needs the kind of a channel, which its unit does not show and no key declares.",
        "log-open": "The log of a fleet is reached over a network without TLS.",
        "needs-even-samples": "A key needs samples at regular times, and the channels have clocks of their own.",
        "needs-samples": "A key needs samples, and the drive sends spectra.",
        "nested-too-deeply": "Values are nested deeper than any configuration has them.",
        "not-text": "The file is not text.",
        "not-toml": "The text is not TOML.",
        "open-without-tls": "The dashboard is to be open to other computers, but has no TLS.",
        "open-without-token": "The dashboard is to be open to other computers, but has no token.",
        "rate-mismatch": "A rate contradicts the rate of the samples or another key.",
        "secret-in-url": "A URL contains a user or password, which would be recorded.",
        "secret-missing": "The environment variable that holds a secret is not set.",
        "token-weak": "A token is too short, or has letters that a token may not have.",
        "tokens-equal": "Operators and viewers have the same token.",
        "unit-not-si": "The parameters of a model are in SI units, and the output or the input is not.",
        "value-invalid": "The value of a key has the wrong type or form, is out of range or cannot be used.",
        "value-mismatch": "The value of a key differs from what the source, the design or the run has.",
    }


class RecordingError(LivebodeError):
    """A file with recorded samples cannot be read, or is not what was asked for.

    Examples
    --------
    >>> import livebode
    >>> try:
    ...     livebode.open_log("missing.csv")
    ... except livebode.RecordingError as error:
    ...     print(error.code)
    recording.not-found
    """

    area: ClassVar[str] = "recording"
    codes: ClassVar[Mapping[str, str]] = {
        "cell-not-a-number": "A cell of a table is not a number.",
        "channel-ambiguous": "The name belongs to more than one channel of the file.",
        "channel-duplicated": "Two columns of the file have the same name.",
        "channel-missing": "The file has no channel with samples.",
        "channel-unknown": "The file has no channel of this name.",
        "clocks-apart": "Channels that are read together were recorded at different times.",
        "clocks-differ": "Channels that are read together are sampled by different clocks.",
        "damaged": "The content of the file contradicts its format.",
        "dbc-missing": "The file contains CAN frames, and no DBC file defines their signals.",
        "declaration-refused": "The XML declares a document type or entities, which are never read.",
        "empty": "The file has no samples.",
        "format-unknown": "The content of the file is not of a supported format.",
        "incomplete": "The measurement lacks a part that is needed.",
        "lengths-differ": "Channels that are read together have different numbers of samples.",
        "line-ragged": "A line of a table has another number of cells than the others.",
        "line-too-long": "A line of a table is longer than any line of a recording.",
        "no-frames": "A DBC file is given for a file without CAN frames.",
        "not-a-file": "The path is a directory, a pipe or a device.",
        "not-an-excitation": "The file is not an excitation that `livebode design` wrote.",
        "not-found": "There is no such file.",
        "not-readable": "The operating system refuses to read the file.",
        "rate-conflict": "The given sampling rate contradicts the file.",
        "rate-implausible": "The time column gives a sampling rate that no recording has.",
        "rate-missing": "Neither the file nor the call gives the sampling rate.",
        "recording-repeated": "Two recordings of one run have the same content.",
        "recordings-differ": "Recordings of one run differ in their rate, units, window or lines.",
        "spectrum": "The file is a table over the frequency, not over the time.",
        "table-missing": "The file is text without rows of numbers.",
        "time-irregular": "The time column is not regular apart from whole missing samples, or has too many gaps.",
        "time-jitter": "The time column jitters too much for a spectrum.",
        "time-not-finite": "The time column has an empty cell, NaN or infinity.",
        "time-not-increasing": "The time column decreases or repeats.",
        "time-unit": "The unit of the time column is missing or is not a unit of time.",
        "too-large": "The file has more columns, parts or bytes than are read.",
        "truncated": "The file ends before its content does.",
    }
