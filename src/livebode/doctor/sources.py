"""Whether each axis's source can be used, and answers."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from livebode.configuration.axis import Axis
from livebode.core import LivebodeError, counted
from livebode.doctor.check import Check
from livebode.doctor.recordings import check_recording
from livebode.runtime.recorded_run import RecordedRun
from livebode.sources.live import make_source
from livebode.sources.live.address import Address
from livebode.sources.live.can_bus import CanSource
from livebode.sources.live.hal import HalSource

NAME = "source"
TIMEOUT_S = 3.0
_AT_ONCE = 16


def check_sources(axes: Mapping[str, Axis]) -> list[Check]:
    """A check for each axis; a single one where there is none. At most a connection is opened, and closed again."""
    if not axes:
        return [Check(NAME, "not applicable", "there is no valid configuration of an axis that still runs")]
    with ThreadPoolExecutor(_AT_ONCE, "livebode doctor") as threads:
        return list(threads.map(_check, axes, axes.values()))


def _check(of: str, axis: Axis) -> Check:
    name, settings = f"{NAME} of {of}" if of else NAME, axis.source
    try:
        if settings.replay is not None:
            samples = RecordedRun(settings.replay).samples
            return Check(name, "ok", f"{settings.replay} has {counted(samples, 'recorded sample')}")
        if settings.url is None:
            found = [check_recording(name, axis, path) for path in settings.logs]
            return next((check for check in found if check.verdict != "ok"), found[0])
        source = make_source(settings)
        if isinstance(source, CanSource):
            return _bus(name, source)
        if isinstance(source, HalSource):
            return _hal(name, source)
    except LivebodeError as error:
        return Check.of_error(name, error)
    address = source.address
    if address.scheme == "stdin":
        return Check(name, "not applicable", "samples come from standard input")
    if address.scheme.startswith("daq"):
        return Check(name, "not applicable", f"{address} is opened by the SDK of openDAQ when the run begins")
    if address.scheme == "serial":
        return _plugged_in(name, address)
    return _receiving(name, address) if address.scheme == "udp" else _connecting(name, address)


def _hal(name: str, source: HalSource) -> Check:
    facts = {"address": str(source.address)}
    try:
        wiring = source.wiring()
    except OSError as error:
        return Check(name, "failed", f"{source.address}: {error}", "check LinuxCNC on this computer", facts)
    names = ", ".join(channel.name for channel in wiring.channels)
    return Check(name, "ok", f"{source.address} samples {names} at {wiring.rate_hz:.9g} Hz", facts=facts)


def _receiving(name: str, address: Address) -> Check:
    """UDP: nobody answers there, but the port must be ours to receive on."""
    facts = {"address": str(address)}
    family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as port:
            port.bind((address.host, address.port))
    except OSError as error:
        remedy = "end the program that receives there, perhaps a run of livebode, or check source.url"
        return Check(name, "failed", f"{address}: {error.strerror or error}", remedy, facts)
    return Check(name, "ok", f"{address} is free to receive on", facts=facts)


def _plugged_in(name: str, address: Address) -> Check:
    """A serial port: it is not opened, since that starts many devices again."""
    facts = {"address": str(address)}
    path = Path(address.path)
    if os.name != "nt" and not path.exists():
        from serial.tools.list_ports import comports

        found = [port.device for port in comports()]
        remedy = f"plug the device in, or set source.url to {' or '.join(found)}" if found else "plug the device in"
        return Check(name, "failed", f"{address}: there is no such device", remedy, facts)
    if os.name != "nt" and not os.access(path, os.R_OK | os.W_OK):
        remedy = f"add the user to the group of {path}, often dialout, and log in again"
        return Check(name, "failed", f"{address}: permission denied", remedy, facts)
    return Check(name, "ok", f"{address} is there", facts=facts)


def _bus(name: str, source: CanSource) -> Check:
    facts = {"address": str(source.address)}
    try:
        with source.open_bus():
            pass
    except OSError as error:
        remedy = "check source.url, and that the interface is up: ip link set can0 up type can bitrate 1000000"
        return Check(name, "failed", f"{source.address}: {error.strerror or error}", remedy, facts)
    return Check(name, "ok", f"{source.address} can be opened", facts=facts)


def _connecting(name: str, address: Address) -> Check:
    facts = {"address": str(address), "timeout_s": TIMEOUT_S}
    try:
        if address.scheme == "klipper":
            with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as link:
                link.connect(str(Path(address.path).expanduser()))
        else:
            socket.create_connection((address.host, address.port), TIMEOUT_S).close()
    except OSError as error:
        why = f"no answer within {TIMEOUT_S:g} s" if isinstance(error, TimeoutError) else error.strerror or str(error)
        remedy = "check that it is switched on, its address in source.url, and the firewall"
        return Check(name, "failed", f"{address}: {why}", remedy, facts)
    return Check(name, "ok", f"{address} accepts connections", facts=facts)
