"""What a running HAL of LinuxCNC says of itself: signals at pins, threads, and whether its FIFOs are alive."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from livebode.core import SourceError
from livebode.dataclass import dataclass

ANSWER_S = 5.0
"""Longest wait for halcmd: a program that was killed while it held the lock of HAL blocks it permanently."""
SAMPLER_KEY, STREAMER_KEY = 0x48534130, 0x48535430
"""Keys of the shared memory of `sampler.0` and `streamer.0`; that of number n is n higher."""
_SEGMENTS = Path("/proc/sysvipc/shm")


@dataclass(frozen=True)
class Fifo:
    """Shared memory of a sampler or streamer.

    Attributes
    ----------
    users
        Number of processes that have it open: the real-time part, and the program at the other end.
    created_s
        Seconds since 1970 at which the component was loaded; another value means that it was loaded again.
    """

    users: int
    created_s: int


def fifo(key: int) -> Fifo | None:
    """The shared memory with this key; None if its component is not loaded."""
    try:
        rows = _SEGMENTS.read_text(encoding="ascii").splitlines()[1:]
    except OSError:
        return None
    for row in rows:
        fields = row.split()
        if int(fields[0]) == key:
            return Fifo(users=int(fields[6]), created_s=int(fields[13]))
    return None


def program(name: str) -> str:
    """Path of a program of LinuxCNC; SourceError "refused" if it is not installed."""
    path = shutil.which(name)
    if path is None:
        raise SourceError(
            "refused",
            f"the program {name} of LinuxCNC is not installed, or not in PATH",
            "install LinuxCNC on this computer (Debian: apt install linuxcnc-uspace)",
            program=name,
        )
    return path


def halcmd(*words: str) -> str:
    """The answer of halcmd in its form for scripts.

    Raises
    ------
    ConnectionError
        If it reports an error, or does not answer.
    SourceError
        With the code "refused" if it is not installed.
    """
    command = [program("halcmd"), "-s", *words]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=ANSWER_S, check=False)
    except subprocess.TimeoutExpired:
        raise ConnectionError(
            f"halcmd does not answer within {ANSWER_S:g} s: a killed program may hold the lock of HAL; "
            "end LinuxCNC, run halrun -U, and start it again"
        ) from None
    if done.returncode:
        raise ConnectionError(f"halcmd {' '.join(words)}: {last_line(done.stderr) or 'an error without a message'}")
    return done.stdout


def last_line(text: str) -> str:
    """The last line of a message, without control characters."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return "".join(c for c in lines[-1] if c.isprintable())[:200] if lines else ""


def signals_at(component: str) -> list[str]:
    """Names of the signals at the data pins of a component such as sampler.0, in order; "" for an open pin."""
    signals = {}
    for line in halcmd("show", "pin", f"{component}.pin.").splitlines():
        fields = line.split()
        position = next((i for i, field in enumerate(fields) if field.startswith(f"{component}.pin.")), None)
        if position is not None:
            number = fields[position].removeprefix(f"{component}.pin.")
            signals[int(number)] = fields[position + 2] if len(fields) > position + 2 else ""
    return [signals[number] for number in sorted(signals)]


def period_ns(function: str) -> int:
    """Period of the thread that calls a function such as sampler.0; ConnectionError if none does."""
    for line in halcmd("show", "thread").splitlines():
        fields = line.split()
        if function in fields[3:]:
            return int(fields[0])
    raise ConnectionError(f"no thread of HAL calls {function}: halcmd addf {function} THREAD")


def pin_value(name: str) -> str:
    """Value of a pin; ConnectionError if there is none of this name."""
    return halcmd("getp", name).strip()


@dataclass(frozen=True)
class Link:
    """A signal: the pin that drives it, "" for none, and the pins that read it."""

    name: str
    writer: str
    readers: tuple[str, ...]


def links() -> dict[str, Link]:
    """The signals of HAL by name."""
    by_signal = {}
    for line in halcmd("show", "sig").splitlines():
        fields = line.split()
        if len(fields) < 3:
            continue
        arrows = dict(zip(fields[4::2], fields[3::2]))
        writer = next((pin for pin, arrow in arrows.items() if arrow == "<=="), "")
        by_signal[fields[2]] = Link(fields[2], writer, tuple(pin for pin, arrow in arrows.items() if arrow == "==>"))
    return by_signal
