"""What is wrong in a configuration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class ConfigError(LivebodeError):
    """A configuration (axis.toml, experiment.toml) cannot be read, or has a key or value that cannot be used."""

    area: ClassVar[str] = "config"
    codes: ClassVar[Mapping[str, str]] = {
        "address-invalid": "The address to listen on is not an IP address.",
        "certificate-unusable": "The certificate and the key do not belong together, or cannot be read.",
        "file-missing": "A file that the configuration names does not exist.",
        "file-open-to-others": "A file with a secret can be read or changed by other users of the computer.",
        "key-missing": "A key is needed and not given.",
        "open-without-tls": "The dashboard is to be open to other computers, but has no TLS.",
        "open-without-token": "The dashboard is to be open to other computers, but has no token.",
        "serve-differs": "The axes of one configuration describe the dashboard differently.",
        "token-weak": "A token is too short, or has letters that a token may not have.",
        "tokens-equal": "Operators and viewers have the same token.",
    }
