"""Senders of every kind that send a numbered sample each millisecond for as long as they are open."""

from __future__ import annotations

import contextlib
import os
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import can
import numpy as np
import pyarrow as pa
from pyads import constants
from pyads.testserver import PLCVariable
from pyarrow import parquet

from livebode.records import RunRecord
from livebode.sources.live import Batch, encode_layout, encode_line, encode_samples
from livebode_drives.live.ads import HEADER, MAGIC, VERSION
from livebode_drives.live.klipper import WAIT_S
from tests.support.command import RATE_HZ
from tests.support.peers.broker import TOPIC, Mosquitto, publisher, stop
from tests.support.peers.can_bus import COUNTED
from tests.support.peers.hal import RATE_HZ as HAL_RATE_HZ
from tests.support.peers.hal import SETTINGS, Hal, only_hal
from tests.support.peers.klipper import Printer
from tests.support.peers.machine import CHANNELS, data
from tests.support.peers.opcua import OpcUaPeer
from tests.support.peers.peer import CHANNELS as OPC_UA_CHANNELS
from tests.support.peers.peer import STAMP_S, free_port, until
from tests.support.peers.plain import TcpPeer
from tests.support.peers.plc import NET_ID, Memory, Server
from tests.support.peers.serial_line import SerialJsonPeer

BATCH = 20
PERIOD = 1_000
EPOCH = 9


def batch(first: int, samples: int = BATCH, epoch: int = EPOCH) -> Batch:
    """The samples from number `first` on; w, u and y repeat each second."""
    at = np.arange(first, first + samples)
    return Batch(first, np.vstack([_PERIOD[:3, at % PERIOD], at]), CHANNELS, float(RATE_HZ), epoch)


_PERIOD = data(PERIOD)


