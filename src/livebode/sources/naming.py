"""Which column a name means, and which columns belong together."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from livebode.core import RecordingError, nearest_name
from livebode.sources.expressions import Expression, ExpressionSyntaxError, parse_expression
from livebode.sources.recording import Column, Recording, Skipped
from livebode.sources.units import split_unit

_WORD = re.compile(r"[\w.]+")  # without anything that computes


def resolve(name: str, columns: Sequence[Column], everything: Sequence[Column]) -> Column:
    """The column with this name: exactly, else by alias, else as a path without a single (1)."""
    found = [column for column in columns if column.name == name and not column.temporal]
    found = found or [column for column in columns if name in column.aliases and not column.temporal]
    plain = name.replace("(1).", ".")
    found = found or [column for column in columns if plain in plain_paths(column) and not column.temporal]
    if len(found) == 1:
        return found[0]
    if found:
        paths = [column.name for column in found[:5]]
        raise RecordingError(
            "channel-ambiguous",
            f"channel {name!r} means more than one: {', '.join(paths)}",
            "use the path of one of them",
            channel=name,
            channels=paths,
        )
    for column in everything:
        if column.name == name and not column.temporal:
            if column.group != columns[0].group:
                raise RecordingError(
                    "clocks-differ",
                    f"channel {name!r} is sampled by the clock of {column.group!r}, the others by {columns[0].group!r}",
                    "open it separately",
                    channel=name,
                    groups=[column.group, columns[0].group],
                )
            raise RecordingError(
                "lengths-differ",
                f"channel {name!r} has {column.samples} samples, the others {columns[0].samples}",
                "open it separately",
                channel=name,
                samples=[column.samples, columns[0].samples],
            )
    names = [column.name for column in columns if not column.temporal]
    raise RecordingError(
        "channel-unknown", f"there is no channel {name!r}", nearest_name(name, names), channel=name, channels=names
    )


@contextmanager
def explained(skipped: Sequence[Skipped]) -> Iterator[None]:
    """Errors of unknown channels inside it say why the channel was left out, where it is in the file."""
    try:
        yield
    except RecordingError as error:
        name = str(error.facts.get("channel", ""))
        reasons = [one.reason for one in skipped if one.name in (name, split_unit(name)[0])]
        if error.code != "recording.channel-unknown" or not reasons:
            raise
        message = f"channel {name!r} was left out: {reasons[0]}"
        raise RecordingError("channel-unknown", message, "name a channel of numbers", **error.facts) from None


def found_channel(name: str, columns: Sequence[Column], everything: Sequence[Column]) -> Column | Expression:
    """The column with this name; if there is none, the expression of this text, whose channels exist."""
    try:
        return resolve(name, columns, everything)
    except RecordingError as error:
        if error.code != "recording.channel-unknown" or _WORD.fullmatch(name):
            raise
        unknown = error
    try:
        expression = parse_expression(name)
    except ExpressionSyntaxError as why:
        message = f"{unknown.message}, and it is not an expression of channels: {why}"
        raise RecordingError("channel-unknown", message, unknown.remedy, **unknown.facts) from None
    for part in expression.names:
        try:
            resolve(part, columns, everything)
        except RecordingError as error:
            raise error.at(f"expression {name!r}") from None
    return expression


def in_file(names: Sequence[str], columns: Sequence[Column]) -> list[str]:
    """The names of the columns that are read for these channels: those in an expression instead of the expression."""
    found = {name: found_channel(name, columns, columns) for name in names}
    return [part for name, one in found.items() for part in (one.names if isinstance(one, Expression) else [name])]


def plain_paths(column: Column) -> list[str]:
    return [name.replace("(1).", ".") for name in (column.name, *column.aliases)]


def together(recording: Recording, channels: Sequence[str] | None, time: str | None) -> list[Column]:
    """The columns of one group and length: of `channels`, of the time column, or with most of the file's values."""
    everything = recording.columns
    if channels:
        named = {name: resolve(name, everything, everything) for name in in_file(channels, everything)}
        names, asked = list(named), list(named.values())
        check_groups(names, asked)
        if len({column.samples for column in asked}) > 1:
            lengths = ", ".join(f"{name!r} {column.samples}" for name, column in zip(names, asked))
            raise RecordingError(
                "lengths-differ",
                f"the channels have different numbers of samples ({lengths})",
                "name channels of one length",
                path=str(recording.path),
                argument="channels",
                samples=[column.samples for column in asked],
            )
        group, length = asked[0].group, asked[0].samples
    elif timed := [
        column for column in everything if column.group and column.name in (time, split_unit(time or "")[0])
    ]:
        group, length = timed[0].group, timed[0].samples
    else:
        values: Counter[tuple[str, int | None]] = Counter()
        for column in everything:
            values[column.group, column.samples] += 1 if column.samples is None else column.samples
        group, length = max(values, key=lambda shared: values[shared], default=("", 0))
    if length is not None and length < 2:
        raise RecordingError(
            "channel-missing",
            f"{recording.path} has no channel of at least 2 samples{reasons(recording)}",
            "check that the recording is complete",
            path=str(recording.path),
        )
    return [column for column in everything if (column.group, column.samples) == (group, length)]


def check_groups(names: Sequence[str], columns: Sequence[Column]) -> None:
    """RecordingError if the columns do not share their clock."""
    groups = [column.group for column in columns]
    if len(set(groups)) > 1:
        listed = ", ".join(f"{name!r} in {group!r}" for name, group in zip(names, groups))
        raise RecordingError(
            "clocks-differ",
            f"the channels are sampled by different clocks ({listed})",
            "name channels of one group",
            argument="channels",
            groups=groups,
        )


def reasons(recording: Recording) -> str:
    """What was skipped, for the error that no channel remains."""
    listed = [f"{skipped.name!r}: {skipped.reason}" for skipped in recording.skipped[:3]]
    return f" ({'; '.join(listed)})" if listed else ""
