"""The results of many runs as Delta tables below one URL, which DuckDB, Spark and Polars read as well."""

from livebode.lake.compaction import Compacted, compact
from livebode.lake.data_file import DataFile, Key
from livebode.lake.lake import Lake
from livebode.lake.lake_run import LakeRun, runs_of
from livebode.lake.schemas import EVENTS, FILES, PARAMETERS, QUANTITIES, QUARANTINE, RESPONSES, RUNS, TABLES

__all__ = [
    "EVENTS",
    "FILES",
    "PARAMETERS",
    "QUANTITIES",
    "QUARANTINE",
    "RESPONSES",
    "RUNS",
    "TABLES",
    "Compacted",
    "DataFile",
    "Key",
    "Lake",
    "LakeRun",
    "compact",
    "runs_of",
]
