"""Join the scripts and styles of each page of the dashboard (`make bundle`).

    python -m tools.bundle

esbuild writes for each page one script and one style, without spaces and with short names, and their source maps, which
lead to the files of the page. Comments of licences remain. livebode.dashboard.static_files serves the bundles.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from livebode.dashboard.plugin_pages import files_of_additions, workspace_pages
from livebode.dashboard.static_files import BUNDLE, contents

ROOT = Path(__file__).parents[1]
ESBUILD = ROOT / "node_modules/.bin/esbuild"
OPTIONS = (
    "--bundle", "--minify", "--format=esm", "--target=es2023", "--charset=utf8", "--loader:.svg=dataurl",
    "--legal-comments=eof", "--sourcemap", "--sources-content=false", "--entry-names=[name]-[hash]",
    "--log-level=warning",
)  # fmt: skip
STYLE = re.compile(rb'<link rel="stylesheet" href="/static/([^"]+)">\n')
SCRIPT = re.compile(rb'<script type="module" src="/static/([^"]+)"></script>\n')


def sources() -> dict[str, bytes]:
    """Every file that a page can load, as the server has them where no plug-in of somebody else is installed."""
    folders = sorted(ROOT.glob("wings/*/src/**/static"))
    with tempfile.TemporaryDirectory() as folder:
        return contents(folders) | files_of_additions(workspace_pages(Path(folder)))


def write_entries(folder: Path, files: dict[str, bytes]) -> list[Path]:
    """Write the files, and for each page a script and a style that load what it does."""
    for name, content in files.items():
        path = folder / "static" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        # esbuild keeps a comment that begins so.
        path.write_bytes(content.replace(b"/**\n* Copyright", b"/*!\n* Copyright"))
    (folder / "static/tsconfig.json").write_text(json.dumps({"compilerOptions": {"paths": {"/static/*": ["./*"]}}}))
    (folder / "entries").mkdir()
    entries = []
    for page in (name for name in files if name.endswith(".html")):
        for pattern, suffix, load in (STYLE, ".css", b"@import"), (SCRIPT, ".js", b"import"):
            entry = (folder / "entries" / page).with_suffix(suffix)
            entry.write_bytes(b"".join(b'%s "../static/%s";\n' % (load, name) for name in pattern.findall(files[page])))
            entries.append(entry)
    return entries


def bundled_page(page: bytes, style: str, script: str) -> bytes:
    """The page with one style and one script."""
    links = f'<link rel="stylesheet" href="/static/{style}">\n<script type="module" src="/static/{script}"></script>\n'
    return SCRIPT.sub(b"", STYLE.sub(b"", page)).replace(b"</head>", links.encode() + b"</head>")


def manifest(files: dict[str, bytes], facts: dict[str, Any]) -> dict[str, Any]:
    """For each page: the files of its bundle, and the hashes of the sources that they were made from."""
    pages: dict[str, Any] = {}
    for path, output in facts["outputs"].items():
        if "entryPoint" not in output:
            continue
        page = Path(output["entryPoint"]).stem + ".html"
        of_page = pages.setdefault(page, {"files": [], "sources": {page: _digest(files[page])}})
        of_page["files"] += [Path(path).name, f"{Path(path).name}.map"]
        names = {name.removeprefix("static/") for name in loaded(output["entryPoint"], facts["inputs"])}
        of_page["sources"] |= {name: _digest(files[name]) for name in sorted(names & files.keys())}
    return pages


def loaded(entry: str, inputs: dict[str, Any]) -> set[str]:
    """The entry and all that it loads, also what does not get into the bundle."""
    found, open_ = set[str](), {entry}
    while open_:
        name = open_.pop()
        found.add(name)
        open_ |= {other["path"] for other in inputs[name]["imports"]} - found
    return found


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def main() -> None:
    files = sources()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        entries = [str(entry.relative_to(folder)) for entry in write_entries(folder, files)]
        command = [ESBUILD, *OPTIONS, "--outdir=bundle", "--metafile=facts.json", *entries]
        subprocess.run(command, cwd=folder, check=True)
        pages = manifest(files, json.loads((folder / "facts.json").read_bytes()))
        for page, made in pages.items():
            named = {Path(name).suffix: name for name in made["files"]}
            (folder / "bundle" / page).write_bytes(bundled_page(files[page], named[".css"], named[".js"]))
        shutil.rmtree(BUNDLE, ignore_errors=True)
        shutil.copytree(folder / "bundle", BUNDLE)
        (BUNDLE / "manifest.json").write_text(json.dumps(pages, indent=1))
    total = sum(path.stat().st_size for path in BUNDLE.iterdir())
    print(f"{len(pages)} pages, {total / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
