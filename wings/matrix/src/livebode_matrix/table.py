"""The kind of estimate of this wing, with its rules, and what the wing adds to the page of a run."""

from collections.abc import Mapping

ESTIMATES: Mapping[str, Mapping[str, str]] = {
    "matrix": {
        "check": "livebode_matrix.configuration:check_matrix",
        "baseline": "livebode_matrix.baseline:MatrixBaseline",
        "machine": "livebode_matrix.gantry_file:read_gantry",
        "changes": "livebode_matrix.whole_changes:whole_changes",
        "fit": "livebode_matrix.run_fit:fit_matrix_run",
        "estimate": "livebode_matrix.response_matrix:ResponseMatrix",
        "recording": "livebode_matrix.response_matrix:examined_matrix",
        "draw": "livebode_matrix.terminal:draw_matrix",
        "show": "livebode_matrix.terminal:show_matrix",
        "page": "livebode.dashboard.run_feed:views_of_matrix",
        "export": "livebode.cli.export_command:matrices",
    }
}
PAGES: Mapping[str, str] = {"matrix": "livebode_matrix.page:MatrixPage"}
"""What it adds to the page of a run."""
