"""[signals]: names of the channels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

from pydantic import AfterValidator, Field

from livebode.configuration.section import ConfigurationSection
from livebode.core import CHANNELS_MAX, ConfigError


def _one_or_several(names: str | list[str]) -> str | list[str]:
    """A list of one is that one."""
    return names[0] if isinstance(names, list) and len(names) == 1 else names


Channels = Annotated[
    str | Annotated[list[str], Field(min_length=1, max_length=CHANNELS_MAX)], AfterValidator(_one_or_several)
]


class SignalsSection(ConfigurationSection):
    """[signals]: names of the channels; in a recording also expressions, such as "-enc1" or "pos + 0.35*angle".

    A list of several channels makes the response a matrix, from all inputs to all outputs.

    Parameters
    ----------
    output
        Channel y, the response of the machine: a velocity or a position. A list of up to 8: the outputs of a matrix.
    input
        Channel u, the input of the plant, such as the torque or the current. Required by the estimators "direct" and
        "joint". A list of up to 8: the inputs of a matrix.
    excitation
        Channel w, the excitation that is added in the loop. Required by the estimators "joint" and "indirect". Of a
        matrix a list with one channel for each input.
    schedule
        Channel over which responses are shown, such as the position.
    ready
        Channel that shows whether the machine is ready (drive on, homed, not stopped): not zero, or see
        monitoring.ready_mask. A missing value is not ready. A response whose window contains a sample that is not
        ready is recorded and shown, but not assessed, and its alarms are suppressed. Of a matrix such a window does not
        count. Default: always ready.
    """

    outputs: Channels = Field(alias="output")
    inputs: Channels | None = Field(default=None, alias="input")
    excitations: Channels | None = Field(default=None, alias="excitation")
    schedule: str | None = None
    ready: str | None = None

    @property
    def output(self) -> str:
        """The output of a single response; ConfigError if there are several."""
        return _only("output", self.outputs)

    @property
    def input(self) -> str | None:
        """The input of a single response; ConfigError if there are several."""
        return None if self.inputs is None else _only("input", self.inputs)

    @property
    def excitation(self) -> str | None:
        """The excitation of a single response; ConfigError if there are several."""
        return None if self.excitations is None else _only("excitation", self.excitations)

    @property
    def is_matrix(self) -> bool:
        """Whether the response is a matrix."""
        return any(isinstance(names, list) for names in (self.outputs, self.inputs, self.excitations))

    def listed(self, role: str) -> list[str]:
        """The channels of "output", "input" or "excitation"; none where they are not named."""
        names = getattr(self, f"{role}s")
        return [names] if isinstance(names, str) else list(names or [])

    @property
    def named(self) -> list[str]:
        """All channels that are named, each once."""
        roles = [name for role in ("output", "input", "excitation") for name in self.listed(role)]
        return list(dict.fromkeys([*roles, *(name for name in (self.schedule, self.ready) if name)]))

    def over(self, names: Mapping[str, str | None]) -> SignalsSection:
        """The same with other channels for some roles."""
        fields = {"output": "outputs", "input": "inputs", "excitation": "excitations"}
        return self.model_copy(update={fields.get(role, role): name for role, name in names.items()})


def _only(role: str, names: str | list[str]) -> str:
    if isinstance(names, str):
        return names
    raise ConfigError(
        "value-invalid",
        f"signals.{role} lists {len(names)} channels, and one is needed here",
        f"name one of {', '.join(names)}",
        key=f"signals.{role}",
        value=list(names),
    )
