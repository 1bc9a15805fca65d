"""Certificates of computers, each signed by an authority of the test."""

from __future__ import annotations

from pathlib import Path

import trustme


def certified(folder: Path, authority: trustme.CA, kind: trustme.KeyType = trustme.KeyType.ECDSA) -> dict[str, Path]:
    """Certificate, key and authority of a computer as files."""
    folder.mkdir()
    own = authority.issue_cert("127.0.0.1", key_type=kind)
    files = {name: folder / f"{name}.pem" for name in ("certificate", "key", "authority")}
    own.cert_chain_pems[0].write_to_path(files["certificate"])
    own.private_key_pem.write_to_path(files["key"])
    authority.cert_pem.write_to_path(files["authority"])
    return files
