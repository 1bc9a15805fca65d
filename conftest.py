"""One thread of linear algebra for each test process, whose neighbours have the other cores.

Threads of small products wait for each other, and keep a core busy while they do. What is set already is kept.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
