"""Files and runs on this computer or at URLs (fsspec): find, copy here, upload.

Nothing of fsspec is imported for a path. Endpoint, credentials and other options of a storage are those of fsspec and
of the storage itself: ``~/.config/fsspec``, ``FSSPEC_…``, ``AWS_…``.
"""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
