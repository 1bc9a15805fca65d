"""Write and read the directory of a run."""

from livebode.records.matrix_table import COVARIANCE, MATRIX_RESPONSES, covariance_rows, matrix_rows
from livebode.records.parameter_table import PARAMETERS, parameter_rows
from livebode.records.plain_json import to_json
from livebode.records.response_table import RESPONSES, as_batch
from livebode.records.run import RunRecord
from livebode.records.run_directory import RunDirectory

__all__ = [
    "COVARIANCE",
    "MATRIX_RESPONSES",
    "PARAMETERS",
    "RESPONSES",
    "RunDirectory",
    "RunRecord",
    "as_batch",
    "covariance_rows",
    "matrix_rows",
    "parameter_rows",
    "to_json",
]
