"""Two versions of livebode, each installed into a virtual environment of its own.

Both use the dependencies of this environment, so that a ratio shows what changed in livebode and not in NumPy.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import venv
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


def installed(source: Path, folder: Path) -> Path:
    """The Python of a new environment in this directory, with livebode built from this source."""
    venv.create(folder, with_pip=False)
    python = folder / "bin" / "python"
    packages = Path(sysconfig.get_path("purelib", vars={"base": str(folder)}))
    # A line in a .pth file adds the directory alone: the hook of the editable installation in it is not read.
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    subprocess.run(
        [python, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index",
         "--ignore-installed", f"--config-settings=build-dir={folder / 'build'}", str(source)],
        check=True, env=os.environ | {"PATH": path},
    )  # fmt: skip
    return python
