"""What a receiver of [[publish]] that is a server of livebode shows to the network."""

from __future__ import annotations

from livebode.configuration import PublishSection
from livebode.core import on_loopback
from livebode.plugins import named
from livebode.publishing.secrets import address


def exposure(section: PublishSection) -> str | None:
    """A sentence on who else can read the results or the password; None if nobody can. ConfigError as `address`."""
    if not named("sinks")[section.kind].serves:
        return None
    _, host, port, _ = address(section)
    if on_loopback(host):
        return None
    if section.username is None:
        remedy = "" if section.kind == "prometheus" else "set username and password_file, or "
        return f"whoever reaches {host}:{port} can read the results; {remedy}restrict it by a firewall"
    if section.certificate_file is None:
        return f"the password to {host}:{port} is sent unencrypted; set certificate_file and key_file"
    return None
