"""JSON Schema of experiment.toml, for editors; see `livebode.configuration.schema`."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Annotated, Any, get_type_hints

from annotated_types import MinLen
from pydantic import BaseModel, ConfigDict, create_model

from livebode.configuration import Schema, schema_of
from livebode_design.experiment import BELT, SIGNALS, Experiment
from livebode_design.limits import MachineLimits
from livebode_design.matrix.machine import MatrixLimits
from livebode_design.matrix.matrix_experiment import MACHINES, Drives, MatrixExperiment
from livebode_design.matrix.spec import MatrixSpec
from livebode_design.spec import KIND_OF_KEY, ExperimentSpec

_CONFIG = ConfigDict(extra="forbid")


def experiment_schema() -> Schema:
    """Schema of experiment.toml."""
    tables: Any = {name: (_table(kind) | None, None) for name, kind in BELT.items()}
    roles: Any = dict.fromkeys((*SIGNALS, "schedule"), (Annotated[str, MinLen(1)] | None, None))
    limits: Any = (_table(MachineLimits) | None, None)
    model: Any = create_model(
        "ExperimentFile",
        __base__=Experiment,
        __doc__=Experiment.__doc__,
        excitation=(_table(ExperimentSpec), ...),
        belt=(create_model("Belt", __config__=_CONFIG, __doc__=_BELT_DOC, **tables) | None, None),
        limits=limits,
        signals=(create_model("Signals", __config__=_CONFIG, __doc__=_SIGNALS_DOC, **roles) | None, None),
    )
    schema = schema_of(model, "experiment")
    schema["$defs"]["Belt"]["not"] = {"required": ["strokes", "standstill"]}
    schema["$defs"]["ExperimentSpec"]["allOf"] = [
        {"if": {"required": [key]}, "then": {"required": ["kind"], "properties": {"kind": {"const": kind}}}}
        for key, kind in KIND_OF_KEY.items()
    ]
    return schema | {
        "oneOf": [{"required": ["belt"]}, {"required": ["measured"]}],
        "not": {"required": ["belt", "loop"]},
    }


def matrix_experiment_schema() -> Schema:
    """Schema of an experiment.toml for a machine with several motors."""
    described: Any = {name: (_table(kind) | None, None) for name, (kind, _, _) in MACHINES.items()}
    described |= {"limits": (_table(MatrixLimits) | None, None), "drives": (_table(Drives) | None, None)}
    model: Any = create_model(
        "MatrixExperimentFile",
        __base__=MatrixExperiment,
        __doc__=MatrixExperiment.__doc__,
        excitation=(_table(MatrixSpec), ...),
        **described,
    )
    return schema_of(model, "matrix-experiment") | {
        "oneOf": [
            *({"required": [name, "drives"]} for name in MACHINES),
            {"required": ["measured_matrix"], "not": {"required": ["drives"]}},
        ]
    }


def _table(kind: Any) -> type[BaseModel]:
    """The table of a dataclass as a model."""
    hints = get_type_hints(kind, include_extras=True)
    keys: Any = {
        field.name: (hints[field.name], ... if field.default is MISSING else field.default) for field in fields(kind)
    }
    return create_model(kind.__name__, __config__=_CONFIG, __doc__=kind.__doc__, **keys)


_BELT_DOC = """[belt]: a tooth-belt axis by its constants; the defaults are those of Table I of Nevaranta 2016.

Parameters
----------
mechanics
    Masses, belt and pulleys.
friction
    Friction of the motor's shaft and of the cart.
drive
    The controllers and their rates, and the motor's torque.
sensor
    Sensor of angle and velocity.
limits
    Limits of the machine.
strokes
    The motion: forward and return strokes between two positions.
standstill
    Instead of strokes: the cart is held at one position.
"""
_SIGNALS_DOC = """[signals]: names of the channels in axis.toml.

Parameters
----------
excitation
    Channel w, the excitation.
input
    Channel u, the torque.
output
    Channel y, the response of the machine.
schedule
    Channel over which responses are shown, such as the position.
"""
