"""The tasks of the first hour in a terminal, each with a check against the truth of the simulated machine."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from bench.first_hour.senders import CONFIGURATION, foreign_json, free_port, garbage
from bench.first_hour.servo import SERVO

LIVEBODE = Path(sys.executable).with_name("livebode")


@dataclass
class Terminal:
    """Runs commands in a directory and counts them with their seconds."""

    directory: Path
    commands: list[str] = field(default_factory=list)
    seconds: float = 0.0

    def run(self, words: str, code: int = 0, end_after_s: float | None = None) -> str:
        """Standard output and error of `livebode WORDS`; with `end_after_s` Ctrl-C ends it then."""
        begun = time.perf_counter()
        command = [str(LIVEBODE), *words.split()]
        with subprocess.Popen(
            command, cwd=self.directory, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        ) as process:
            try:
                text, _ = process.communicate(timeout=end_after_s)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGINT)
                text, _ = process.communicate()
        self.seconds += time.perf_counter() - begun
        self.commands.append(f"livebode {words}")
        assert process.returncode == code, f"livebode {words} ended with {process.returncode}:\n{text}"
        return text


def near(terminal: Terminal, name: str, truth: float, *words: str) -> str:
    """A quantity of `livebode fit WORDS`, if the truth is within twice its bound."""
    terminal.run(" ".join(["fit", *words]))
    fitted = json.loads(subprocess.check_output([LIVEBODE, "fit", *words, "--json"], cwd=terminal.directory))
    quantity = fitted["quantities"][name]
    value, bound = quantity["value"], quantity["bound_95"]
    assert abs(value - truth) < 2 * bound, f"{name}: {value} ± {bound}, true {truth}"
    return f"{name} {value:.6g} ± {bound:.2g}, true {truth:.6g}"


def measured(terminal: Terminal, recording: str) -> str:
    """From a recording to the resonance: roles proposed, tracked, fitted."""
    stem = Path(recording).stem
    terminal.run(f"inspect {recording} --out {stem}.toml --yes")
    terminal.run(f"run {stem}.toml")
    return near(terminal, "resonance", SERVO.resonance_hz, f"runs/{stem}")


def stiffness(terminal: Terminal, recording: str) -> str:
    stem = Path(recording).stem
    terminal.run(f"inspect {recording} --out {stem}.toml --yes")
    terminal.run(f"run {stem}.toml")
    return near(terminal, "Keff", SERVO.stiffness, f"runs/{stem}", "--model", "two-mass")


def worse_at_standstill(terminal: Terminal) -> str:
    for name in ("si", "softer"):
        terminal.run(f"inspect {name}.csv --out {name}.toml --yes")
        terminal.run(f"run {name}.toml")
    return terminal.run("compare runs/si runs/softer").strip().splitlines()[0]


def worse_in_motion(terminal: Terminal) -> str:
    terminal.run("example fault --out .")
    terminal.run("run monday.toml")
    terminal.run("run tuesday.toml")
    terminal.run("learn runs/monday runs/tuesday --out healthy.json")
    text = terminal.run("run today.toml --baseline healthy.json --false-alarm-interval 30")
    alarm = re.search(r"[^\n]*stiffness[^\n]*", text)
    assert alarm, text
    return alarm.group().strip()


def report(terminal: Terminal) -> str:
    measured(terminal, "si.csv")
    terminal.run("report runs/si")
    page = next(terminal.directory.glob("runs/si/*.pdf"))
    return f"{page.name}, {page.stat().st_size / 1e3:.0f} kB"


def tune(terminal: Terminal) -> str:
    terminal.run("example tune --out .")
    terminal.run("run tune.toml")
    terminal.run("validate --loop runs/tune")
    return last_line(terminal.run("tune runs/tune --loop-checked"))


def gantry(terminal: Terminal) -> str:
    terminal.run("example matrix --out .")
    return last_line(terminal.run("run gantry.toml"))


def last_line(text: str) -> str:
    return text.strip().splitlines()[-1]


def silent_axis(terminal: Terminal) -> str:
    """A port to which nothing comes."""
    (terminal.directory / "silent.toml").write_text(CONFIGURATION.format(port=free_port()))
    return line_about(terminal.run("doctor silent.toml"), "nothing came")


def garbage_on_the_port(terminal: Terminal) -> str:
    port = free_port()
    (terminal.directory / "garbage.toml").write_text(CONFIGURATION.format(port=port))
    with garbage(port):
        return line_about(terminal.run("doctor garbage.toml", code=2), "temp=21")


def foreign_messages(terminal: Terminal) -> str:
    """JSON with other names at a broker: listened to, mapped, and tracked until Ctrl-C."""
    with foreign_json(terminal.directory) as url:
        terminal.run(f"inspect {url} --out press.toml --yes")
        terminal.run("run press.toml", end_after_s=12.0)
    return near(terminal, "resonance", SERVO.resonance_hz, "runs/press")


def line_about(text: str, expected: str) -> str:
    """The line that contains what is expected."""
    lines = [" ".join(line.split()) for line in text.splitlines() if expected in line]
    assert lines, f"nothing about {expected!r} in\n{text}"
    return lines[0]


TASKS: dict[str, Callable[[Terminal], str]] = {
    "own CSV": lambda terminal: measured(terminal, "si.csv"),
    "German CSV in cp1252": lambda terminal: measured(terminal, "german.csv"),
    "log in rpm": lambda terminal: stiffness(terminal, "rpm.csv"),
    "resonance": lambda terminal: measured(terminal, "si.csv"),
    "belt worse, at standstill": worse_at_standstill,
    "belt worse, in motion": worse_in_motion,
    "silent axis": silent_axis,
    "garbage on the port": garbage_on_the_port,
    "PDF for a customer": report,
    "tune": tune,
    "gantry": gantry,
    "MQTT with foreign JSON": foreign_messages,
}
