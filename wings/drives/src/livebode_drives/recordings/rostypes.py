"""Types of ROS 2 messages, parsed by rosbags from the text in a recording, after a check of what they expand to.

rosbags writes and executes a decoder for each type, with some lines for each element of an array of messages.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Any

from livebode.dataclass import dataclass
from livebode.sources import COLUMNS_MAX, damaged, oversized

ARRAY, SEQUENCE = 3, 4
SEQUENCES = ARRAY, SEQUENCE
DEFINITION_CHARACTERS_MAX = 1 << 20
NAME = re.compile(r"[A-Za-z]\w*(?:/[A-Za-z]\w*)*", re.ASCII)


@dataclass(frozen=True)
class Topic:
    """A topic: its name, the type of its messages, the text that defines the type (or none), and why it is not read."""

    name: str
    type: str
    definition: str = ""
    language: str = ""
    unreadable: str = ""


@lru_cache(maxsize=64)
def store_of(topic: Topic) -> Any:
    """The typestore of rosbags with the type of this topic; where the recording does not define it, of ROS 2 itself."""
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    if not topic.definition:
        return get_typestore(Stores.LATEST)
    if len(topic.definition) > DEFINITION_CHARACTERS_MAX:
        raise oversized(f"the definition of {topic.type!r} is too long", DEFINITION_CHARACTERS_MAX, part=topic.name)
    if topic.language == "ros2msg":
        types = get_types_from_msg(topic.definition, topic.type)
    else:
        types = {}
        for part in re.split(r"^=+\nIDL: .*\n", topic.definition, flags=re.MULTILINE):
            types.update(get_types_from_idl(part) if part.strip() else {})
    check_types(types, topic.type)
    store = get_typestore(Stores.EMPTY)
    store.register(types)
    return store


def unknown_type(topic: Topic) -> str:
    """Why the type of a topic is not known; empty if it is."""
    if topic.definition or topic.type in store_of(topic).fielddefs:
        return ""
    return f"its type {topic.type!r} is neither defined in the file nor by ROS 2"


def check_types(types: Any, name: str) -> None:
    """RecordingError if names are not names, or if the types contain themselves or too much."""
    names = [*types, *(field for constants, fields in types.values() for field, *_ in (*constants, *fields))]
    if wrong := [name for name in names if not NAME.fullmatch(name)]:
        raise damaged(f"its message types have a field {wrong[0][:40]!r}", part=name)
    if name not in types:
        raise damaged(f"message type {name!r} is not defined", part=name)
    width: dict[str, int] = {}
    for message_type in types:
        if fields_of(message_type, types, width, ()) > COLUMNS_MAX:
            raise oversized(
                f"message type {message_type!r} has more than {COLUMNS_MAX} fields", COLUMNS_MAX, part=message_type
            )


def fields_of(name: str, types: Any, width: dict[str, int], within: tuple[str, ...]) -> int:
    """Fields that a type expands to, without expanding it."""
    if name in within or name not in types:
        raise damaged(f"message type {name!r} {'contains itself' if name in within else 'is not defined'}", part=name)
    if name not in width:
        count = 0
        for _, (kind, detail) in types[name][1]:
            (inner, item_type), length = detail if kind in SEQUENCES else ((kind, detail), 1)
            repeated = max(length, 1) if kind == ARRAY and (inner == 2 or item_type[0] == "string") else 1
            count += repeated * (fields_of(item_type, types, width, (*within, name)) if inner == 2 else 1)
        width[name] = count
    return width[name]
