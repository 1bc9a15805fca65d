"""EncryptedClient: a connection to nats-server that never goes on without TLS."""

from __future__ import annotations

import logging

from nats.aio.client import Client
from nats.errors import SecureConnRequiredError

# Python 3.11 says this at the end of every connection that was begun in plain text.
logging.getLogger("asyncio").addFilter(lambda record: "eof_received() has no effect" not in record.getMessage())


class EncryptedClient(Client):
    """A client like its base, but a server that does not offer TLS is refused.

    The base encrypts if the server's greeting, which is plain text, demands it: whoever is between the two could
    remove that from the greeting, at any reconnection, and read the data.
    """

    def _connect_command(self) -> bytes:
        if not self._server_info.get("tls_required"):
            raise SecureConnRequiredError
        return super()._connect_command()
