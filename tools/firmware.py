"""Programs for a Cortex-M: built with arm-none-eabi-gcc, run in QEMU."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from tools.stored import compiled

ROOT = Path(__file__).parents[1]
KERNEL = ROOT / "kernel"
BOARD = ROOT / "examples" / "drive" / "mps2"
PROGRAMS = ("arm-none-eabi-gcc", "qemu-system-arm")
FLAGS = (
    *(
        "-std=c99",
        "-O2",
        "-ffreestanding",
        "-ffp-contract=off",
        "-ffunction-sections",
        "-fdata-sections",
        "-DLB_SCALAR",
    ),
    *("-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror"),
)


@dataclass(frozen=True)
class Core:
    """A processor, QEMU's board with it, and the number type that its hardware has."""

    name: str
    machine: str
    bits: int
    flags: tuple[str, ...]

    def compile(self, sources: list[Path], directory: Path, *flags: str) -> list[Path]:
        """An object of each source."""
        directory.mkdir(parents=True, exist_ok=True)
        objects = [directory / f"{source.stem}.o" for source in sources]
        for source, file in zip(sources, objects):
            run("arm-none-eabi-gcc", *self._all_flags(), *flags, "-c", source, "-o", file)
        return objects

    def kernel(self, directory: Path, *flags: str) -> list[Path]:
        """The kernel's objects."""
        directory.mkdir(parents=True, exist_ok=True)
        sources = sorted((KERNEL / "src").glob("*.c"))
        objects = [directory / f"{source.stem}.o" for source in sources]
        for source, file in zip(sources, objects):
            shutil.copyfile(compiled("arm-none-eabi-gcc", [*map(str, self._all_flags()), *flags], source), file)
        return objects

    def link(self, program: Path, objects: list[Path]) -> Path:
        """A program of these objects and the board's."""
        board = self.compile(sorted(BOARD.glob("*.c")), program.parent / "board")
        layout = ("-nostdlib", "-Wl,--gc-sections", "-T", BOARD / "mps2.ld")
        run("arm-none-eabi-gcc", *self.flags, *layout, *objects, *board, "-lgcc", "-o", program)
        return program

    def qemu(self, program: Path, *options: str) -> list[str]:
        """The command that runs a program, its files on the host in the working directory."""
        host = ("-nographic", "-monitor", "none", "-semihosting-config", "enable=on,target=native")
        return ["qemu-system-arm", "-machine", self.machine, *host, *options, "-kernel", str(program)]

    def _all_flags(self) -> list[object]:
        return [*FLAGS, *self.flags, f"-DLB_BITS={self.bits}", f"-I{KERNEL / 'include'}", f"-I{BOARD}"]


M4F = Core("Cortex-M4F", "mps2-an386", 32, ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"))
M7 = Core("Cortex-M7", "mps2-an500", 64, ("-mcpu=cortex-m7", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv5-d16"))


def missing() -> list[str]:
    """Programs that are needed and not installed."""
    return [name for name in PROGRAMS if shutil.which(name) is None]


def run(*command: object, cwd: Path | None = None) -> str:
    """Output of a command; if it fails, the error contains the output."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, cwd=cwd)
    if done.returncode:
        raise RuntimeError(f"exit code {done.returncode}: {' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def kept(core: Core, objects: list[Path], names: tuple[str, ...], file: Path) -> Path:
    """One object with only the code that these functions need."""
    required = [f"-Wl,-u,lb_sdft{core.bits}_{name}" for name in names]
    run("arm-none-eabi-gcc", *core.flags, "-nostdlib", "-r", "-Wl,--gc-sections", *required, *objects, "-o", file)
    return file


def flash(core: Core, objects: list[Path], names: tuple[str, ...], program: Path) -> int:
    """Bytes of code and constants that these functions need, with those of libgcc."""
    required = [f"-Wl,-u,lb_sdft{core.bits}_{name}" for name in names]
    options = ("-nostdlib", "-Wl,--gc-sections", "-Wl,-e,0", *required)
    run("arm-none-eabi-gcc", *core.flags, *options, *objects, "-lgcc", "-o", program)
    return int(run("arm-none-eabi-size", program).splitlines()[1].split()[0])


def undefined(file: Path) -> set[str]:
    """Undefined symbols that an object uses; the linker retains the names of discarded code."""
    named = {line.split()[-1] for line in run("arm-none-eabi-nm", "-u", file).splitlines()}
    used = {line.split()[2] for line in run("arm-none-eabi-objdump", "-r", file).splitlines() if " R_ARM_" in line}
    return named & used
