"""PlantKinds: which quantities the output and the input of a plant are."""

from __future__ import annotations

from dataclasses import dataclass

from livebode.core._block import Channel
from livebode.core._unit_reading import QuantityKind, split_plant_unit


@dataclass(frozen=True)
class PlantKinds:
    """Kinds of the output and of the input of a measured plant.

    Attributes
    ----------
    output, input
        None where the source reports no unit, and the configuration declares no kind.
    input_factor, output_factor
        SI units (rad for angles) in one unit of the input and of the output; 1 where the unit is not recognised.

    Examples
    --------
    >>> PlantKinds.of(Channel("speed", "rpm"), Channel("torque", "N m"))
    PlantKinds(output='velocity', input='torque', input_factor=1.0, output_factor=0.10471975511965977)
    """

    output: QuantityKind | None = None
    input: QuantityKind | None = None
    input_factor: float = 1.0
    output_factor: float = 1.0

    @property
    def si(self) -> bool:
        """Whether both are in SI units, or in units that are not recognised."""
        return self.input_factor == self.output_factor == 1.0

    @classmethod
    def of(cls, output: Channel, input: Channel) -> PlantKinds:
        """The kinds of two channels."""
        return cls(output.stated_kind, input.stated_kind, input.factor, output.factor)

    @classmethod
    def of_unit(cls, unit: str) -> PlantKinds:
        """The kinds that the unit of a response shows, for a run that did not record them.

        >>> PlantKinds.of_unit("rad/(A)").output, PlantKinds.of_unit("").output
        ('position', None)
        """
        output, input = split_plant_unit(unit)
        return cls.of(Channel("y", output or unit), Channel("u", input or unit))
