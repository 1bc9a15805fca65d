"""A command with two uses refuses an option of the other one, and says which option switches."""

from __future__ import annotations

import pytest

from tests.support.command import livebode

REFUSED = [
    ("export run --csv", "--csv belongs to --sql; give --sql QUERY too"),
    ("export run --to csv --rows 3", "--rows belongs to --sql; give --sql QUERY too"),
    ("export run --sql SELECT(1) --to csv", "--to and --sql exclude each other"),
    ("export run --sql SELECT(1) --mean", "--mean and --sql exclude each other"),
    ("export run --sql SELECT(1) --csv --json", "--csv and --json are two forms of the same result"),
    ("inspect log.csv --yes", "--yes belongs to --out; give --out axis.toml too"),
    ("inspect log.csv --lines 50 --out axis.toml", "--lines and --out exclude each other"),
    ("doctor --out schema.json", "--out belongs to --schema; give --schema NAME too"),
    ("doctor --schema axis --bundle b.zip", "--bundle and --schema exclude each other"),
    ("doctor --receivers test --bundle b.zip", "--bundle and --receivers exclude each other"),
    ("doctor --schema axis none.toml runs/none", "none.toml and --schema exclude each other"),
    ("doctor --receivers list axis.toml runs/none", "runs/none and --receivers exclude each other"),
    ("doctor --receivers list axis.toml other.toml", "other.toml and --receivers exclude each other"),
]


@pytest.mark.parametrize(("command", "sentence"), REFUSED)
def test_an_option_of_the_other_use_is_refused(command: str, sentence: str) -> None:
    refused = livebode(*command.split())
    assert (refused.code, sentence in refused.err) == (2, True), refused


def test_an_option_with_its_default_counts_as_specified() -> None:
    assert "--rows belongs to --sql" in livebode("export", "run", "--to", "csv", "--rows", 1000).err
