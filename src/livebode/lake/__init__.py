"""The results of many runs as Delta tables below one URL, which DuckDB, Spark and Polars read as well."""

from livebode.core.installing import needing

with needing("PyArrow", "archive", "a lake"):
    from livebode.lake.compaction import Compacted, compact
    from livebode.lake.data_file import DataFile, Key
    from livebode.lake.fleet_schemas import (
        FLEET_EVENTS,
        FLEET_PARAMETERS,
        FLEET_RESPONSES,
        FLEET_RUNS,
        FLEET_SAMPLES,
        FLEET_SCHEMAS,
        PARAMETER_MEANS,
        RESPONSE_MEANS,
    )
    from livebode.lake.lake import Lake
    from livebode.lake.lake_run import LakeRun, runs_of
    from livebode.lake.schemas import (
        COVARIANCE,
        EVENTS,
        FILES,
        PARAMETERS,
        QUANTITIES,
        QUARANTINE,
        RESPONSES,
        RUNS,
        TABLES,
    )
    from livebode.lake.stream_table import StreamTable

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
    "Compacted",
    "DataFile",
    "Key",
    "Lake",
    "LakeRun",
    "StreamTable",
    "compact",
    "runs_of",
]
