"""Files and runs on this computer or at URLs (fsspec): find, copy here, upload.

Nothing of fsspec is imported for a path. Endpoint, credentials and other options of a storage are those of fsspec and
of the storage itself: ``~/.config/fsspec``, ``FSSPEC_…``, ``AWS_…``.
"""

from livebode.locations.copies import LocalCopy, download, local_copy, original, with_originals
from livebode.locations.delta import delta_options
from livebode.locations.finding import Found, find
from livebode.locations.objects import read_bytes, write_whole
from livebode.locations.uploads import check_free, upload
from livebode.locations.url import Location, Url, location

__all__ = [
    "Found",
    "LocalCopy",
    "Location",
    "Url",
    "check_free",
    "delta_options",
    "download",
    "find",
    "local_copy",
    "location",
    "original",
    "read_bytes",
    "upload",
    "with_originals",
    "write_whole",
]
