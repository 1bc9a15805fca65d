"""DeferredModel: a model of pydantic that is built when it is first used, by one thread at a time."""

from __future__ import annotations

import threading
from typing import Any

from pydantic import BaseModel, ConfigDict

# One for all models: a model that is built reads those that it contains.
_building = threading.RLock()


class DeferredModel(BaseModel):
    """A model whose validator and serializer are made at its first use: most commands use few of the models.

    Axes and requests of the dashboard are threads. Before 2.14, pydantic does not protect a first use in several of
    them: a thread can get the serializer of the parent of the model.
    """

    model_config = ConfigDict(defer_build=True)

    @classmethod
    def model_rebuild(cls, *, _parent_namespace_depth: int = 2, **options: Any) -> bool | None:
        """Build the model; a thread that comes second waits and finds it complete."""
        with _building:
            return super().model_rebuild(_parent_namespace_depth=_parent_namespace_depth + 1, **options)