class Feed:
    """Sends in real time, in a thread of its own, from `first` on."""

    fifo: Path | None = None
    rest: ClassVar[dict[str, Any]] = {}
    """Sections of the configuration that differ from those of other kinds."""
    keeps = False
    """Whether what is sent while nobody records waits for the next process, so that every loss is a kill's."""
    number = "n"
    """The channel that holds the number of the sample; "sample" if none does."""
    rate_hz = RATE_HZ
    most_s = 1.0
    """The most that a kill may cost."""
    exact = True
    """Whether the sender's numbers give the length of any pause of livebode."""
    source: dict[str, Any]
    first = 70_000
    samples = BATCH
    """Of a batch."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.sent = folder, self.first
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Feed:
        self.open()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self._thread.join()
        self.close()

    def _run(self) -> None:
        began = time.monotonic()
        while not self._done.wait(0.005):
            due = self.first + int((time.monotonic() - began) * RATE_HZ)
            while self.sent + self.samples <= due and not self._done.is_set():
                self.send(batch(self.sent, self.samples))
                self.sent += self.samples

    def open(self) -> None:
        raise NotImplementedError

    def send(self, batch: Batch) -> None:
        raise NotImplementedError

    def close(self) -> None:
        """Nothing more is sent."""

    def check(self, run: Path) -> None:
        """What the numbers of the samples do not show."""


class UdpFeed(Feed):
    def open(self) -> None:
        port = free_port(socket.SOCK_DGRAM)
        self.source = {"url": f"udp://127.0.0.1:{port}"}
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._to = ("127.0.0.1", port)

    def send(self, batch: Batch) -> None:
        for frame in (encode_layout(CHANNELS, float(RATE_HZ), epoch=EPOCH), encode_samples(batch, double=True)):
            self._socket.sendto(frame, self._to)

    def close(self) -> None:
        self._socket.close()


class TcpFeed(Feed):
    def open(self) -> None:
        self._peer = TcpPeer(self.folder)
        self._peer.layout = encode_layout(CHANNELS, float(RATE_HZ), epoch=EPOCH)
        self._peer.__enter__()
        self.source = self._peer.settings

    def send(self, batch: Batch) -> None:
        link = self._peer._link
        if link is not None:
            with contextlib.suppress(OSError):  # the process was killed
                link.sendall(encode_samples(batch, double=True))

    def close(self) -> None:
        self._peer.__exit__()


class SerialFeed(Feed):
    """What the port holds while nobody has opened it is dropped."""

    def open(self) -> None:
        self._peer = SerialJsonPeer(self.folder).__enter__()
        self.source = self._peer.settings

    def send(self, batch: Batch) -> None:
        self._peer.write(encode_line(batch))

    def close(self) -> None:
        self._peer.__exit__()


class MqttFeed(Feed):
    """The broker keeps what comes while nobody is there."""

    keeps = True

    def __init__(self, folder: Path, *broker: str) -> None:
        super().__init__(folder)
        self._settings = ("allow_anonymous true", "max_queued_messages 0", *broker)

    def open(self) -> None:
        self._broker = Mosquitto(self.folder, self._settings).__enter__()
        url = f"mqtt://127.0.0.1:{self._broker.port}/{TOPIC}"
        self.source = {"url": url, "client_id": "livebode"}
        self._publisher = publisher(self._broker.port)

    def send(self, batch: Batch) -> None:
        self._publisher.publish(TOPIC, encode_line(batch), qos=1)

    def wait_subscribed(self) -> None:
        until(lambda: self._broker.logged(Mosquitto.subscribed), "a subscription")

    def close(self) -> None:
        stop(self._publisher)
        self._broker.__exit__()


class StdinFeed(Feed):
    """A pipe with a name, that this end keeps open: what is in it when its reader is killed the next one reads."""

    keeps = True

    def open(self) -> None:
        self.source = {"url": "stdin:"}
        self.fifo = self.folder / "lines"
        os.mkfifo(self.fifo)
        self._end = os.open(self.fifo, os.O_RDWR | os.O_NONBLOCK)

    def send(self, batch: Batch) -> None:
        line = encode_line(batch)
        while line and not self._done.is_set():
            try:
                line = line[os.write(self._end, line) :]
            except BlockingIOError:  # the pipe is full
                self._done.wait(0.005)

    def close(self) -> None:
        os.close(self._end)


class FileFeed(Feed):
    keeps = True
    first = 0

    def open(self) -> None:
        self.path = self.folder / "log.csv"
        self.source = {"log": self.path, "follow": True}
        self._file = self.path.open("w", buffering=1)
        self._file.write("t,w,u,y,n\n")

    def send(self, batch: Batch) -> None:
        self._file.write(rows(batch))

    def close(self) -> None:
        self._file.close()


class CountedFileFeed(FileFeed):
    """Without a column of time: rows are counted."""

    def open(self) -> None:
        super().open()
        self.source |= {"rate_hz": float(RATE_HZ), "time": "none"}


class DirectoryFeed(Feed):
    """Whole recordings, some batches long, each put in its place by its name."""

    keeps = True
    first = 0

    def open(self) -> None:
        self.path = self.folder / "segments"
        self.path.mkdir()
        self.source = {"log": self.path, "follow": True}
        self._waiting: list[Batch] = []

    def send(self, batch: Batch) -> None:
        self._waiting.append(batch)
        if len(self._waiting) == 10:
            put_recording(self.path, self._waiting)
            self._waiting.clear()


class RingFeed(Feed):
    """A PLC's ring of 16 s: what livebode missed while it was away is read from it."""

    keeps = True
    length = 16_384

    def open(self) -> None:
        self._data = np.zeros((self.length, len(CHANNELS)))
        self._variable = PLCVariable("MAIN.livebode", b"", constants.ADST_BIGTYPE, "ST_LivebodeRing")
        memory, port = Memory(), free_port()
        self._lock = memory.lock
        self.send(batch(self.first - self.length, self.length))  # it has been full for long
        memory.add_variable(self._variable)
        self._server = Server(memory, "127.0.0.1", port, logging=False)
        self._server.server.listen()
        self._server.start()
        channels = [f"{channel.name} [{channel.unit}]" for channel in CHANNELS]
        url = f"ads://127.0.0.1:{port}"
        self.source = {"url": url, "net_id": NET_ID, "symbol": "MAIN.livebode", "channels": channels}

    def send(self, batch: Batch) -> None:
        self._data[np.arange(batch.first_sample, batch.stop) % self.length] = batch.data.T
        head = HEADER.pack(MAGIC, VERSION, len(CHANNELS), self.length, EPOCH, float(RATE_HZ), 0, batch.stop)
        with self._lock:
            self._variable.value = head + self._data.tobytes()

    def close(self) -> None:
        self._server.close()


class OpcUaFeed(Feed):
    """The server has no epoch, and cannot keep up with small batches; its channels are the number and noise."""

    samples = 100
    rest: ClassVar[dict[str, Any]] = {
        "signals": {"input": "w", "output": "y"},
        "tracking": {"hop": 20, "estimator": "direct"},
    }
    number = "w"

    def open(self) -> None:
        self._peer = OpcUaPeer(self.folder).__enter__()
        self.source = self._peer.settings | {"rate_hz": float(RATE_HZ)}

    def send(self, batch: Batch) -> None:
        stamp_s = STAMP_S + batch.first_sample / RATE_HZ
        self._peer.send(replace(batch, data=batch.data[[3, 2]], channels=OPC_UA_CHANNELS, stamp_s=stamp_s))

    def close(self) -> None:
        self._peer.__exit__()


class KlipperFeed(Feed):
    """Its acceleration in y is the print time in samples. Samples wait for the moves of their time."""

    rest: ClassVar[dict[str, Any]] = {
        "signals": {"input": "accel_x", "output": "accel_y"},
        "tracking": {"hop": 20, "estimator": "direct"},
    }
    number = "accel_y"
    most_s = 1.0 + WAIT_S

    def open(self) -> None:
        self._printer = Printer(self.folder, 1003.7, numbered_hz=RATE_HZ).__enter__()
        self.source = self._printer.settings | {"rate_hz": float(RATE_HZ)}

    def _run(self) -> None:
        began_s, printer = time.monotonic() - self._printer.time_s, self._printer
        while not self._done.wait(0.01):
            while printer.time_s < time.monotonic() - began_s:
                with contextlib.suppress(KeyError):  # somebody connects at this moment
                    printer.measure()
                    printer.move()
                self.sent = round(printer.time_s * RATE_HZ)

    def close(self) -> None:
        self._printer.__exit__()


