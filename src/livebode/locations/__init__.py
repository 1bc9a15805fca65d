"""Files and runs on this computer or at URLs (fsspec): find, copy here, upload.

Nothing of fsspec is imported for a path. Endpoint, credentials and other options of a storage are those of fsspec and
of the storage itself: ``~/.config/fsspec``, ``FSSPEC_…``, ``AWS_…``.
"""

from typing import TYPE_CHECKING

from livebode.on_first_use import on_first_use

if TYPE_CHECKING:
    from livebode.locations.copies import LocalCopy, is_copy, local_copy, original, shared_copy, with_originals
    from livebode.locations.delta import delta_options
    from livebode.locations.finding import Found, find
    from livebode.locations.objects import read_bytes, write_whole
    from livebode.locations.uploads import Upload, upload
    from livebode.locations.url import Location, Url, location, resolved

_NAMES = {
    "copies": (
        "LocalCopy",
        "is_copy",
        "local_copy",
        "original",
        "shared_copy",
        "with_originals",
    ),
    "delta": ("delta_options",),
    "finding": (
        "Found",
        "find",
    ),
    "objects": (
        "read_bytes",
        "write_whole",
    ),
    "uploads": (
        "Upload",
        "upload",
    ),
    "url": (
        "Location",
        "Url",
        "location",
        "resolved",
    ),
}
__getattr__ = on_first_use(__name__, _NAMES)

__all__ = [
    "Found",
    "LocalCopy",
    "Location",
    "Upload",
    "Url",
    "delta_options",
    "find",
    "is_copy",
    "local_copy",
    "location",
    "original",
    "read_bytes",
    "resolved",
    "shared_copy",
    "upload",
    "with_originals",
    "write_whole",
]
