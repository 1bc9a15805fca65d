"""Numbers and types of Parquet that the house writes and reads: https://github.com/apache/parquet-format."""

from __future__ import annotations

from typing import NamedTuple

from livebode.tables.table import STRING

MAGIC = b"PAR1"
ARROW_SCHEMA = "ARROW:schema"
"""Key of Arrow's schema in the metadata of a file; it has the metadata of the columns."""
WRITER = "livebode"
"""Named in the footer of a file that the house wrote."""
UNCOMPRESSED, LZ4_RAW = 0, 7
PLAIN, PLAIN_DICTIONARY, RLE, BIT_PACKED, RLE_DICTIONARY = 0, 2, 3, 4, 8
DATA_PAGE, INDEX_PAGE, DICTIONARY_PAGE, DATA_PAGE_V2 = range(4)
REQUIRED, OPTIONAL, REPEATED = range(3)
BOOLEAN, INT32, INT64, INT96, FLOAT, DOUBLE_TYPE, BYTE_ARRAY, FIXED_BYTES = range(8)
PACKED_MAX = 100_000
"""Highest plausible compression ratio of a recording; what declares more is damaged."""
CODECS = "none", "Snappy", "GZIP", "LZO", "Brotli", "LZ4", "Zstandard", "LZ4_RAW"


class Form(NamedTuple):
    """How a kind of column is stored: physical type, type in NumPy of its values, and converted type, if any."""

    physical: int
    dtype: str
    converted: int | None


FORMS = {
    "bool": Form(BOOLEAN, "?", None),
    "int8": Form(INT32, "<i4", 15),
    "int16": Form(INT32, "<i4", 16),
    "int32": Form(INT32, "<i4", None),
    "int64": Form(INT64, "<i8", None),
    "uint8": Form(INT32, "<u4", 11),
    "uint16": Form(INT32, "<u4", 12),
    "uint32": Form(INT32, "<u4", 13),
    "uint64": Form(INT64, "<u8", 14),
    "float32": Form(FLOAT, "<f4", None),
    "float64": Form(DOUBLE_TYPE, "<f8", None),
    STRING: Form(BYTE_ARRAY, "", 0),
}
"""By kind of column. Half precision floats have no form here: a file of them is read with PyArrow."""
