"""`python -m tools.lowest`: the tests with the oldest packages that pyproject.toml permits.

A fresh environment gets the wheel of this directory with all extras and the lowest version of each package that
pyproject.toml names; what these need in turn is the newest. Tests that need more than pytest and hypothesis are those
of a page, a server or a tool of development, and are not executed. Needs uv and an index.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

from tools.profiles import install
from tools.release.builds import built

# Only wheels: a package that has to be compiled is not what a user gets. nkeys is one module of Python without a wheel.
BINARY = ("--only-binary", ":all:", "--no-binary", "nkeys")
LOWEST = ("--resolution", "lowest-direct", *BINARY)
TESTS = ("blark", "hypothesis", "playwright", "pytest", "pytest-xdist")
PARTS = (
    "core",
    "kernel",
    "native",
    "estimation",
    "excitation",
    "fitting",
    "margins",
    "records",
    "export",
    "sources",
    "runtime",
)


def pinned(lock: Path, names: tuple[str, ...]) -> list[str]:
    """Requirements of these packages in the versions of a lock file."""
    versions = dict(re.findall(r"^([\w.-]+)==([^\s;]+)", lock.read_text("utf-8"), re.M))
    return [f"{name}=={versions[name]}" for name in names]


def main() -> int:
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        (root / "wheel").mkdir()
        wheel = built(Path.cwd(), "wheel", root / "wheel")
        lowest = root / "lowest.txt"
        options = ["--quiet", "--python", sys.executable, "--extra", "all", "--no-header", "--no-annotate"]
        subprocess.run(
            ["uv", "pip", "compile", *options, *LOWEST, "--output-file", str(lowest), "pyproject.toml"], check=True
        )
        print(lowest.read_text("utf-8"))
        dev = pinned(Path("requirements-dev.lock"), TESTS)
        python = install(root / "environment", wheel, "", *BINARY, "-r", str(lowest), *dev)
        parts = [f"tests/{part}" for part in sys.argv[1:] or PARTS]
        # An old package warns about a newer one: that is no error here.
        pytest = ["-q", "-n", "auto", "--dist", "worksteal", "-o", "filterwarnings=default", *parts]
        return subprocess.run([str(python), "-m", "pytest", *pytest]).returncode


if __name__ == "__main__":
    sys.exit(main())
