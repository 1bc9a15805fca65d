"""Address of a live source: the parts of its URL."""

from __future__ import annotations

from urllib.parse import unquote, urlsplit

from livebode.core import ConfigError
from livebode.dataclass import dataclass
from livebode.plugins import named
from livebode.sources.live.settings import SourceKeys, check_keys


@dataclass(frozen=True)
class Address:
    """Kind of source, host, port and path; `path` is the MQTT topic, a device, or a file."""

    scheme: str
    host: str = ""
    port: int = 0
    path: str = ""

    def __str__(self) -> str:
        if not self.host:
            kind = named("sources").get(self.scheme)
            start = f"{self.scheme}:{'//' if '://' in kind.device else ''}" if kind else ""  # else a file or a run
            return f"{start}{self.path}"
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}" + (f"/{self.path}" if self.path else "")


def parse_address(url: str) -> Address:
    """The address in a URL.

    Raises
    ------
    ConfigError
        For a kind that is not supported, an invalid port, or a password in the URL; the password is never shown.

    Examples
    --------
    >>> parse_address("mqtt://broker/plant/axis1")
    Address(scheme='mqtt', host='broker', port=1883, path='plant/axis1')
    >>> str(parse_address("udp://127.0.0.1:5000"))
    'udp://127.0.0.1:5000'
    >>> str(parse_address("serial:///dev/ttyACM0"))
    'serial:/dev/ttyACM0'
    """
    if url in ("stdin:", "stdin://"):
        return Address("stdin")
    if "@" in url:
        raise ConfigError(
            "secret-in-url",
            "source.url has a user or password",
            "remove it, and set source.username and source.password_env or source.password_file",
            key="source.url",
        )
    if not url.isprintable() or len(url) > 2000:
        raise ConfigError(
            "value-invalid",
            "source.url is longer than 2000 characters or has a character that is not printable",
            "give the URL of the machine",
            key="source.url",
        )
    kinds = named("sources")
    scheme, _, path = url.partition(":")
    if scheme in kinds and kinds[scheme].device:
        return _device(scheme, path)
    try:
        parts = urlsplit(url)
        port, host = parts.port, parts.hostname
    except ValueError:
        raise _url_error("is not an address", "give kind://host:port, with a port from 1 to 65535") from None
    if parts.scheme not in kinds:
        raise _url_error("has a scheme that is not supported", f"give one of {', '.join(kinds)}")
    port = port or kinds[parts.scheme].port
    if not host or port is None or "?" in url or "#" in url:
        raise _url_error("is not a complete address", f"give {parts.scheme}://host:port")
    path = unquote(parts.path.removeprefix("/"))
    if path and not kinds[parts.scheme].has_path:
        raise _url_error(f"has a path, but {parts.scheme} has none", "remove what is after the port")
    return Address(parts.scheme, host, port, path)


def checked_address(url: str, settings: SourceKeys) -> Address:
    """The address in the url of these settings; ConfigError if it or a related key is invalid."""
    address = parse_address(url)
    check_keys(settings, address.scheme)
    return address


def _device(scheme: str, path: str) -> Address:
    """The address of a device, in the form of the example of its kind: an absolute path, or a name with its parts."""
    device = named("sources")[scheme].device
    example = device.partition(":")[2]
    if path.startswith("//"):
        path = "/" + path.lstrip("/")
    is_path = example.startswith("/") and not example.startswith("//")
    path = path if is_path else path.lstrip("/")
    if not path.strip("/") or (not is_path and path.strip("/").count("/") < example.strip("/").count("/")):
        raise _url_error("names no device", f"give one such as {device}")
    return Address(scheme, path=path)


def _url_error(wrong: str, remedy: str) -> ConfigError:
    """The error for a URL, without the URL: any part of an invalid one may be a secret."""
    return ConfigError("value-invalid", f"source.url {wrong}", remedy, key="source.url")
