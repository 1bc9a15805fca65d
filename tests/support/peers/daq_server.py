"""openDAQ's reference device behind a server of its native protocol, on the port that is the only argument."""

from __future__ import annotations

import sys

import opendaq


def main(port: int) -> None:
    instance = opendaq.Instance()
    instance.add_device("daqref://device0")
    settings = opendaq.PropertyObject()
    settings.add_property(opendaq.IntProperty("NativeStreamingPort", port, True))
    instance.add_server("OpenDAQNativeStreaming", settings)
    print("serving", flush=True)
    sys.stdin.read()  # until the test ends


if __name__ == "__main__":
    main(int(sys.argv[1]))
