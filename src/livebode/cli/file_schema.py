"""JSON Schema of the files that livebode reads, for editors: `livebode doctor --schema`."""

from __future__ import annotations

from pathlib import Path

from livebode.core import UsageError


def print_schema(file: str, out: Path | None, *, force: bool, as_json: bool) -> None:
    """Print or write the schema of a file; UsageError if there is none of it."""
    from livebode import export
    from livebode.plugins import loaded, named
    from livebode.records import to_json

    files = named("files")
    if file not in files:
        raise UsageError(
            "not-one-of",
            f"there is no schema of {file!r}",
            f"choose {' or '.join(files)}",
            argument="schema",
            value=file,
            allowed=list(files),
        )
    text = to_json(loaded(files[file].schema)(), indent=2)
    if out is None:
        print(text)
        return
    export.save(out, lambda path: path.write_text(text + "\n", encoding="utf-8"), force=force)
    print(to_json({"file": str(out)}) if as_json else out)
