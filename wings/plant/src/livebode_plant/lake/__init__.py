"""The results of many runs as Delta tables below one URL, which DuckDB, Spark and Polars read as well."""

from livebode.core import needing

with needing("PyArrow", "archive", "a lake"), needing("deltalake", "archive", "a lake"):
    from livebode_plant.lake.compaction import CompactionResult, compact
    from livebode_plant.lake.data_file import DataFile, Key
    from livebode_plant.lake.lake import Lake
    from livebode_plant.lake.lake_run import LakeRun, runs_of
    from livebode_plant.lake.schemas import TABLES
    from livebode_plant.lake.stream_table import StreamTable

__all__ = ["TABLES", "CompactionResult", "DataFile", "Key", "Lake", "LakeRun", "StreamTable", "compact", "runs_of"]