class HalFeed(Feed):
    """LinuxCNC itself, whose sampler holds 4 s; its channel n counts the periods of the thread."""

    rest: ClassVar[dict[str, Any]] = {
        "signals": {"input": "n", "output": "w"},
        "lines": {"frequencies": "200,400,800", "window": 100},
        "tracking": {"hop": 20, "estimator": "direct"},
    }
    rate_hz = HAL_RATE_HZ

    def open(self) -> None:
        self._entered = contextlib.ExitStack()
        self._entered.enter_context(only_hal())
        self._hal = self._entered.enter_context(Hal())
        self.source = SETTINGS | {"channels": ["w [N m]", "n"]}

    def _run(self) -> None:
        while not self._done.wait(0.02):
            self.sent = self._hal.periods()

    def close(self) -> None:
        self._entered.close()


class CanFeed(Feed):
    """Frames of a bus over the network. After a pause of livebode the counter may have wrapped, so it is a restart."""

    rest: ClassVar[dict[str, Any]] = {
        "signals": {"input": "w", "output": "y"},
        "tracking": {"hop": 20, "estimator": "direct"},
    }
    number = "w"
    exact = False

    def open(self) -> None:
        dbc = self.folder / "drive.dbc"
        dbc.write_text(COUNTED)
        group = "239.{}.{}.{}".format(*np.random.default_rng().integers(1, 255, 3))
        self.source = {
            "url": f"can:udp_multicast/{group}", "dbc": dbc, "rate_hz": float(RATE_HZ), "channels": ["w", "y"],
            "counter": "w", "can_fd": True,
        }  # fmt: skip
        self._bus = can.Bus(interface="udp_multicast", channel=group, fd=True)

    def send(self, batch: Batch) -> None:
        for number, y in zip(batch.data[3], batch.data[2]):
            data = struct.pack("<Q", int(number)) + struct.pack("<d", y)
            self._bus.send(can.Message(arbitration_id=291, data=data, is_extended_id=False, is_fd=True))

    def close(self) -> None:
        self._bus.shutdown()


class DaqFeed(Feed):
    """openDAQ's reference device behind a server: a sine, whose samples are numbered by the ticks of its clock."""

    rest: ClassVar[dict[str, Any]] = {
        "signals": {"input": "AI0", "output": "AI1"},
        "tracking": {"hop": 20, "estimator": "direct"},
    }
    number = "sample"

    def open(self) -> None:
        port = free_port()
        command = [sys.executable, "-m", "tests.support.peers.daq_server", str(port)]
        self._server = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self._server.stdout is not None
        assert self._server.stdout.readline() == b"serving\n"
        self.source = {"url": f"daq.nd://127.0.0.1:{port}", "channels": ["AI0", "AI1"]}

    def _run(self) -> None:
        """The device sends by itself; what a kill costs is not known here."""

    def close(self) -> None:
        self._server.kill()
        self._server.communicate()

    def check(self, run: Path) -> None:
        """Each sample belongs to the one sine of the device, of ten periods in a second."""
        tables = list(map(pa.table, RunRecord.open(run).tables("samples")))
        number, values = (np.concatenate([table[name].to_numpy() for table in tables]) for name in ("sample", "AI0"))
        turn = 2 * np.pi * 10.0 * number / RATE_HZ
        columns = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        found = np.linalg.lstsq(columns, values, rcond=None)[0]
        assert np.max(np.abs(columns @ found - values)) < 1e-6


def rows(batch: Batch) -> str:
    time_s = np.arange(batch.first_sample, batch.stop) / RATE_HZ
    return "".join(
        f"{t:.3f},{','.join(map(repr, map(float, row)))}\n" for t, row in zip(time_s, batch.data.T, strict=True)
    )


def put_recording(folder: Path, batches: list[Batch]) -> Path:
    """The samples of these batches as a recording of their own, put whole."""
    first = batches[0].first_sample
    data = np.concatenate([batch.data for batch in batches], axis=1)
    time_s = np.arange(first, first + data.shape[1]) / RATE_HZ
    columns = {"t": time_s} | {channel.name: row for channel, row in zip(CHANNELS, data)}
    path = folder / f"{first:09d}.parquet"
    parquet.write_table(pa.table(columns), folder / f".{path.name}")
    return (folder / f".{path.name}").rename(path)


FEEDS: dict[str, Callable[[Path], Feed]] = {
    "udp": UdpFeed,
    "tcp": TcpFeed,
    "serial": SerialFeed,
    "mqtt": MqttFeed,
    "stdin": StdinFeed,
    "file": FileFeed,
    "counted-file": CountedFileFeed,
    "directory": DirectoryFeed,
    "ads": RingFeed,
    "opc.tcp": OpcUaFeed,
    "klipper": KlipperFeed,
    "hal": HalFeed,
    "can": CanFeed,
    "opendaq": DaqFeed,
}
WHOLE = {"file", "counted-file", "directory", "ads", "mqtt"}
"""Kinds of which nothing may be lost at all."""
