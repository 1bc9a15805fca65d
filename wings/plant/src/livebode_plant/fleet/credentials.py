"""Keys of the users of a log: nkeys (Ed25519), whose secret part is in a file of its own and nowhere else."""

from __future__ import annotations

import os
import re
import secrets
import shlex
import stat
from pathlib import Path

from livebode.core import FleetError, not_installed

_SEED = re.compile(rb"SU[A-Z2-7]{56}\s*")
_SEED_BYTES = 32


def write_credentials(path: Path) -> str:
    """Make a key, write its secret part to a new file that only this user may read, and return its public part.

    Raises
    ------
    FleetError
        If the file exists or cannot be written.
    ExtraError
        If nkeys is not installed.
    """
    try:
        import nkeys
    except ImportError:
        raise not_installed("keys of a log need nkeys, which is not installed", "nkeys", "fleet") from None
    seed = nkeys.encode_seed(secrets.token_bytes(_SEED_BYTES), nkeys.PREFIX_BYTE_USER)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
            file.write(seed + b"\n")
    except OSError as error:
        raise FleetError(
            "credentials-unusable",
            f"the key {str(path)!r} cannot be written: {error.strerror or error}",
            "choose another directory, or another name: a key is never replaced",
            path=str(path),
        ) from None
    public: bytes = nkeys.from_seed(bytearray(seed)).public_key
    return public.decode()


def checked_credentials(path: Path) -> str:
    """The path as text, if it is a file with a secret key that other users cannot read.

    Raises
    ------
    FleetError
        Otherwise; the message never has the content.
    """
    try:
        mode, content = stat.S_IMODE(path.stat().st_mode), path.read_bytes()
    except OSError as error:
        raise _unusable(path, f"cannot be read: {error.strerror}", "check its name in log.credentials") from None
    if os.name == "posix" and mode & (stat.S_IRWXG | stat.S_IRWXO):
        command = f"chmod 600 {shlex.quote(str(path))}"
        change = f"run `{command}`, and make another key if others may have read it"
        raise _unusable(path, f"can be used by other users (mode {mode:04o})", change)
    if not _SEED.fullmatch(content):
        raise _unusable(path, "has no secret key of a user", "make one with `livebode fleet setup`")
    return str(path)


def _unusable(path: Path, what: str, change: str) -> FleetError:
    return FleetError("credentials-unusable", f"the key {str(path)!r} {what}", change, path=str(path))
