"""open: a recording or a run, whichever is there."""

from __future__ import annotations

from os import PathLike

from livebode.core import UsageError
from livebode.interface._run import Run
from livebode.locations import Url, local_copy, location
from livebode.records import is_run
from livebode.sources import Log, open_log


def open(path: str | PathLike[str] | Url, *, fs: float | None = None) -> Log | Run:
    """Open what is at a path or URL: a `Run` of a run directory, else the `Log` of a recording.

    `Run` and `open_log` do the same where it is known which it is, and have more options.

    Parameters
    ----------
    path
        A file of any format in docs/reference/readers.md, a run directory, or the URL of either.
    fs
        Samples per second of a recording. Default: from its time column or its metadata.

    Returns
    -------
    Log or Run
        Of a Log, ``log["u"]`` are the samples of a channel and ``log.rate_hz`` is their rate.

    Raises
    ------
    UsageError
        If `fs` is given for a run, which has its own.
    RecordingError, RecordError, LocationError, ExtraError
        As `open_log` and `Run`.

    Examples
    --------
    >>> import livebode, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = livebode.example_run(f"{folder}/monday")
    ...     livebode.open(f"{folder}/monday")
    ...     log = livebode.open(f"{folder}/monday.parquet", fs=4000)
    ...     livebode.frf(log["w"], log["u"], log["velocity"], fs=log.rate_hz)
    <Run 'monday': velocity from u, excited by w; 13 lines, 20 … 140 Hz; 40 responses in 1 s; 1 event>
    <Response: plant, joint estimate, 13 lines, 20 … 140 Hz, all valid, at 0.50 s>
    """
    place = location(path)
    with local_copy(place) as here:
        if not is_run(here):
            return open_log(place, rate_hz=fs)
        if fs is not None:
            raise UsageError(
                "conflict", f"{place} is a run, whose rate is known, and fs is {fs!r}", "omit fs", argument="fs"
            )
        return Run(place)
