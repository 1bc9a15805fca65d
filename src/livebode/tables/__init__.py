"""Tables in memory: NumPy columns with a schema, and their exchange with all that reads Arrow."""

from livebode.tables.schema import STRING, Field, Schema
from livebode.tables.table import Table
from livebode.tables.text import Text

__all__ = ["STRING", "Field", "Schema", "Table", "Text"]
