"""S3 on this computer: moto's server on a free port of loopback, with credentials in the environment."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from urllib.request import Request, urlopen

import pytest

BUCKET = "hall"
CREDENTIALS = {
    "AWS_ACCESS_KEY_ID": "user",
    "AWS_SECRET_ACCESS_KEY": "not-a-secret",
    "AWS_DEFAULT_REGION": "us-east-1",
    "AWS_MAX_ATTEMPTS": "1",
    "AWS_EC2_METADATA_DISABLED": "true",
}


@contextmanager
def object_storage() -> Iterator[str]:
    """The address of a server with an empty bucket; the environment leads S3 URLs to it."""
    from moto.moto_server.werkzeug_app import DomainDispatcherApplication
    from moto.server import ThreadedMotoServer

    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    server = ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    # An object that is replaced is closed, even while another thread answers with it: storage has each object whole.
    answer, one = DomainDispatcherApplication.__call__, threading.Lock()

    def alone(*arguments: Any) -> Any:
        with one:
            return answer(*arguments)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(DomainDispatcherApplication, "__call__", alone)
        server.start()
        host, port = server.get_host_and_port()
        yield from _with_bucket(server, f"http://{host}:{port}")


def _with_bucket(server: Any, url: str) -> Iterator[str]:
    with at_address(url) as address:
        try:
            import s3fs

            urlopen(Request(f"{address}/moto-api/reset", method="POST")).close()  # its buckets are of the process
            s3fs.S3FileSystem().mkdir(BUCKET)
            yield address
        finally:
            server.stop()


@contextmanager
def at_address(address: str, **more: str) -> Iterator[str]:
    """The environment that leads S3 URLs to this address; connections of before are forgotten."""
    import s3fs

    with pytest.MonkeyPatch.context() as patch:
        for name, value in (CREDENTIALS | {"AWS_ENDPOINT_URL": address} | more).items():
            patch.setenv(name, value)
        s3fs.S3FileSystem.clear_instance_cache()
        try:
            yield address
        finally:
            s3fs.S3FileSystem.clear_instance_cache()
