"""What a run leaves on disk, written and read back."""

from livebode.records.plain_json import to_json
from livebode.records.run import Run
from livebode.records.run_directory import RunDirectory

__all__ = ["Run", "RunDirectory", "to_json"]
