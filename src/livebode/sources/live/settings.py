"""The keys of [source] that live sources take, as plain data."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from livebode.nouns import Channel, InputError
from livebode.sources.live.address import Address
from livebode.sources.units import split_unit

File = Annotated[Path, Field(strict=False)]
FRAMES = {"rate_hz", "reorder_batches"}
TLS = {"ca_file", "certificate_file", "key_file"}
LOGIN = {"username", "password_env", "password_file"}
TAKEN: dict[str, set[str]] = {
    "udp": FRAMES,
    "tcp": FRAMES,
    "stdin": {"rate_hz"},
    "mqtt": FRAMES | LOGIN | {"client_id"},
    "mqtts": FRAMES | LOGIN | TLS | {"client_id"},
    "opc.tcp": {"rate_hz", "nodes", "sample_node", "security", "server_certificate_file"} | LOGIN | TLS - {"ca_file"},
    "ads": {"rate_hz", "symbol", "channels", "mode", "net_id", "ams_port", "local_net_id", "poll_s"},
}
"""Which keys each kind of URL takes, beside `url` and `timeout_s`."""


class LiveSettings(BaseModel):
    """[source] with a `url`, or with a `log` that grows. docs/live.md says which keys belong to which source."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    url: str | None = None
    follow: bool = False
    rate_hz: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    timeout_s: Annotated[float, Field(gt=0, le=1e6)] = 30.0
    reorder_batches: Annotated[int, Field(ge=0, le=256)] = 8
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
    mode: Literal["ring", "notify"] = "ring"
    net_id: str | None = None
    local_net_id: str | None = None
    ams_port: Annotated[int, Field(ge=1, le=65535)] = 851
    poll_s: Annotated[float, Field(gt=0, le=10)] = 0.05


def check_keys(settings: LiveSettings, address: Address) -> None:
    """InputError for a key that means nothing for this kind of source."""
    given = settings.model_fields_set & set(LiveSettings.model_fields) - {"url", "timeout_s", "follow"}
    if stray := sorted(given - TAKEN[address.scheme]):
        known = ", ".join(sorted(TAKEN[address.scheme]))
        raise InputError(f"source.{stray[0]} means nothing for {address.scheme}; it takes {known}")
    if settings.follow:
        raise InputError("source.follow is for a log that grows; leave it out beside a url")


def named_channels(headings: list[str]) -> tuple[Channel, ...]:
    """Channels from their names, each with its unit in brackets.

    >>> named_channels(["w [N m]", "y"])
    (Channel(name='w', unit='N m'), Channel(name='y', unit=''))
    """
    return tuple(Channel(*split_unit(heading)) for heading in headings)
