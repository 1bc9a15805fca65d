"""`livebode doctor --schema` prints the schema of a file, or writes it where no file is lost."""

import json

import pytest

from livebode.configuration import axis_schema
from livebode_design.experiment_schema import experiment_schema
from tests.support.command import livebode


@pytest.mark.parametrize(("file", "schema"), [("axis", axis_schema), ("experiment", experiment_schema)])
def test_the_schema_is_printed_or_written(file, schema, tmp_path):
    path = tmp_path / "here" / "schema.json"
    assert json.loads(livebode("doctor", "--schema", file).out) == schema()
    assert livebode("doctor", "--schema", file, "--out", path).out.strip() == str(path)
    assert json.loads(path.read_text("utf-8")) == schema()


def test_a_file_is_replaced_only_with_force(tmp_path):
    path = tmp_path / "axis.toml"
    path.write_text("mine")
    refused = livebode("doctor", "--schema", "axis", "--out", path)
    assert (refused.code, path.read_text()) == (2, "mine")
    assert livebode("doctor", "--schema", "axis", "--out", path, "--force").code == 0
    assert json.loads(path.read_text("utf-8")) == axis_schema()


def test_another_file_has_no_schema():
    refused = livebode("doctor", "--schema", "run", "--json")
    assert (refused.code, json.loads(refused.err)["error"]["code"]) == (2, "usage.not-one-of")
