"""`python -m tools.profiles`: fresh environments with each profile of the wheel: their size, and whether they work.

An environment has what its user would get: the wheel of this directory, and the newest packages. In each, the simulated
axis is tracked, and the commands of docs/reference/profiles.md that need no extra are executed. Needs uv and an index.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from tools.release.builds import built

PROFILES = ("", "dashboard", "plots", "analysis", "plots,analysis,dashboard", "all")
COMMANDS = (
    "example all",
    "demo --fast --seconds 16 --out demo",
    "inspect example/standstill.csv --excitation w --output velocity",
    "run example/standstill.toml --out standstill",
    "run example/loop.toml --out loop",
    "fit standstill",
    "margins loop",
    "export standstill --to csv",
    "design example/experiment.toml --out design",
)
BYTECODE = "bytecode"
_LARGEST = 4  # packages that are named


def sizes(packages: Path) -> dict[str, int]:
    """Bytes of the files of each package in site-packages, and of all bytecode, which pip writes, the largest first."""
    found: dict[str, int] = {}
    for path in packages.rglob("*"):
        if path.is_file():
            name = path.relative_to(packages).parts[0].split(".")[0].split("-")[0]
            name = BYTECODE if path.suffix == ".pyc" else name
            found[name] = found.get(name, 0) + path.stat().st_size
    return dict(sorted(found.items(), key=lambda one: -one[1]))


def install(folder: Path, wheel: Path, extras: str, *options: str) -> Path:
    """A fresh environment with the wheel; the path of its Python."""
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    subprocess.run(["uv", "venv", "--quiet", "--python", sys.executable, str(folder)], check=True)
    target = f"{wheel}[{extras}]" if extras else str(wheel)
    command = ["uv", "pip", "install", "--quiet", "--compile-bytecode", "--python", str(python), *options, target]
    subprocess.run(command, check=True)
    return python


def failures(command: Path, folder: Path) -> Iterator[str]:
    """The commands that do not end with success, with the last line of what they printed."""
    for words in COMMANDS:
        done = subprocess.run([str(command), *words.split()], cwd=folder, capture_output=True, text=True)
        if done.returncode:
            yield f"livebode {words}: {(done.stderr or done.stdout).strip().splitlines()[-1]}"


def main() -> int:
    failed = []
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        (root / "wheel").mkdir()
        wheel = built(Path.cwd(), "wheel", root / "wheel")
        print("| profile | MB | without bytecode | largest packages, MB |\n| --- | ---: | ---: | --- |")
        for number, extras in enumerate(PROFILES):
            python = install(root / f"environment{number}", wheel, extras)
            work = root / f"work{number}"
            work.mkdir()
            packages = next(python.parent.parent.rglob("site-packages"))
            found = sizes(packages)
            bytecode, total = found.pop(BYTECODE), sum(found.values())
            largest = ", ".join(f"{package} {size / 1e6:.0f}" for package, size in list(found.items())[:_LARGEST])
            profile = f"livebode[{extras}]" if extras else "livebode"
            print(f"| `{profile}` | {(total + bytecode) / 1e6:.0f} | {total / 1e6:.0f} | {largest} |", flush=True)
            failed += [f"{profile}: {failure}" for failure in failures(python.with_name("livebode"), work)]
    print("\n".join(failed) or f"each profile executes {len(COMMANDS)} commands of the core")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
