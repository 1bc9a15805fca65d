"""Builds bench/native into build/bench and loads it."""

import ctypes
import importlib.util
import subprocess
import sys
import sysconfig
from functools import cache
from pathlib import Path
from types import ModuleType

SOURCE = Path(__file__).parent / "native"
BUILD = SOURCE.parents[1] / "build" / "bench"


def build() -> None:
    scripts = Path(sysconfig.get_path("scripts"))
    cmake = str(scripts / "cmake") if (scripts / "cmake").exists() else "cmake"
    configure = ["-S", SOURCE, "-B", BUILD, f"-DPython_EXECUTABLE={sys.executable}", "-DCMAKE_BUILD_TYPE=Release"]
    for command in ([cmake, *configure], [cmake, "--build", BUILD, "--parallel", "2"]):
        subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)


@cache
def empty() -> ModuleType:
    """The module whose Nothing.push does nothing."""
    (path,) = BUILD.glob("_empty.*.so")
    spec = importlib.util.spec_from_file_location("_empty", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def peers() -> ctypes.CDLL:
    """The C functions of rls.c and frf.c."""
    (path,) = BUILD.glob("libpeers.*")
    library = ctypes.CDLL(str(path))
    signal, count = ctypes.c_void_p, ctypes.c_size_t
    for name in ("rls_loops", "rls_rows", "rls_triangle"):
        getattr(library, name).argtypes = [signal, signal, count, ctypes.c_double]
        getattr(library, name).restype = ctypes.c_double
    for name in ("frf_queued", "frf_pushed"):
        getattr(library, name).argtypes = [ctypes.c_void_p, signal, signal, count, count]
        getattr(library, name).restype = ctypes.c_double
    library.frf_new.argtypes = [ctypes.c_uint32, ctypes.c_uint32, ctypes.c_void_p, ctypes.c_int]
    library.frf_new.restype = ctypes.c_void_p
    library.frf_free.argtypes = [ctypes.c_void_p]
    return library
