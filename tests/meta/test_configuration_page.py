"""The page of the configuration is that of the models."""

from __future__ import annotations

from pathlib import Path

from tools.configuration import page

ROOT = Path(__file__).parents[2]


def test_the_page_of_the_configuration_has_the_keys_of_the_models() -> None:
    """If not: `python -m tools.configuration > docs/reference/configuration.md`."""
    assert (ROOT / "docs" / "reference" / "configuration.md").read_text("utf-8") == page()
