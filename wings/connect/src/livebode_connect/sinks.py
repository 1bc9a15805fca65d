"""The receivers of this wing: the keys in [[publish]] of each, and the class that sends."""

from __future__ import annotations

from collections.abc import Mapping

from livebode.publishing import SinkKind

_LOGIN = {"username", "password_env", "password_file"}
_TOKEN = {"token_env", "token_file"}
_TLS = {"ca_file", "certificate_file", "key_file"}
_SENDS = {"events", "values", "interval_s"}
_HTTP = {"http": 80, "https": 443}
_MQTT = {"mqtt": 1883, "mqtts": 8883}
_WEBHOOK = _SENDS | _TOKEN | _TLS | {"template", "url_env", "url_file", "secret_env", "secret_file"}
_EMAIL = {"events", "template", "sender", "recipients", "group_s", "ca_file"} | _LOGIN

SINKS: Mapping[str, SinkKind] = {
    "webhook": SinkKind("livebode_connect.webhook:WebhookSink", _HTTP, frozenset(_WEBHOOK), ("alarms",), ()),
    "email": SinkKind(
        "livebode_connect.mail:MailSink", {"smtp": 587, "smtps": 465}, frozenset(_EMAIL), ("alarms",), ()
    ),
    "prometheus": SinkKind(
        "livebode_connect.prometheus:PrometheusSink",
        _HTTP,
        frozenset({"values", "interval_s", "certificate_file", "key_file"}),
        (),
        serves=True,
    ),
    "mqtt": SinkKind("livebode_connect.mqtt:MqttSink", _MQTT, frozenset(_SENDS | _LOGIN | _TLS | {"discovery"})),
    "sparkplug": SinkKind(
        "livebode_connect.sparkplug:SparkplugSink", _MQTT, frozenset({"values", "interval_s"} | _LOGIN | _TLS), ()
    ),
    "syslog": SinkKind(
        "livebode_connect.syslog:SyslogSink",
        {"udp": 514, "tcp": 601, "tls": 6514},
        frozenset({"events", "template", "ca_file"}),
        values=(),
    ),
    "influxdb": SinkKind("livebode_connect.influxdb:InfluxSink", _HTTP, frozenset(_SENDS | _TOKEN | _TLS)),
    "opcua": SinkKind(
        "livebode_connect.opcua:OpcUaSink",
        {"opc.tcp": 4840},
        frozenset(_SENDS | _LOGIN | {"certificate_file", "key_file"}),
        serves=True,
    ),
}
