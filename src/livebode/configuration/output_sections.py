"""Sections of axis.toml on where a run is shown and recorded."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from livebode.configuration.section import ConfigurationSection, File, Language
from livebode.core import Field

BUDGET_BYTES_MIN = 16 << 20


class RecordSection(ConfigurationSection):
    """[record]: the run is recorded in segments that survive a kill, also if the section is empty.

    Parameters
    ----------
    samples
        Also record the raw samples of the channels in use.
    budget_bytes
        Maximum size of the record in bytes: the oldest segments are removed, events never. Default: no limit.
    segment_s
        Machine time in one segment, in seconds.
    """

    samples: bool = False
    budget_bytes: Annotated[int, Field(ge=BUDGET_BYTES_MIN)] | None = None
    segment_s: Annotated[float, Field(gt=0, le=86400)] = 300.0


class ServeSection(ConfigurationSection):
    """[serve]: address of the dashboard (`livebode run --serve`), and access to it.

    Parameters
    ----------
    address
        Address to listen on. Any other than the loopback needs a token and TLS.
    port
        TCP port; 0 selects a free port. `--port` overrides it.
    names
        Host names by which a browser may open the page, in addition to IP addresses and localhost.
    token_env
        Environment variable with the token of users who may acknowledge.
    token_file
        File with the token of users who may acknowledge, relative to this file.
    viewer_token_env
        Environment variable with the token of users who may only view.
    viewer_token_file
        File with the token of users who may only view, relative to this file.
    certificate_file
        Certificate for TLS in PEM, relative to this file.
    key_file
        Private key for TLS in PEM, relative to this file.
    read_only
        Nobody may acknowledge.
    language
        Language of the page; the choice of a user overrides it. Default: that of the browser.
    """

    address: str = "127.0.0.1"
    port: Annotated[int, Field(ge=0, le=65535)] = 8765
    names: list[str] = []
    token_env: str | None = None
    token_file: File | None = None
    viewer_token_env: str | None = None
    viewer_token_file: File | None = None
    certificate_file: File | None = None
    key_file: File | None = None
    read_only: bool = False
    language: Language | None = None

    def beside(self, folder: Path) -> ServeSection:
        """With files relative to a folder."""
        files = {name: path for name, path in self if name.endswith("_file") and path is not None}
        return self.model_copy(update={name: folder / path for name, path in files.items()})
