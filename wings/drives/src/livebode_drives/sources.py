"""Kinds of live sources of drives and PLCs, their keys in [source], and what plays an excitation on them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from livebode.sources.live import MESSAGES, SourceKind

_TLS = {"certificate_file", "key_file"}
_LOGIN = {"username", "password_env", "password_file"}
_MQTT = MESSAGES | {"reorder_batches", "client_id"} | _LOGIN
_OPCUA = {"rate_hz", "nodes", "sample_node", "security", "server_certificate_file"} | _LOGIN | _TLS
_ADS = {"rate_hz", "symbol", "channels", "mode", "net_id", "ams_port", "local_net_id", "poll_s"}
_SERIAL = {"rate_hz", "channels", "counter", "counter_modulus", "baud_rate"}
_CAN = {"rate_hz", "dbc", "channels", "counter", "bitrate", "can_fd"}


def _kind(source: str, keys: set[str], **given: Any) -> SourceKind:
    return SourceKind(
        f"livebode_drives.live.{source}", frozenset(keys), "livebode_drives.source_settings:DriveKeys", **given
    )


SOURCES: Mapping[str, SourceKind] = {
    "mqtt": _kind("mqtt:MqttSource", _MQTT, port=1883, has_path=True, survey="livebode_drives.live.mqtt_survey:survey"),
    "mqtts": _kind(
        "mqtt:MqttSource",
        _MQTT | _TLS | {"ca_file"},
        port=8883,
        has_path=True,
        survey="livebode_drives.live.mqtt_survey:survey",
    ),
    "opc.tcp": _kind(
        "opcua:OpcUaSource", _OPCUA, port=4840, has_path=True, survey="livebode_drives.live.opcua_survey:survey"
    ),
    "ads": _kind("ads:AdsSource", _ADS, port=48898, player="livebode_drives.players.ads:AdsPlayer"),
    "hal": _kind(
        "hal:HalSource",
        {"channels", "sample_signal"},
        device="hal:sampler.0",
        player="livebode_drives.players.hal:HalPlayer",
    ),
    "serial": _kind("serial_line:SerialSource", _SERIAL, device="serial:/dev/ttyACM0"),
    "can": _kind("can_bus:CanSource", _CAN, device="can:socketcan/can0"),
    "klipper": _kind("klipper:KlipperSource", {"rate_hz", "accelerometer"}, device="klipper:/tmp/klippy_uds"),
    "daqref": _kind("daq:DaqSource", {"channels"}, device="daqref://device0"),
    "daq.nd": _kind("daq:DaqSource", {"channels"}, device="daq.nd://192.168.0.5"),
}
