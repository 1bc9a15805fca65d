"""Checks that build: the documentation, the catalogues, and the distributions that would be published."""

from __future__ import annotations

import email
import os
import re
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

from tools.catalogues import FOLDER, catalogues, json_text, po_text, translated, updated
from tools.release.checks import Check
from tools.release.files import version

WANTED = ("Name", "Version", "Summary", "License-Expression", "Requires-Python", "Description-Content-Type")
HOOK = "import sys, scikit_build_core.build as build; build.build_{kind}(sys.argv[1])"
BUNDLE = "livebode/dashboard/_bundle/manifest.json"
FOREIGN = re.compile(r"(^|/)(tests?|bench|studies|conftest\.py)(/|$)|(^|/)test_[^/]*$|\.(cpp|h|po)$")


def translations(_: Path) -> str:
    for code, old in catalogues().items():
        new = updated(old)
        if (FOLDER / f"{code}.po").read_bytes() != po_text(new):
            return f"{code}.po is not current"
        if (FOLDER / f"{code}.json").read_text("utf-8") != json_text(new):
            return f"{code}.json is not current"
        lacking = sum(1 for message in new if message.id and not translated(message))
        if lacking:
            return f"{lacking} sentences of {code}.po have no translation"
    return ""


def documentation(root: Path) -> str:
    done = subprocess.run(["make", "docs"], cwd=root, capture_output=True, text=True)
    return f"make docs failed: {done.stderr.strip()[-300:]}" if done.returncode else ""


def built(root: Path, kind: str, folder: Path) -> Path:
    """The wheel or sdist of this directory, built with the tools of this environment."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    command = [sys.executable, "-c", HOOK.format(kind=kind), str(folder)]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, env=os.environ | {"PATH": path})
    if done.returncode:
        raise ValueError(f"the {kind} was not built: {done.stderr.strip()[-300:]}")
    return max(folder.iterdir(), key=lambda found: found.stat().st_mtime)


def metadata_fault(metadata: str, wanted_version: str) -> str:
    found = email.message_from_string(metadata)
    lacking = [name for name in WANTED if not found[name]]
    if lacking:
        return f"the metadata lacks {', '.join(lacking)}"
    if not str(found.get_payload()).strip():
        return "the metadata has no description"
    return "" if found["Version"] == wanted_version else f"the metadata has version {found['Version']}"


def licence_files(root: Path) -> list[str]:
    vendored = sorted(str(path.relative_to(root)) for path in (root / "src").glob("**/_vendor/*/LICENSE"))
    return ["LICENSE", "NOTICE", *vendored]


def wheel_fault(root: Path, wheel: Path) -> str:
    """What is wrong with a wheel: foreign files, licences or metadata."""
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        foreign = [name for name in names if FOREIGN.search(name)]
        if foreign:
            return f"the wheel contains {foreign[0]}"
        missing = [name for name in licence_files(root) if not any(f"/licenses/{name}" in found for found in names)]
        if missing:
            return f"the wheel lacks the licence files {', '.join(missing)}"
        if BUNDLE not in names:
            return f"the wheel lacks {BUNDLE}"
        metadata = next(name for name in names if name.endswith(".dist-info/METADATA"))
        return metadata_fault(archive.read(metadata).decode(), version(root))


def sdist_fault(root: Path, sdist: Path) -> str:
    """What is wrong with an sdist: sources that the build needs, licences or metadata."""
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
        needed = [
            "CMakeLists.txt",
            "kernel/CMakeLists.txt",
            "native/CMakeLists.txt",
            "pyproject.toml",
            f"src/{BUNDLE}",
            *licence_files(root),
        ]
        missing = [name for name in needed if name not in names]
        if missing:
            return f"the sdist lacks {', '.join(missing)}"
        top = archive.getnames()[0].partition("/")[0]
        metadata = archive.extractfile(f"{top}/PKG-INFO")
        return metadata_fault(metadata.read().decode(), version(root)) if metadata else "the sdist has no PKG-INFO"


def wheel(root: Path) -> str:
    with tempfile.TemporaryDirectory() as folder:
        return wheel_fault(root, built(root, "wheel", Path(folder)))


def sdist(root: Path) -> str:
    with tempfile.TemporaryDirectory() as folder:
        return sdist_fault(root, built(root, "sdist", Path(folder)))


BUILDS = (
    Check("catalogues", translations, "make catalogues, and translate what it lists"),
    Check("documentation", documentation, "correct what make docs reports"),
    Check("wheel", wheel, "make bundle; correct [project] and [tool.scikit-build] in pyproject.toml"),
    Check("sdist", sdist, "make bundle; correct [project] and [tool.scikit-build] in pyproject.toml"),
)
