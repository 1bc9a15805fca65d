"""The options of a storage for Delta tables, which have their own access to S3."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from livebode.locations import Location

_KEYS = {
    "key": "aws_access_key_id",
    "secret": "aws_secret_access_key",
    "token": "aws_session_token",
    "endpoint_url": "aws_endpoint_url",
    "anon": "aws_skip_signature",
}
_ENDPOINTS = ("AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL")


def delta_options(place: Location) -> dict[str, str]:
    """What deltalake needs as ``storage_options`` besides the variables ``AWS_…``, which it reads itself.

    They are from the configuration of fsspec, so that one place describes a storage; none for a path. Plain http is
    allowed where the configured endpoint has it.
    """
    if isinstance(place, Path) or place.scheme not in ("s3", "s3a"):
        return {}
    from fsspec.config import conf

    own: dict[str, Any] = {**conf.get("s3", {})}
    client = own.get("client_kwargs") or {}
    options = {_KEYS[name]: str(value) for name, value in {**client, **own}.items() if name in _KEYS and value}
    if region := client.get("region_name"):
        options["aws_region"] = str(region)
    endpoint = options.get("aws_endpoint_url") or next(
        (os.environ[name] for name in _ENDPOINTS if name in os.environ), ""
    )
    if endpoint.startswith("http://"):
        options |= {"aws_endpoint_url": endpoint, "aws_allow_http": "true"}
    return options
