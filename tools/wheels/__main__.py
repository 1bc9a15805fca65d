"""`python -m tools.wheels`: build the wheels of this computer's Pythons, and try them without a compiler or network.

`build` writes them to dist/ (audited, manylinux), and `gather` adds the wheels that they need. `try` creates a fresh
environment for each Python from that directory alone and prints a table: demo, own log, live run, dashboard. `runners`
starts the demo with uvx and pipx in the same way. `bill` writes a bill of materials to dist/livebode.cdx.json.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

from tools.wheels.bill import bill
from tools.wheels.build import TOOLS, build, builders
from tools.wheels.interpreters import ROOT, Interpreter, interpreters
from tools.wheels.trial import REQUIREMENT, Trial

DIST = ROOT / "dist"


def built() -> None:
    """Write the wheels of this computer to dist/, in place of those there, and print their sizes."""
    for old in DIST.glob("livebode-*.whl"):
        old.unlink()
    for interpreter in builders(interpreters()):
        wheel = build(interpreter, DIST)
        print(f"{interpreter.name:6}{wheel.stat().st_size / 1e6:6.1f} MB  {wheel.name}", flush=True)


def gathered() -> None:
    """Download the wheels that these need, as a user's pip would choose them for each Python."""
    for interpreter in interpreters():
        pip = [TOOLS / "pip", "--python", interpreter.path, "download", "--quiet", "--quiet", "--only-binary", ":all:"]
        subprocess.run([*pip, "--dest", DIST, "--find-links", DIST, REQUIREMENT, "pip"], check=True)  # pipx renews pip


def tried() -> bool:
    """Print a row for each Python, and whether everything worked."""
    faults = []
    for interpreter in interpreters():
        with tempfile.TemporaryDirectory() as folder:
            trial = Trial(interpreter, Path(folder))
            for name, step in trial.steps(DIST).items():
                began = time.perf_counter()
                try:
                    found = step()
                except (RuntimeError, OSError, ValueError, subprocess.SubprocessError) as error:
                    found = f"FAILED: {error}"
                    faults.append(found)
                took_s = time.perf_counter() - began
                print(f"{interpreter.name:6}{name:12}{took_s:6.1f} s  {found}", flush=True)
    return not faults


def run_by_runners(interpreter: Interpreter) -> None:
    """Start the demo with uvx and pipx from dist/; with an empty home directory, and without the network."""
    links = ["--no-index", "--find-links", str(DIST)]
    with tempfile.TemporaryDirectory() as home:
        uvx = [TOOLS / "uvx", "--offline", "--no-build", "--python", interpreter.path, *links]
        pip = " ".join(["--only-binary :all:", *links])
        pipx = [TOOLS / "pipx", "run", "--backend", "pip", "--python", interpreter.path, "--pip-args", pip]
        path = os.pathsep.join([str(TOOLS), "/usr/bin", "/bin"])  # their scripts call realpath
        for name, command in (("uvx", uvx), ("pipx run", pipx)):
            began = time.perf_counter()
            environment = {"PATH": path, "HOME": home, "OPENBLAS_NUM_THREADS": "1"}
            done = subprocess.run(
                [*command, "livebode", "demo", "--fast", "--json"], cwd=home, env=environment, capture_output=True
            )
            if done.returncode:
                raise SystemExit(f"{name} failed:\n{done.stderr.decode()}")
            responses = json.loads(done.stdout)["counts"]["responses"]
            print(
                f"{name} livebode demo --fast: {responses} responses, {time.perf_counter() - began:.1f} s", flush=True
            )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tools.wheels", description=__doc__)
    parser.add_argument("command", choices=("build", "gather", "try", "runners", "bill"))
    command = parser.parse_args().command
    if command == "build":
        built()
    elif command == "gather":
        gathered()
    elif command == "runners":
        run_by_runners(interpreters()[-1])
    elif command == "bill":
        print(f"{bill(DIST, DIST / 'livebode.cdx.json')} packages")
    elif not tried():
        raise SystemExit(1)


if __name__ == "__main__":
    main()
