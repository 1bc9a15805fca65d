"""A closed loop in LinuxCNC's HAL: pid, a plant of standard components, a streamer in front and a sampler behind.

The plant is lowpass and biquad, which act on u after it was sampled: y(n + 1) belongs to u(n). All components compute
what their manual pages state, so the frequency response is known in closed form.
"""

from __future__ import annotations

import fcntl
import os
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from livebode_drives.live.hal_wiring import SAMPLER_KEY, STREAMER_KEY, fifo
from tests.support.peers.peer import program, until

RATE_HZ = 4000
DEPTH = 16000
CHANNELS = ["w [N m]", "u [N m]", "velocity [rad/s]"]
SETTINGS = {"url": "hal:sampler.0", "channels": CHANNELS, "sample_signal": "n"}
GAIN, INTEGRAL = 0.6, 4.0
_LOW = 0.2
_BIQUAD = {"n0": 0.52, "n1": -1.0, "n2": 0.5, "d1": -1.94, "d2": 0.96}
_HAL_KEYS = (0x48414C32, 0x48484C34)
_STARTED = f"""
addf streamer.0 t
addf streamer.1 t
addf mux2.0 t
addf sum2.1 t
addf pid.0.do-pid-calcs t
addf sum2.0 t
addf sum2.2 t
addf sampler.0 t
addf lowpass.0 t
addf biquad.0 t
net played streamer.0.pin.0 => mux2.0.in0
net nothing-left streamer.0.empty => mux2.0.sel
net w mux2.0.out => sum2.0.in0 sampler.0.pin.0
net noise streamer.1.pin.0 => sum2.1.in1
net plant-output biquad.0.out => sum2.1.in0
net velocity sum2.1.out => pid.0.feedback sampler.0.pin.2
net control pid.0.output => sum2.0.in1
net u sum2.0.out => lowpass.0.in sampler.0.pin.1
net low lowpass.0.out => biquad.0.in
net n sum2.2.out => sum2.2.in0 sampler.0.pin.3
setp sum2.2.offset 1
setp lowpass.0.gain {_LOW}
setp pid.0.Pgain {GAIN}
setp pid.0.Igain {INTEGRAL}
setp pid.0.enable 1
{chr(10).join(f"setp biquad.0.{name} {value}" for name, value in _BIQUAD.items())}
setp biquad.0.enable 1
start
"""


def plant(frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
    """From u to the velocity: one period of delay, lowpass, biquad."""
    back = np.exp(-2j * np.pi * np.asarray(frequency_hz) / RATE_HZ)
    low = _LOW / (1 - (1 - _LOW) * back)
    b = _BIQUAD
    return np.asarray(
        back * low * (b["n0"] + b["n1"] * back + b["n2"] * back**2) / (1 + b["d1"] * back + b["d2"] * back**2)
    )


def sensitivity(frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
    """From w to u: pid integrates the error before it uses it."""
    back = np.exp(-2j * np.pi * np.asarray(frequency_hz) / RATE_HZ)
    return np.asarray(1 / (1 + plant(frequency_hz) * (GAIN + INTEGRAL / RATE_HZ / (1 - back))))


class Hal:
    """rtapi_app with the loop. Use it as a context manager: one HAL runs on a computer at a time."""

    def __init__(self, depth: int = DEPTH) -> None:
        self._depth = depth
        self._players: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Hal:
        # rtapi_app opens a socket here, as another user where root starts it.
        self._temporary = tempfile.TemporaryDirectory(prefix="hal-")
        self.folder = Path(self._temporary.name)
        self.folder.chmod(0o777)
        try:
            self.start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        for player in self._players:
            player.kill()
            player.wait()
            assert player.stderr is not None
            player.stderr.close()
        self.kill()
        with self._temporary:
            remove_memory()

    def start(self) -> None:
        """Start rtapi_app itself: where none runs, halcmd loadrt becomes it, and does not return."""
        self.folder.chmod(0o777)
        # As root it wants another user to fall back to.
        self._environment = os.environ | {
            "RTAPI_UID": str(os.getuid() or 65534),
            "RTAPI_FIFO_PATH": f"{self.folder}/rt",
        }
        command = [program("rtapi_app"), "load", "threads", "name1=t", f"period1={10**9 // RATE_HZ}"]
        self.process = subprocess.Popen(
            command, env=self._environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )
        # Two programs that attach to HAL's new memory at once both initialise it, and the second wipes what the first
        # loaded: only when the memory is there may another program start, and `load` waits until rtapi_app answers.
        until(self._serves, "HAL's memory")
        for module in (
            f"sampler depth={self._depth} cfg=ffff", f"streamer depth={self._depth},{10 * DEPTH} cfg=f,f",
            "mux2", "sum2 count=3", "pid num_chan=1", "lowpass", "biquad",
        ):  # fmt: skip
            subprocess.run(
                ["rtapi_app", "load", *module.split()],
                env=self._environment, check=True, timeout=30, capture_output=True,
            )  # fmt: skip
        self.halcmd("-f", stdin=_STARTED)

    def _serves(self) -> bool:
        assert self.process.poll() is None, f"rtapi_app ended with {self.process.returncode}"
        used = fifo(_HAL_KEYS[0])
        return used is not None and used.users > 0

    def kill(self) -> None:
        """End rtapi_app as a fault does; its shared memory remains."""
        self.process.kill()
        self.process.wait()

    def halcmd(self, *words: str, stdin: str = "") -> str:
        done = subprocess.run(["halcmd", *words], input=stdin, capture_output=True, text=True, timeout=30, check=True)
        return done.stdout

    def periods(self) -> int:
        """Number of periods of the thread so far."""
        return int(float(self.halcmd("getp", "sum2.2.out")))

    def play(self, samples: NDArray[np.float64], number: int = 0) -> subprocess.Popen[bytes]:
        """Play samples through a streamer, and wait until the first ones are in its FIFO."""
        path = self.folder / f"streamer{number}-{len(self._players)}"
        np.savetxt(path, samples, fmt="%.17g")
        player = subprocess.Popen(["halstreamer", "-c", str(number), str(path)], stderr=subprocess.PIPE)
        self._players.append(player)
        until(lambda: self.halcmd("getp", f"streamer.{number}.empty").strip() == "FALSE", "the first samples")
        return player


def remove_memory() -> None:
    for key in (*_HAL_KEYS, *(base + n for base in (SAMPLER_KEY, STREAMER_KEY) for n in range(2))):
        if fifo(key) is not None:
            # The last user that ends removes it as well, perhaps before ipcrm does.
            subprocess.run(["ipcrm", "-M", hex(key)], stderr=subprocess.DEVNULL, check=False, timeout=10)
            assert fifo(key) is None


@contextmanager
def only_hal() -> Iterator[IO[str]]:
    """HAL's shared memory belongs to the computer: other test processes wait, and a LinuxCNC is left alone."""
    with (Path(tempfile.gettempdir()) / "livebode-test-hal.lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        used = fifo(_HAL_KEYS[0])
        assert used is None or used.users == 0, "LinuxCNC runs on this computer: end it before its tests"
        remove_memory()
        yield lock
