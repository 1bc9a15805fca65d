"""The language in which report and dashboard are read: catalogues of sentences, numbers and dates.

The English sentences are the keys. Translators edit `catalogues/*.po`; ``make catalogues`` writes the JSON
files that Python and the page read at run time. Terminal, log, record and JSON output are always English.
"""

from livebode.on_first_use import on_first_use

__getattr__, __dir__, __all__ = on_first_use(__name__, __file__)
