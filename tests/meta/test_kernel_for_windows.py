"""The C for Windows, by clang in the manner of clang-cl: it compiles with its vectors, and needs what Windows has.

There are no headers and libraries of Windows here: the few functions of C are declared, and nothing is linked or run.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

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


def test_the_c_compiles_for_windows_with_vectors_and_needs_only_what_windows_has(clang: str, tmp_path: Path) -> None:
    archiver, names = (run(clang, f"-print-prog-name={name}").strip() for name in ("llvm-lib", "llvm-nm"))
    (tmp_path / "clang-cl").symlink_to(clang)
    (tmp_path / "include").mkdir()
    for name, text in (("string.h", STRING), ("math.h", MATH)):
        (tmp_path / "include" / name).write_text(text)
    (tmp_path / "toolchain.cmake").write_text(TOOLCHAIN.format(folder=tmp_path, archiver=archiver))
    (tmp_path / "CMakeLists.txt").write_text(PROJECT)
    run("cmake", "-G", "Ninja", "-S", tmp_path, "-B", tmp_path / "build", "-DCMAKE_BUILD_TYPE=None",
        f"-DCMAKE_TOOLCHAIN_FILE={tmp_path / 'toolchain.cmake'}")  # fmt: skip
    printed = run("cmake", "--build", tmp_path / "build", "--parallel", "2")
    assert "warning" not in printed
    libraries = sorted((tmp_path / "build").rglob("*.lib"))
    assert [library.name for library in libraries] == [
        "livebode_kernel.lib",
        "livebode_native.lib",
        "livebode_axis.lib",
    ]
    symbols = run(names, *libraries)
    for found in ("lb_sdft64_kernel_avx512", "lb_lines_avx2", "lb_matrix_avx2", "lb_two_masses_advance_avx512"):
        assert re.search(rf" [RT] {found}$", symbols, re.M), found
    missing = {name for name in re.findall(r"^ +U (\S+)$", symbols, re.M) if not name.startswith("lb_")}
    functions = set(re.findall(r"double (\w+)\(", MATH))
    assert missing - functions <= OF_THE_COMPILER | OF_WINDOWS
