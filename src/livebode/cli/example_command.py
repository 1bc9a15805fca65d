"""`livebode example`: recordings to try livebode on, from simulated axes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from livebode.cli.next_step import NextCommand
from livebode.cli.options import Json
from livebode.cli.shell import command_line
from livebode.core import UsageError

_ALL = "all"


def example_command(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Which one, or all. Without a name: list them.")
    ] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Directory to write to.")] = Path("example"),
    force: Annotated[bool, typer.Option("--force", help="Replace files that differ.")] = False,
    as_json: Json = False,
) -> NextCommand | None:
    """Write recordings of simulated axes and their configurations, which the documentation uses; or list them."""
    from livebode.interface import write_examples
    from livebode.plugins import named
    from livebode.records import to_json

    examples = named("examples")
    if name is None:
        if as_json:
            print(to_json({name: {"about": e.about, "files": e.files} for name, e in examples.items()}))
            return None
        for each, example in examples.items():
            print(f"{each:<12} {example.about}: {', '.join(example.files)}")
        print("\nlivebode example NAME writes one of them to the directory example; all: every one.")
        return NextCommand("example", "standstill")
    if name not in (*examples, _ALL):
        raise UsageError(
            "not-one-of",
            f"{name!r} is not one of the examples",
            f"choose {', '.join(examples)} or {_ALL}",
            argument="name",
            value=name,
            allowed=[*examples, _ALL],
        )
    names = [one for one, example in examples.items() if example.usable] if name == _ALL else [name]
    files = write_examples(names, out, force=force)
    if as_json:
        print(to_json({"directory": str(out), "files": [str(path) for path in files]}))
        return None
    for path in files:
        print(path)
    if left_out := [one for one in examples if name == _ALL and one not in names]:
        print(f"left out, because an optional package is missing: {', '.join(left_out)}")
    print("\nTry:" if name != _ALL else "\nTry, for example:")
    if out.resolve() != Path.cwd():
        print(f"  {command_line('cd', str(out))}")
    for command in examples["standstill" if name == _ALL else name].commands:
        print(f"  {command}")
    return None
