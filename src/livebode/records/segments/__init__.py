"""The record of a run that may be killed at any time: an append-only journal, and Parquet after it is closed.

The rest of `livebode.records` imports only the reading part; `Store` writes, and needs a POSIX system.
"""
