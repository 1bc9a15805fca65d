"""The keys of [source], as plain data, and which of them can be combined."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from livebode.core import Channel, ConfigError
from livebode.sources.units import split_unit

File = Annotated[Path, Field(strict=False)]
FRAMES = {"rate_hz", "reorder_batches"}
TLS = {"ca_file", "certificate_file", "key_file"}
LOGIN = {"username", "password_env", "password_file"}
TAKEN: dict[str, set[str]] = {
    "udp": FRAMES | {"sender"},
    "tcp": FRAMES,
    "stdin": {"rate_hz"},
    "mqtt": FRAMES | LOGIN | {"client_id"},
    "mqtts": FRAMES | LOGIN | TLS | {"client_id"},
    "opc.tcp": {"rate_hz", "nodes", "sample_node", "security", "server_certificate_file"} | LOGIN | TLS - {"ca_file"},
    "ads": {"rate_hz", "symbol", "channels", "mode", "net_id", "ams_port", "local_net_id", "poll_s"},
}
"""Keys of each kind of URL, in addition to `url` and `timeout_s`."""
LOG = {"log", "time", "rate_hz", "follow", "dbc"}


class SourceSettings(BaseModel):
    """[source]: a recording (`log`), one that grows (`follow`), or a machine (`url`); docs/how-to/live.md has its keys.

    Relative paths are relative to the file that contains them.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    log: File | None = None
    time: str | None = None
    dbc: File | None = None
    follow: bool = False
    url: str | None = None
    rate_hz: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    timeout_s: Annotated[float, Field(gt=0, le=1e6)] = 30.0
    reorder_batches: Annotated[int, Field(ge=0, le=256)] = 8
    sender: str | None = None
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

    @property
    def live(self) -> bool:
        """Whether the samples arrive in real time."""
        return self.url is not None or self.follow

    @property
    def title(self) -> str:
        """Name of the source in a picture."""
        return self.log.name if self.log is not None else self.url or ""

    def beside(self, folder: Path) -> SourceSettings:
        """The same with relative paths from `folder`."""
        files = {
            name: folder / value for name in self.model_fields_set if isinstance(value := getattr(self, name), Path)
        }
        return self.model_copy(update=files)


def check_keys(settings: SourceSettings, kind: str) -> None:
    """ConfigError for a key that does not apply to this kind of source: the scheme of a URL, or "log"."""
    taken = LOG if kind == "log" else TAKEN[kind] | {"url"}
    if stray := sorted(settings.model_fields_set - taken - {"timeout_s"}):
        raise ConfigError(
            "key-unused",
            f"source.{stray[0]} does not apply to {kind}",
            f"remove it; the keys of {kind} are {', '.join(sorted(taken))}",
            key=f"source.{stray[0]}",
            source=kind,
            allowed=sorted(taken),
        )


def named_channels(headings: list[str]) -> tuple[Channel, ...]:
    """Channels from their names, each with its unit in brackets.

    >>> named_channels(["w [N m]", "y"])
    (Channel(name='w', unit='N m'), Channel(name='y', unit=''))
    """
    return tuple(Channel(*split_unit(heading)) for heading in headings)
