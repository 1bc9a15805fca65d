"""The threads of a session take their memory from the same place."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest

PROGRAM = """
import ctypes, threading
import sys
if "before" in sys.argv:
    import pyarrow as pa
from livebode.runtime.allocation import share_between_threads

share_between_threads()
together = threading.Barrier(9)

def work():
    held = [ctypes.create_string_buffer(2000) for _ in range(100)]
    together.wait()
    together.wait()
    return held

threads = [threading.Thread(target=work) for _ in range(8)]
for thread in threads:
    thread.start()
together.wait()
import pyarrow as pa
print(pa.default_memory_pool().backend_name, flush=True)
library = ctypes.CDLL(None)
library.fdopen.restype = ctypes.c_void_p
stream = ctypes.c_void_p(library.fdopen(1, b"w"))
library.malloc_info(0, stream)
library.fflush(stream)
together.wait()
"""


@pytest.mark.parametrize("arrow_is_loaded", ["before", "later"])
@pytest.mark.skipif(sys.platform != "linux", reason="only glibc has arenas")
def test_threads_of_a_session_share_an_arena(arrow_is_loaded: str) -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM, arrow_is_loaded], check=True, capture_output=True, text=True)
    assert done.stdout.startswith("system")
    arenas = re.findall("<heap nr=", done.stdout)
    assert len(arenas) <= 2  # the main thread's, and one of a library that was loaded before
