"""Damage in the buffer of an edge: it is named, and every message that it did not hit is sent.

`make damage` does it a thousand times.
"""

from __future__ import annotations

import os
import random
import shutil
from collections import Counter
from pathlib import Path

from livebode_plant.fleet.edge_buffer import EdgeBuffer

TIMES = int(os.environ.get("LIVEBODE_DAMAGE_BUFFER", "60"))
_FILE_BYTES = 30_000
_KINDS = ("flip", "zeros", "cut", "inserted", "removed")
_HEAD_BYTES = 24
"""Of a message in a file: the header of its frame, and its number."""


def _messages(rng: random.Random) -> list[bytes]:
    """Some are longer than a file of the buffer, and some look like frames."""
    sizes = [rng.choice((1, 40, 700, 2000, 5000, 40_000)) for _ in range(120)]
    return [
        number.to_bytes(4, "big") + (b"LB" * size)[: size // 2] + rng.randbytes(size)
        for number, size in enumerate(sizes)
    ]


def _drained(buffer: EdgeBuffer) -> list[bytes]:
    found = []
    while (message := buffer.first()) is not None:
        found.append(message)
        buffer.remove(message)
    return found


def _damage(folder: Path, kind: str, rng: random.Random) -> tuple[Path, range]:
    """Damage a file; returns it, and which of its bytes are not what they were."""
    file = rng.choice(sorted(path for path in folder.iterdir() if path.stat().st_size))
    data = bytearray(file.read_bytes())
    at = rng.randrange(len(data))
    size = rng.randint(1, 6000)
    hit = range(at, min(len(data), at + size))
    if kind == "flip":
        data[at] ^= 1 << rng.randrange(8)
        hit = range(at, at + 1)
    elif kind == "zeros":
        data[hit.start : hit.stop] = bytes(len(hit))
    elif kind == "cut":
        hit = range(at, len(data))
        del data[at:]
    elif kind == "inserted":
        data[at:at] = rng.randbytes(size)
        hit = range(at - 1, at + 1)
    else:
        file.unlink()
        return file, range(len(data))
    file.write_bytes(data)
    return file, hit


def test_damage_is_named_and_costs_the_messages_that_it_hit(tmp_path: Path) -> None:
    rng = random.Random(34)
    messages = _messages(rng)
    whole = tmp_path / "whole"
    buffer = EdgeBuffer(whole, 1 << 30, _FILE_BYTES)
    places: dict[str, list[tuple[range, bytes]]] = {}
    for message in messages:
        buffer.append(message)
        newest = buffer._files[-1]
        place = range(newest.size_bytes - len(message) - _HEAD_BYTES, newest.size_bytes)
        places.setdefault(newest.name, []).append((place, message))
    buffer.close()
    counts: Counter[tuple[str, str]] = Counter()
    for number in range(TIMES):
        kind = _KINDS[number % len(_KINDS)]
        damaged = tmp_path / "damaged"
        shutil.copytree(whole, damaged)
        file, hit = _damage(damaged, kind, rng)
        lost = {
            message
            for place, message in places[file.name]
            if max(place.start, hit.start) < min(place.stop, hit.stop)
            and (kind != "inserted" or place.start < hit.stop - 1 < place.stop)
        }
        after = EdgeBuffer(damaged, 1 << 30, _FILE_BYTES)
        after.append(b"new")
        found = _drained(after)
        assert found == [message for message in messages if message not in lost] + [b"new"], (kind, file.name, hit)
        # The end of the newest file, cut between two messages, is the end of a buffer that was killed earlier.
        last = file.name == max(places)
        at_an_end = kind == "removed" or (
            kind == "cut" and hit.start in {place.start for place, _ in places[file.name]}
        )
        first = kind == "removed" and file.name == min(places)
        assert after.damaged or (last and at_an_end) or first, (kind, file.name, hit)
        counts[kind, "named" if after.damaged else "as before"] += 1
        after.close()
        shutil.rmtree(damaged)
    print(f"{TIMES} times damage in the buffer of an edge: all else was sent; {dict(counts)}")
