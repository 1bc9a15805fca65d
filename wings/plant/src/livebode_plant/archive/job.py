"""Job: what all recordings of an archive have in common."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from livebode.configuration import Axis, recipe_id
from livebode.core import ConfigError
from livebode_plant.archive.template import Template

_DIGITS = 16


@dataclass(frozen=True)
class Job:
    """What all recordings of an archive have in common.

    Attributes
    ----------
    recipes
        The axes that are tracked of each recording, by the id of their recipe.
    lake
        URL of the lake.
    memory_bytes
        Memory that tracking one recording may use.
    baselines
        Path of the baseline of each machine, with its levels in braces; None: no comparison.
    known
        The first 16 digits of contents that have all results already, of those that a new recording may have.
    """

    recipes: Mapping[str, Axis]
    lake: str
    memory_bytes: int
    baselines: str | None = None
    known: frozenset[str] = frozenset()

    @classmethod
    def of(cls, axes: Mapping[str, Axis], lake: str, memory_bytes: int, baselines: str | None = None) -> Job:
        """The job of a recipe's axes.

        Raises
        ------
        ConfigError
            If two axes have the same settings: their results would have one name.
        RecordingError
            If a file of the recipe cannot be read.
        """
        named: dict[str, str] = {}
        for name, axis in axes.items():
            same = named.setdefault(recipe_id(axis), name)
            if same != name:
                raise ConfigError(
                    "key-conflict",
                    f"the axes {same} and {name} of the recipe have the same settings, so their results are the same",
                    "remove one of them, or give it its own channels",
                    key="axes",
                    names=[same, name],
                )
        return cls({recipe: axes[name] for recipe, name in named.items()}, lake, memory_bytes, baselines)

    def knows(self, content: str) -> bool:
        """Whether a content has all results already."""
        return content[:_DIGITS] in self.known

    def machine(self, recipe: str) -> dict[str, str]:
        """Levels of the machine of a recipe, for recordings whose place names none."""
        machine = self.recipes[recipe].machine if recipe in self.recipes else None
        return machine.levels if machine else {}

    def axis_for(self, recipe: str, path: Path, levels: Mapping[str, str | None]) -> Axis:
        """The recipe for the recording in this file, compared with the baseline of its machine if there is one."""
        axis = self.recipes[recipe]
        axis = axis.model_copy(update={"source": axis.source.model_copy(update={"log": path})})
        file = None if self.baselines is None else Template(self.baselines).filled(levels)
        if file is None or not Path(file).exists():
            return axis
        return axis.model_copy(update={"monitoring": axis.monitoring.model_copy(update={"baseline": Path(file)})})

    @property
    def common_machine(self) -> dict[str, str]:
        """The levels that all recipes have in common."""
        each = [set(self.machine(recipe).items()) for recipe in self.recipes]
        return dict(sorted(set.intersection(*each)))


def short(content: str) -> str:
    """The digits of a content in `Job.known`."""
    return content[:_DIGITS]
