"""The results of many runs as Delta tables below one URL, which DuckDB, Spark and Polars read as well."""

from livebode.core import needing

with needing("PyArrow", "archive", "a lake"), needing("deltalake", "archive", "a lake"):
    from livebode_plant.lake.compaction import CompactionResult, compact
    from livebode_plant.lake.data_file import DataFile, Key
    from livebode_plant.lake.lake import Lake
    from livebode_plant.lake.lake_run import LakeRun, runs_of
    from livebode_plant.lake.schemas import (
        COVARIANCE,
        EVENTS,
        FILES,
        FLEET_EVENTS,
        FLEET_PARAMETERS,
        FLEET_RESPONSES,
        FLEET_RUNS,
        FLEET_SAMPLES,
        FLEET_SCHEMAS,
        PARAMETER_MEANS,
        PARAMETERS,
        QUANTITIES,
        QUARANTINE,
        RESPONSE_MEANS,
        RESPONSES,
        RUNS,
        TABLES,
    )
    from livebode_plant.lake.stream_table import StreamTable

__all__ = [
    "COVARIANCE",
    "EVENTS",
    "FILES",
    "FLEET_EVENTS",
    "FLEET_PARAMETERS",
    "FLEET_RESPONSES",
    "FLEET_RUNS",
    "FLEET_SAMPLES",
    "FLEET_SCHEMAS",
    "PARAMETERS",
    "PARAMETER_MEANS",
    "QUANTITIES",
    "QUARANTINE",
    "RESPONSES",
    "RESPONSE_MEANS",
    "RUNS",
    "TABLES",
    "CompactionResult",
    "DataFile",
    "Key",
    "Lake",
    "LakeRun",
    "StreamTable",
    "compact",
    "runs_of",
]
