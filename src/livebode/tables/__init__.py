"""Tables in memory, and their files: flat Parquet, messages of Arrow IPC and delimited text, by code of the house.

A table is NumPy columns with a schema; all that reads Arrow exchanges it without a copy. `from_numpy`, `text` and
`to_numpy` convert columns to PyArrow's arrays and back. docs/decisions/0013-parquet-arrow-text.md says why the code is
livebode's own; what is behind these names, no other package imports.
"""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
