"""What an experiment's file has wrong is refused with its key, and the nearest one that exists."""

import pytest

from livebode.core import ConfigError
from livebode_design import Experiment
from tests.support.errors import refused


def read(data):
    asked = Experiment.of(data, "here")
    asked.machine(), asked.machine_limits(), asked.signal_names()


@pytest.mark.parametrize(
    ("data", "code", "facts"),
    [
        ({}, "key-missing", {"key": "belt"}),
        ({"belt": {}, "measured": {"run": "x"}}, "key-conflict", {"key": "belt"}),
        ({"measured": {"run": "x", "noise": True}}, "value-invalid", {"key": "measured.noise", "value": "True"}),
        ({"measured": {"run": "x", "torque_n_m": [True, 1]}}, "value-invalid", {"key": "measured.torque_n_m.0"}),
        ({"belt": {}, "loop": {}}, "key-conflict", {"key": "loop"}),
        ({"measured": {"run": "x"}, "loop": {"velocity": {"foo": 1}}}, "key-unknown", {"key": "loop.velocity.foo"}),
        ({"belt": {}, "signals": {"input": "w"}}, "key-conflict", {"key": "signals.excitation", "value": "w"}),
        ({"belt": {}, "signals": {"output": "a\x7fb"}}, "value-invalid", {"key": "signals.output"}),
        ({"measured": {"noise": 1.0}}, "key-missing", {"key": "measured.run"}),
        ({"belt": {"mechanic": {}}}, "key-unknown", {"key": "belt.mechanic"}),
        ({"belt": {"mechanics": {"load": 3}}}, "key-unknown", {"key": "belt.mechanics.load"}),
        ({"belt": {"mechanics": {"load_kg": "much"}}}, "value-invalid", {"key": "belt.mechanics.load_kg"}),
        ({"belt": {"strokes": {}, "standstill": {}}}, "key-conflict", {"key": "belt.standstill"}),
        ({"belt": {}, "limit": {}}, "key-unknown", {"key": "limit"}),
        ({"belt": {}, "signals": {"exitation": "w"}}, "key-unknown", {"key": "signals.exitation"}),
    ],
)
def test_a_key_or_value_that_cannot_be_used_is_refused(data, code, facts):
    with refused(ConfigError, code, **facts):
        read({"excitation": {}} | data)


@pytest.mark.parametrize(
    ("data", "remedy"),
    [
        ({"belt": {"mechanic": {}}}, "did you mean 'mechanics'?"),
        ({"belt": {"mechanics": {"load": 3}}}, "did you mean 'load_kg'?"),
        ({"belt": {}, "limit": {}}, "did you mean 'limits'?"),
    ],
)
def test_the_nearest_key_is_proposed(data, remedy):
    with pytest.raises(ConfigError) as caught:
        read({"excitation": {}} | data)
    assert caught.value.remedy.startswith(f"{remedy} Settings: ")
