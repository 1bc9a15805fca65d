"""What a run leaves on disk."""

from livebode.records.plain_json import to_json
from livebode.records.read_run import read_run
from livebode.records.run_directory import RunDirectory

__all__ = ["RunDirectory", "read_run", "to_json"]
