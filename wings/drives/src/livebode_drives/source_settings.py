"""Keys of [source] of the live sources of drives and PLCs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from livebode.core import Field
from livebode.sources.live import SourceKeys

File = Annotated[Path, Field(strict=False)]


class DriveKeys(SourceKeys):
    """The keys of all kinds; the table of the kinds has those of each.

    Parameters
    ----------
    username
        User name at the broker or server (MQTT, OPC UA).
    password_env
        Environment variable with the password (MQTT, OPC UA).
    password_file
        File with the password, relative to this file (MQTT, OPC UA).
    ca_file
        Certificate of the authority that signed the broker's certificate, relative to this file (mqtts).
    certificate_file
        Certificate of livebode, relative to this file (mqtts, OPC UA).
    key_file
        Private key of livebode, relative to this file (mqtts, OPC UA).
    server_certificate_file
        Certificate of the server, relative to this file (OPC UA).
    security
        Security policy; messages are signed and encrypted (OPC UA). Default: no security.
    client_id
        Name of the client, for which the broker stores messages while livebode is disconnected (MQTT).
    nodes
        Node id of each channel: "w [N m]" = "ns=2;s=axis.w" (OPC UA).
    sample_node
        Node id of the number of the batch's first sample (OPC UA). Default: from the time stamps.
    symbol
        Symbol of the ring, or of the array that is notified (ADS).
    channels
        Channels in the order of the symbol (ADS) or of a line (serial), each with its unit: "w [N m]". Signals of the
        DBC: "Get_Iq.Iq_Measured", or "Iq_Measured" if one message has it (CAN). Signals of the
        device; default: all that share the clock of the first (openDAQ). Names of signals at the sampler, each with its
        unit; default: all of them (hal).
    counter
        The channel that counts the samples, so that losses are exact. Default: lines are counted (serial); frames are
        numbered by their time (CAN).
    counter_modulus
        Number of values of the counter, if it wraps: 65536 for 16 bits (serial).
    baud_rate
        Bits per second of the serial port, as the device has it.
    bitrate
        Bits per second of the bus, for adapters that do not have it from the system (CAN).
    can_fd
        Receive CAN FD frames as well (CAN).
    accelerometer
        Section of the accelerometer in printer.cfg, such as "adxl345 bed" (Klipper).
    sample_signal
        Signal at the sampler that counts the periods of its thread (hal).
    mode
        "ring": reads a ring in the PLC program, without losses. "notify": the PLC sends each sample (ADS).
    net_id
        AMS net id of the PLC (ADS).
    local_net_id
        AMS net id of this computer, for which the PLC has a route (ADS).
    ams_port
        AMS port of the PLC runtime (ADS).
    poll_s
        Time between reads of the ring, in seconds (ADS).
    """

    username: str | None = None
    password_env: str | None = None
    password_file: File | None = None
    ca_file: File | None = None
    certificate_file: File | None = None
    key_file: File | None = None
    server_certificate_file: File | None = None
    security: Literal["Basic256Sha256", "Aes128Sha256RsaOaep", "Aes256Sha256RsaPss"] | None = None
    client_id: str | None = None
    nodes: dict[str, str] = {}
    sample_node: str | None = None
    symbol: str | None = None
    channels: list[str] = []
    counter: str | None = None
    counter_modulus: Annotated[int, Field(ge=2, le=1 << 53)] | None = None
    baud_rate: Annotated[int, Field(ge=50, le=100_000_000)] = 115200
    bitrate: Annotated[int, Field(ge=1000, le=20_000_000)] | None = None
    can_fd: bool = False
    accelerometer: str = "adxl345"
    sample_signal: str | None = None
    mode: Literal["ring", "notify"] = "ring"
    net_id: str | None = None
    local_net_id: str | None = None
    ams_port: Annotated[int, Field(ge=1, le=65535)] = 851
    poll_s: Annotated[float, Field(gt=0, le=10)] = 0.05
