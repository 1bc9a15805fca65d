"""The language in which report and dashboard are read: catalogues of sentences, numbers and dates.

The English sentences are the keys. Translators edit `catalogues/*.po`; ``make catalogues`` writes the JSON
files that Python and the page read at run time. Terminal, log, record and JSON output are always English.
"""

from livebode.language.catalogue import ENGLISH, Catalogue, available, catalogue
from livebode.language.negotiation import for_page, negotiated
from livebode.language.recognition import recognised
from livebode.language.translation import current_language, date, in_language, listed, marked, number, numerals, tr, trn

__all__ = [
    "ENGLISH",
    "Catalogue",
    "available",
    "catalogue",
    "current_language",
    "date",
    "for_page",
    "in_language",
    "listed",
    "marked",
    "negotiated",
    "number",
    "numerals",
    "recognised",
    "tr",
    "trn",
]
