"""The C for Windows, by clang in the manner of clang-cl: it compiles with its vectors, and needs what Windows has.

There are no headers and libraries of Windows here: the few functions of C are declared, and nothing is linked or run.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tools.stored import state, stored, version

ROOT = Path(__file__).parents[2]
PROJECT = "cmake_minimum_required(VERSION 3.20)\nproject(all C)\n" + "".join(
    f"add_subdirectory({ROOT / name} {name})\n" for name in ("kernel", "native", "simulation")
)
STRING = """#include <stddef.h>
void *memcpy(void *, const void *, size_t);
void *memset(void *, int, size_t);
int memcmp(const void *, const void *, size_t);
"""
MATH = "#define isfinite(x) __builtin_isfinite(x)\n" + "".join(
    f"double {name}({arguments});\n"
    for arguments, names in {
        "double": ("sin", "cos", "exp", "sqrt", "fabs", "floor", "ceil", "round", "log"),
        "double, double": ("pow", "copysign"),
    }.items()
    for name in names
)
TOOLCHAIN = """set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR AMD64)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_C_COMPILER {folder}/clang-cl)
set(CMAKE_C_COMPILER_TARGET x86_64-pc-windows-msvc)
set(CMAKE_AR {archiver})
set(CMAKE_MT true)
set(CMAKE_C_FLAGS_INIT "-imsvc {folder}/include /clang:-ffreestanding -Werror=unknown-argument")
"""
OF_THE_COMPILER = {"__chkstk", "__security_check_cookie", "__security_cookie", "_fltused", "memcmp", "memcpy", "memset"}
OF_WINDOWS = {"__imp_IsProcessorFeaturePresent"}


@pytest.fixture(scope="module")
def clang() -> str:
    found = shutil.which("clang")
    if found is None:
        message = "clang is not installed: `make system-packages` installs it"
        pytest.fail(message) if os.environ.get("CI") else pytest.skip(message)
    return found


def run(*command: str | Path) -> str:
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def libraries(clang: str, folder: Path) -> dict[str, str]:
    """What the build prints, the names of its libraries and their symbols."""
    archiver, names = (run(clang, f"-print-prog-name={name}").strip() for name in ("llvm-lib", "llvm-nm"))
    (folder / "clang-cl").symlink_to(clang)
    (folder / "include").mkdir()
    for name, text in (("string.h", STRING), ("math.h", MATH)):
        (folder / "include" / name).write_text(text)
    (folder / "toolchain.cmake").write_text(TOOLCHAIN.format(folder=folder, archiver=archiver))
    (folder / "CMakeLists.txt").write_text(PROJECT)
    run("cmake", "-G", "Ninja", "-S", folder, "-B", folder / "build", "-DCMAKE_BUILD_TYPE=None",
        f"-DCMAKE_TOOLCHAIN_FILE={folder / 'toolchain.cmake'}")  # fmt: skip
    printed = run("cmake", "--build", folder / "build", "--parallel", "2")
    built = sorted((folder / "build").rglob("*.lib"))
    return {
        "printed": printed,
        "libraries": " ".join(library.name for library in built),
        "symbols": run(names, *built),
    }


def test_the_c_compiles_for_windows_with_vectors_and_needs_only_what_windows_has(clang: str, tmp_path: Path) -> None:
    # All that what is built depends on; the same is not built again.
    key = [state("kernel", "native", "simulation"), version(clang), version("cmake"), PROJECT, TOOLCHAIN, STRING, MATH]
    file = stored("\0".join(key), lambda file: file.write_text(json.dumps(libraries(clang, tmp_path))))
    built = json.loads(file.read_text())
    assert "warning" not in built["printed"]
    assert built["libraries"] == "livebode_kernel.lib livebode_native.lib livebode_axis.lib"
    symbols = built["symbols"]
    for found in ("lb_sdft64_kernel_avx512", "lb_lines_avx2", "lb_matrix_avx2", "lb_two_masses_advance_avx512"):
        assert re.search(rf" [RT] {found}$", symbols, re.M), found
    missing = {name for name in re.findall(r"^ +U (\S+)$", symbols, re.M) if not name.startswith("lb_")}
    functions = set(re.findall(r"double (\w+)\(", MATH))
    assert missing - functions <= OF_THE_COMPILER | OF_WINDOWS
