"""Beckhoff ADS: pyads' test server with a ring buffer, or one that notifies."""

from __future__ import annotations

import struct
import threading
from collections.abc import Sequence

import numpy as np
from pyads import constants
from pyads.testserver import AdsTestServer, AdvancedHandler, PLCVariable
from pyads.testserver.handler import AmsPacket, AmsResponseData

from livebode.sources.live import Batch
from livebode_drives.live.ads import FILETIME_1970
from livebode_drives.structured_text.project import ring_block, ring_type
from tests.support.peers.peer import CHANNELS, RATE_HZ, Peer, free_port, until
from tools.structured_text import Machine

LENGTH = 2048
NET_ID = "127.0.0.1.1.1"


class Memory(AdvancedHandler):
    """Symbols that can be read in part, as the memory of a PLC can."""

    def __init__(self) -> None:
        super().__init__()
        self.lock = threading.RLock()
        self.listener: tuple[bytes, bytes] | None = None

    def handle_request(self, request: AmsPacket) -> AmsResponseData:
        with self.lock:
            return super().handle_request(request)

    def get_variable_by_indices(self, index_group: int, index_offset: int) -> PLCVariable:
        for variable in self._data.values():
            at = index_offset - variable.index_offset
            if variable.index_group == index_group and 0 < at < variable.size:
                return PLCVariable("part", bytes(variable.value[at:]), variable.ads_type, "")
        return super().get_variable_by_indices(index_group, index_offset)


class Server(AdsTestServer):
    def stop(self) -> None:
        self._run = False
        if self.ident is not None:
            self.join()
        super().stop()


class AdsPeer(Peer):
    """What both ways have in common."""

    def __enter__(self) -> AdsPeer:
        self._port = free_port()
        self._memory = Memory()
        self.settings = {
            "url": f"ads://127.0.0.1:{self._port}",
            "net_id": NET_ID,
            "symbol": "MAIN.livebode",
            "channels": [f"{c.name} [{c.unit}]" for c in CHANNELS],
            "poll_s": 0.01,
        }
        self._prepare()
        self._start()
        return self

    def _prepare(self) -> None:
        raise NotImplementedError

    def _start(self) -> None:
        self._server = Server(self._memory, "127.0.0.1", self._port, logging=False)
        self._server.server.listen()  # its thread would do so some time later, and refuse who comes before
        self._server.start()

    def __exit__(self, *_: object) -> None:
        self._server.close()

    def _served(self, command: int) -> bool:
        return any(
            packet.ams_header.command_id == struct.pack("<H", command) for packet in self._server.request_history
        )

    def interrupt(self) -> None:
        self._server.close()
        self._start()
        self.wait_ready()


class RingPeer(AdsPeer):
    """The PLC program that livebode writes fills the ring, cycle by cycle."""

    def _prepare(self) -> None:
        names = [channel.name for channel in CHANNELS]
        self._machine = Machine(ring_type(len(names), RATE_HZ, length=LENGTH), ring_block(names, length=LENGTH))
        self._variable = PLCVariable("MAIN.livebode", b"", constants.ADST_BIGTYPE, "ST_LivebodeRing")
        self._memory.add_variable(self._variable)
        self._restart(0)

    def _restart(self, epoch: int) -> None:
        self._ring, self._block = (self._machine.instance(n) for n in ("ST_LivebodeRing", "FB_LivebodeRing"))
        self._epoch = epoch
        self._variable.value = self._ring.bytes()

    def wait_ready(self) -> None:
        until(lambda: self._served(constants.ADSCOMMAND_READ), "the ring to be read")

    def send(self, batch: Batch) -> None:
        with self._memory.lock:
            if batch.epoch != self._epoch:
                self._restart(batch.epoch)
            ring = self._ring.memory
            if ring.v_count == 0:
                # A machine that has run for long: what stands in the ring was written before.
                for number in range(max(0, batch.stop - LENGTH), batch.first_sample):
                    ring.v_data[number % LENGTH * len(CHANNELS)] = float(number)
            ring.v_count = batch.first_sample
            for i, row in enumerate(batch.data.T.tolist()):
                stamp = FILETIME_1970 + round((batch.stamp_s + i / RATE_HZ) * 1e7)
                self._block(ring=ring, stamp=stamp, **{c.name: value for c, value in zip(CHANNELS, row)})
            self._variable.value = self._ring.bytes()

    def lose(self, lost: Sequence[Batch]) -> None:
        with self._memory.lock:
            for batch in lost:
                self.send(batch)

    def send_rubbish(self) -> None:
        with self._memory.lock:
            kept, self._variable.value = self._variable.value, b"\xff" * len(self._variable.value)
            reads = len(self._server.request_history)
        until(lambda: len(self._server.request_history) > reads + 1, "the rubbish to be read")
        with self._memory.lock:
            self._variable.value = kept


class NotifyPeer(AdsPeer):
    numbers_begin_anew = False

    def _prepare(self) -> None:
        self.settings |= {"mode": "notify", "rate_hz": RATE_HZ}
        self._memory.add_variable(
            PLCVariable("MAIN.livebode", bytes(16), constants.ADST_BIGTYPE, "ARRAY [0..1] OF LREAL")
        )

    def wait_ready(self) -> None:
        until(lambda: self._served(constants.ADSCOMMAND_ADDDEVICENOTE), "a request for notifications")
        until(lambda: bool(self._watched().notifications), "a handle for them")

    def send(self, batch: Batch) -> None:
        stamps = FILETIME_1970 + np.round((batch.first_sample / RATE_HZ + np.arange(len(batch.data.T)) / RATE_HZ) * 1e7)
        self._notify([(int(stamp), row.tobytes()) for stamp, row in zip(stamps, batch.data.T)])

    def _watched(self) -> PLCVariable:
        return next(iter(self._memory._data.values()))

    def send_rubbish(self) -> None:
        self._notify([(1, bytes(16))])

    def _notify(self, samples: Sequence[tuple[int, bytes]]) -> None:
        """One packet with all samples, as TwinCAT sends what came within the largest delay."""
        asked = next(
            packet.ams_header
            for packet in reversed(self._server.request_history)
            if packet.ams_header.command_id == struct.pack("<H", constants.ADSCOMMAND_ADDDEVICENOTE)
        )
        handles = list(self._watched().notifications)
        if not handles:  # the source has stopped, and a PLC sends nothing then
            return
        body = b"".join(struct.pack("<QIII", stamp, 1, handles[-1], len(row)) + row for stamp, row in samples)
        stream = struct.pack("<II", len(body) + 4, len(samples)) + body
        ams = (
            asked.source_net_id + asked.source_port + asked.target_net_id + asked.target_port
            + struct.pack("<HHIII", constants.ADSCOMMAND_DEVICENOTE, 4, len(stream), 0, 0) + stream
        )  # fmt: skip
        if not self._server.clients:  # the connection has just ended
            return
        self._server.clients[-1].client.sendall(struct.pack("<HI", 0, len(ams)) + ams)
