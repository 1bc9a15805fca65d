"""The process of a job: a command of livebode that ends as by Ctrl-C when its standard input is closed.

A pipe has this on every system, also where one process cannot send a signal to another; and the system closes it when
the server is killed, so that no job outlives its server.
"""

from __future__ import annotations

import os
import signal
import sys
import threading


def main() -> None:
    """Run the command line."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a server in the background ignores it, and so would we
    server = os.dup(0)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    sys.argv[0] = "livebode"  # as the help calls it
    try:
        threading.Thread(target=_interrupt_at_end, args=(server,), daemon=True).start()
        from livebode.cli import main as run_command_line
        from livebode.cli import print_percent

        print_percent()
        run_command_line()
    except KeyboardInterrupt:  # before the command line has begun, or while it ends
        print("livebode: stopped; nothing was written", file=sys.stderr)
        sys.exit(128 + signal.SIGINT)


def _interrupt_at_end(server: int) -> None:
    while os.read(server, 1):
        pass
    if hasattr(signal, "pthread_kill"):  # it also ends a system call that waits
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        signal.raise_signal(signal.SIGINT)
