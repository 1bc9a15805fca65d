"""Write and read the directory of a run."""

from livebode.records.parameter_table import PARAMETERS, parameter_rows
from livebode.records.plain_json import to_json
from livebode.records.response_table import RESPONSES, as_batch
from livebode.records.run import RunRecord
from livebode.records.run_directory import RunDirectory

__all__ = ["PARAMETERS", "RESPONSES", "RunDirectory", "RunRecord", "as_batch", "parameter_rows", "to_json"]
