"""A person reads words, not symbols: every quantity of every model has them in every language."""

from __future__ import annotations

import re

import pytest

from livebode.core import Event, UsageError
from livebode.fitting import model_named
from livebode.fitting.models import MODELS
from livebode.language import available, in_language, quantity_name
from livebode.monitoring.sentences import _phrase

SYMBOL = re.compile(r"[A-Za-z]{1,2}\d?|Keff|.*_.*")


def quantities() -> set[str]:
    models = [model_named(name, **more) for name in MODELS for more in ({}, {"radius_m": 0.02}) if _takes(name, more)]
    return {name for model in models for name in (*model.names, *model.derived_names)}


def _takes(name: str, more: dict[str, float]) -> bool:
    try:
        model_named(name, **more)
    except UsageError:  # without a pulley
        return False
    return True


@pytest.mark.parametrize("language", available())
def test_every_quantity_of_a_model_has_words(language: str) -> None:
    assert {"Keff", "JL", "mL", "resonance_damping", "delay"} <= quantities()
    with in_language(language):
        words = {name: quantity_name(name) for name in quantities()}
    assert [(name, text) for name, text in words.items() if SYMBOL.fullmatch(text)] == []


def test_an_alarm_of_a_parameter_has_its_words_and_the_record_its_symbol() -> None:
    item = {"name": "Keff", "of": "value", "unit": "%", "amount": -2.0, "bound": 0.1}
    message = _phrase(item)
    assert message == "belt stiffness -2.0 ± 0.1 %"
    assert Event("change", 1, 1.0, message, item).details["name"] == "Keff"
