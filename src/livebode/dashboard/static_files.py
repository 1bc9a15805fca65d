"""Static files of the pages, in memory: reading a file would take a thread for each request.

The scripts and styles of a page are many small files. `make bundle` joins those of each page to one script and one
style in `_bundle`, whose names have the hash of their content. A page is served with its bundle if this was made from
the very files that the server has, those of plug-ins among them; else with the files themselves.
"""

from __future__ import annotations

import gzip
import hashlib
import json
from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path

from starlette.datastructures import Headers
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

_HERE = Path(__file__).parent
BUNDLE = _HERE / "_bundle"
"""Directory of the bundles; `manifest.json` there has for each page its bundle, and the hashes of its sources."""
_TYPES = {
    ".html": "text/html",
    ".css": "text/css",
    ".js": "text/javascript",
    ".svg": "image/svg+xml",
    ".map": "application/json",
}
_YEAR_S = 365 * 86400


class StaticFile(Response):
    """A file that everybody gets: compressed if the browser accepts it, and not again if the browser has it.

    Parameters
    ----------
    content
        The file.
    media_type
        Its type.
    is_hashed
        Whether its name has the hash of its content: a browser then never asks again. Else it always does.
    vary
        Headers of the request that the choice of the file depends on.
    """

    def __init__(self, content: bytes, media_type: str, *, is_hashed: bool = False, vary: str = "") -> None:
        super().__init__(content, media_type=media_type)
        self.digest = hashlib.sha256(content).hexdigest()
        self.headers["etag"] = f'W/"{self.digest[:16]}"'
        self.headers["cache-control"] = f"max-age={_YEAR_S}, immutable" if is_hashed else "no-cache"
        self.headers["vary"] = f"accept-encoding, {vary}" if vary else "accept-encoding"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        asked = Headers(scope=scope)
        if self.headers["etag"] in asked.get("if-none-match", ""):
            await self._unchanged(scope, receive, send)
        elif "gzip" in asked.get("accept-encoding", ""):
            await self._compressed(scope, receive, send)
        else:
            await super().__call__(scope, receive, send)

    @cached_property
    def _compressed(self) -> Response:
        content = gzip.compress(self.body, mtime=0)
        headers = {**self.headers, "content-encoding": "gzip", "content-length": str(len(content))}
        return Response(content, headers=headers)

    @cached_property
    def _unchanged(self) -> Response:
        kept = {name: self.headers[name] for name in ("etag", "cache-control", "vary")}
        return Response(status_code=304, headers=kept)


def contents(folders: Iterable[Path]) -> dict[str, bytes]:
    """Files of the dashboard and of these directories, by the name that they have below /static/."""
    places = [(_HERE / "static", ""), (_HERE / "_vendor" / "uplot", "uplot/"), *((folder, "") for folder in folders)]
    return {prefix + path.name: path.read_bytes() for folder, prefix in places for path in folder.iterdir()}


def static_files(sources: Mapping[str, bytes]) -> dict[str, StaticFile]:
    """The files, with the bundles that were made from them; each of those pages is the one with its bundle."""
    types = {name: _TYPES.get(Path(name).suffix, "") for name in sources}
    files = {name: StaticFile(content, types[name]) for name, content in sources.items() if types[name]}
    manifest = BUNDLE / "manifest.json"
    for page, facts in json.loads(manifest.read_bytes()).items() if manifest.is_file() else ():
        if any(name not in files or files[name].digest != digest for name, digest in facts["sources"].items()):
            continue
        files[page] = StaticFile((BUNDLE / page).read_bytes(), _TYPES[".html"])
        for name in facts["files"]:
            files[name] = StaticFile((BUNDLE / name).read_bytes(), _TYPES[Path(name).suffix], is_hashed=True)
    return files
