"""That something is refused with the error that it should be."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from livebode.core import LivebodeError


@contextmanager
def refused(kind: type[LivebodeError], code: str, **facts: object) -> Iterator[None]:
    """That the block raises this kind of error with this code (without its area) and these facts, in one line."""
    with pytest.raises(kind) as caught:
        yield
    error = caught.value
    assert type(error) is kind, repr(error)
    assert error.code == f"{kind.area}.{code}", f"{error.code}: {error}"
    assert {name: error.facts.get(name) for name in facts} == facts, f"{error.facts}: {error}"
    assert "\n" not in str(error)
