"""What a run leaves on disk."""

from livebode.records.plain_json import to_json
from livebode.records.run_directory import RunDirectory

__all__ = ["RunDirectory", "to_json"]
