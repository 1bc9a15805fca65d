"""livebode as a user has it: installed from wheels into an environment without anything else, no compiler on PATH."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Mapping
from pathlib import Path

from tools.wheels import own_log
from tools.wheels.interpreters import Interpreter

TOOLS = Path(sys.executable).parent
REQUIREMENT = "livebode[dashboard]"
LIMIT_S = 300.0
LIVE = f"""
[source]
log = "live.csv"
follow = true
rate_hz = {own_log.RATE_HZ}

[signals]
excitation = "w"
input = "u"
output = "y"

[lines]
frequencies = "{",".join(f"k={k}" for k in own_log.LINES)}"
window = {own_log.WINDOW}
"""


class Trial:
    """An environment in a folder, and what is tried in it; each step returns what it found, or raises.

    Parameters
    ----------
    interpreter
        The Python of the environment.
    folder
        An empty folder.
    """

    def __init__(self, interpreter: Interpreter, folder: Path) -> None:
        self.interpreter, self.folder = interpreter, folder
        self._place = folder / "environment"
        self._bin = self._place / "bin"
        self._environment = {"PATH": str(self._bin), "HOME": str(folder), "OPENBLAS_NUM_THREADS": "1"}

    def steps(self, wheels: Path) -> dict[str, Callable[[], str]]:
        return {
            "install": lambda: self.install(wheels), "demo": self.demo, "own log": self.own_log,
            "live run": self.live_run, "dashboard": self.dashboard,
        }  # fmt: skip

    def install(self, wheels: Path) -> str:
        """Install with what the demo and the dashboard need; the size is that of all packages.

        The cache is its own: that of the user may have another build of the same version.
        """
        _checked([TOOLS / "uv", "venv", "--quiet", "--python", self.interpreter.path, self._place], os.environ)
        _checked(
            [TOOLS / "uv", "pip", "install", "--quiet", "--python", self._bin / "python", "--no-index",
             "--find-links", wheels, "--cache-dir", self.folder / "cache", REQUIREMENT],
            os.environ,
        )  # fmt: skip
        (packages,) = self._place.glob("lib/python3*/site-packages")
        size = sum(path.stat().st_size for path in packages.rglob("*") if path.is_file())
        return f"{size / 1e6:.0f} MB"

    def demo(self) -> str:
        result = json.loads(self._livebode("demo", "--fast", "--json"))
        return f"{result['counts']['responses']} responses"

    def own_log(self) -> str:
        self._python(own_log.__file__, "own.csv", "20000", "0")
        result = json.loads(
            self._livebode("run", "own.csv", "--excitation", "w", "--input", "u", "--output", "y", "--json")
        )
        return f"{result['counts']['responses']} responses"

    def live_run(self) -> str:
        (self.folder / "live.toml").write_text(LIVE, "utf-8")
        machine = subprocess.Popen(
            [self._bin / "python", own_log.__file__, "live.csv", "1000000", "0.05"],
            cwd=self.folder, env=self._environment,
        )  # fmt: skip
        try:
            _wait_for(self.folder / "live.csv")
            run = self._started("run", "live.toml", "--out", "runs/live")
            time.sleep(8)
            _end(run)
        finally:
            machine.kill()
            machine.wait()
        summary = json.loads((self.folder / "runs/live/run.json").read_text("utf-8"))
        if not summary["counts"]["responses"]:
            raise RuntimeError("the live run has no responses")
        return f"{summary['counts']['responses']} responses"

    def dashboard(self) -> str:
        view = self._started("view", "runs/demo", "--port", "0")
        try:
            assert view.stdout is not None
            found = next((url for line in view.stdout if (url := re.search(r"http://\S+", line))), None)
            if found is None:
                raise RuntimeError("livebode view gave no address")
            with urllib.request.urlopen(found.group()) as answer:
                page = answer.read()
            if b'src="/static/index-' not in page:
                raise RuntimeError("the page is not served as a bundle")
            return f"{len(page) / 1e3:.0f} kB page"
        finally:
            _end(view)

    def _started(self, *arguments: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [self._bin / "livebode", *arguments], cwd=self.folder, env=self._environment,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip

    def _livebode(self, *arguments: str) -> str:
        return _checked([self._bin / "livebode", *arguments], self._environment, self.folder)

    def _python(self, *arguments: str) -> str:
        return _checked([self._bin / "python", *arguments], self._environment, self.folder)


def _checked(command: list[str | Path], environment: Mapping[str, str], folder: Path | None = None) -> str:
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=LIMIT_S)
    if done.returncode:
        raise RuntimeError(f"{' '.join(map(str, command))}: {done.stderr.strip()[-500:]}")
    return done.stdout


def _wait_for(path: Path) -> None:
    while not path.exists():
        time.sleep(0.05)


def _end(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=LIMIT_S)
