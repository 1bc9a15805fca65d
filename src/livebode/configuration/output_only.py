"""What an output-only run does not use: it has no response, and no other signal than its outputs."""

from __future__ import annotations

from livebode.core import ConfigError, TypedTable

_USED = {
    "signals": {"outputs", "schedule"},
    "lines": {"window"},
    "tracking": {"hop"},
}
_USED_WHOLE = {"source", "output_only", "serve", "machine"}


def check_output_only(axis: TypedTable) -> None:
    """ConfigError if an axis with [output_only] sets something that only a response has, or has a live source."""
    source: TypedTable = axis.source  # type: ignore[attr-defined]
    if source.live:  # type: ignore[attr-defined]
        raise ConfigError(
            "key-conflict",
            "[output_only] needs a recording, but the source is live",
            "record the outputs, and set source.log",
            key="output_only",
        )
    unused = ["source.skip_periods"] if "skip_periods" in source.model_fields_set else []
    for name in sorted(axis.model_fields_set - _USED_WHOLE):
        section = getattr(axis, name)
        if name in _USED and isinstance(section, TypedTable):
            fields = type(section).model_fields
            unused += [f"{name}.{fields[key].alias or key}" for key in sorted(section.model_fields_set - _USED[name])]
        elif section is not None:
            unused.append(name)
    if unused:
        raise ConfigError(
            "key-conflict",
            f"{unused[0]} belongs to a response, and an output-only run has none",
            "remove it, or remove output_only",
            key=unused[0],
        )
