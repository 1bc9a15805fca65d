"""What is wrong in a configuration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from livebode.core.errors.base import LivebodeError


class ConfigError(LivebodeError):
    """A configuration (axis.toml, experiment.toml) cannot be read, or has a key or value that cannot be used.

    Examples
    --------
    >>> import livebode
    >>> try:
    ...     livebode.design("missing.toml")
    ... except livebode.ConfigError as error:
    ...     print(error.code)
    config.file-unreadable
    """

    area: ClassVar[str] = "config"
    codes: ClassVar[Mapping[str, str]] = {
        "auto-needs-recording": 'Lines or window are "auto", but there is no excitation or recording to find them in.',
        "axes-invalid": "The table [axes] is not a table of axes, or has too many of them.",
        "axis-name-invalid": "An axis has a name that cannot be the name of its directory.",
        "change-needs-restart": "A changed key cannot be applied while the axis runs.",
        "change-too-early": "A changed configuration cannot be checked before the live source has sent samples.",
        "cluster-open": "A cluster is reached over a network without mutual TLS.",
        "file-open-to-others": "A file with a secret can be read or changed by other users of the computer.",
        "file-too-long": "The file is longer than a configuration may be.",
        "file-unreadable": "A configuration, or a file that it names, does not exist or cannot be read.",
        "file-unusable": "A file that the configuration names has other content than it needs.",
        "incomplete": "A key needs another one that is missing.",
        "key-conflict": "Two keys contradict each other, or exclude each other.",
        "key-missing": "A required key is missing.",
        "key-unknown": "There is no such key.",
        "key-unused": "A key has no meaning for this kind of source.",
        "kind-needed": "A model needs the kind of a channel, which its unit does not show and no key declares.",
        "log-open": "The log of a fleet is reached over a network without TLS.",
        "needs-even-samples": "A key needs samples at regular times, and the channels have clocks of their own.",
        "needs-samples": "A key needs samples, and the drive sends spectra.",
        "nested-too-deeply": "Values are nested deeper than any configuration has them.",
        "not-text": "The file is not text.",
        "not-toml": "The text is not TOML.",
        "open-without-tls": "The dashboard is to be open to other computers, but has no TLS.",
        "open-without-token": "The dashboard is to be open to other computers, but has no token.",
        "rate-mismatch": "A rate contradicts the rate of the samples or another key.",
        "secret-in-url": "A URL contains a user or password, which would be recorded.",
        "secret-missing": "The environment variable that holds a secret is not set.",
        "token-weak": "A token is too short, or has letters that a token may not have.",
        "tokens-equal": "Operators and viewers have the same token.",
        "unit-not-si": "The parameters of a model are in SI units, and the output or the input is not.",
        "value-invalid": "The value of a key has the wrong type or form, is out of range or cannot be used.",
        "value-mismatch": "The value of a key differs from what the source, the design or the run has.",
    }
