"""Versions of livebode, each installed into a virtual environment of its own.

Versions that are compared use the same dependencies, so that a ratio shows what changed in livebode and not in NumPy.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

ROOT = Path(__file__).parents[2]


def git(*words: str) -> str:
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"git {' '.join(words)} failed: {done.stderr.strip()}")
    return done.stdout.strip()


def commit_of(revision: str) -> str:
    return git("rev-parse", "--short=12", "--verify", f"{revision}^{{commit}}")


def archived(revision: str, folder: Path) -> Path:
    """The files of this commit, extracted into this directory."""
    folder.mkdir(parents=True)
    archive = folder.with_suffix(".tar")
    git("archive", "--format=tar", f"--output={archive}", revision)
    with tarfile.open(archive) as tar:
        tar.extractall(folder, filter="data")
    return folder


def working_tree(folder: Path) -> Path:
    """The files of the working tree that git tracks or would, with their changes that are not committed."""
    for name in git("ls-files", "--cached", "--others", "--exclude-standard").splitlines():
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    return folder


def installed(source: Path, folder: Path, python: Path = Path(sys.executable), *settings: str) -> Path:
    """The Python of a new environment in this directory, with livebode built from this source.

    It has the packages of the environment of `python`; `settings` are those of scikit-build-core.
    """
    subprocess.run([python, "-m", "venv", "--without-pip", folder], check=True)
    own = folder / "bin" / "python"
    # A line in a .pth file adds the directory alone: the hook of the editable installation in it is not read.
    (_packages(own) / "dependencies.pth").write_text(f"{_packages(python)}\n", encoding="utf-8")
    path = f"{python.parent}{os.pathsep}{os.environ.get('PATH', '')}"
    settings = (f"build-dir={folder / 'build'}", *settings)
    subprocess.run(
        [own, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index",
         "--ignore-installed", *(f"--config-settings={setting}" for setting in settings), str(source)],
        check=True, env=os.environ | {"PATH": path},
    )  # fmt: skip
    return own


def _packages(python: Path) -> Path:
    asked = [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    return Path(subprocess.run(asked, check=True, capture_output=True, text=True).stdout.strip())
