"""The record of a run that may be killed at any moment: a journal that is appended to, and Parquet once it is closed.

Only what reads it is imported by the rest of `livebode.records`; `Store` writes, and needs a POSIX system.
"""
