"""What a run leaves on disk."""

from livebode.records.run_directory import RunDirectory

__all__ = ["RunDirectory"]
